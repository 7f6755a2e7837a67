# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From a micrograph with three phases to Abaqus
#
# A grey micrograph of a matrix with hard grains and soft fibres is segmented, meshed along the interfaces, and written as an
# Abaqus input file of second order with sets. The conductivity of the whole, by scikit-fem and by atomesh's own flow, must
# lie between the bounds of Voigt and Reuss.
#
# Needs `scipy`, `meshio` and `scikit-fem`.

# %%
from pathlib import Path

import meshio
import numpy as np
import skfem
from scipy import ndimage
from skfem.helpers import dot, grad

import atomesh as am

# %% [markdown]
# ## A micrograph
#
# Grains are bright, fibres dark, and the matrix between them grey; 0.5 µm a sample.

# %%
SIDE, STEP = 160, 0.5
MATRIX, GRAIN, FIBRE = 1, 2, 3
rng = np.random.default_rng(7)
y, x = np.mgrid[:SIDE, :SIDE].astype(float)
phases = np.full((SIDE, SIDE), MATRIX, np.uint8)
placed = []
for phase, long, short, count in ((GRAIN, 11, 11, 9), (FIBRE, 17, 7, 4)):
    while count:
        middle = rng.uniform(24, SIDE - 24, 2)
        if any(np.hypot(*(middle - other)) < long + reach + 5 for other, reach in placed):
            continue
        turn = rng.uniform(0, np.pi)
        u = (x - middle[0]) * np.cos(turn) + (y - middle[1]) * np.sin(turn)
        v = (y - middle[1]) * np.cos(turn) - (x - middle[0]) * np.sin(turn)
        phases[(u / long) ** 2 + (v / short) ** 2 < 1] = phase
        placed.append((middle, long))
        count -= 1
grey = np.array([0, 110, 200, 30])[phases] + rng.normal(scale=12, size=phases.shape)
micrograph = np.clip(grey, 0, 255).astype(np.uint8)

# %% [markdown]
# ## Labels
#
# A median takes the noise off; two thresholds part the phases. Any other segmentation will do.

# %%
smooth = ndimage.median_filter(micrograph, 5)
labels = np.select([smooth > 155, smooth < 70], [GRAIN, FIBRE], MATRIX).astype(np.uint8)
assert (labels == phases).mean() > 0.99

# %% [markdown]
# ## The mesh
#
# `features="labels"` puts points on the boundaries between labels, `labels=` says which cell is of which phase.

# %%
image = am.Image(labels, spacing=(STEP, STEP), units=["um", "um"])
mesh = am.mesh(image, size=5 * STEP, features="labels", labels=image)
mesh

# %%
areas = 0.5 * np.abs(np.linalg.det(mesh.points[mesh.cells][:, 1:] - mesh.points[mesh.cells][:, :1]))
shares = {phase: areas[mesh.regions == phase].sum() / areas.sum() for phase in (MATRIX, GRAIN, FIBRE)}
print({phase: f"{share:.4f}, in the image {np.mean(labels == phase):.4f}" for phase, share in shares.items()})
for phase, share in shares.items():
    assert abs(share - np.mean(labels == phase)) < 0.01
assert {"interface-1-2", "interface-1-3"} <= set(mesh.facets)
assert "interface-2-3" not in mesh.facets  # no grain touches a fibre
assert mesh.quality()["angle_min"] > 20
Path("micrograph.png").write_bytes(mesh.picture(am.Image(micrograph, spacing=(STEP, STEP))))

# %% [markdown]
# ## Abaqus
#
# `order=2` writes triangles of six points (CPS6); sets of elements for regions, of nodes and surfaces for groups of facets.
# meshio reads them back. It knows plane strain (CPE6) by name, but not plane stress, so it is told.

# %%
mesh.write("micrograph.inp", order=2)
meshio.abaqus._abaqus.abaqus_to_meshio_type["CPS6"] = "triangle6"
back = meshio.read("micrograph.inp")
(block,) = back.cells
assert block.type == "triangle6" and len(block.data) == mesh.cell_count
assert np.allclose(back.points[block.data[:, :3], :2], mesh.points[mesh.cells])
middles = 0.5 * (back.points[block.data[:, [0, 1, 2]]] + back.points[block.data[:, [1, 2, 0]]])
assert np.allclose(back.points[block.data[:, 3:]], middles)
for phase in (MATRIX, GRAIN, FIBRE):
    (elements,) = back.cell_sets[f"region-{phase}"]
    assert np.array_equal(np.sort(elements), np.flatnonzero(mesh.regions == phase))
assert np.allclose(back.points[back.point_sets["xmax"], 0], STEP * (SIDE - 1))
sorted(back.point_sets)[:8]

# %% [markdown]
# ## The conductivity of the whole
#
# Temperature falls from 1 on the left to 0 on the right; above and below are insulated. Fluxes that are the same everywhere
# bound the conductivity from below (Reuss), temperatures that fall evenly from above (Voigt): on this mesh too.

# %%
K = {MATRIX: 1.0, GRAIN: 10.0, FIBRE: 0.1}
made = mesh.to_skfem()
assert {"xmin", "xmax", "interface-1-2"} <= set(made.boundaries) and "region-3" in made.subdomains


@skfem.BilinearForm
def conduction(u, v, w):
    return w.k * dot(grad(u), grad(v))


def homogenised(element):
    """The conductivity along x."""
    basis = skfem.Basis(made, element)
    constant = basis.with_element(skfem.ElementTriP0())
    k = constant.zeros()
    for phase, value in K.items():
        k[constant.get_dofs(elements=f"region-{phase}")] = value
    matrix = skfem.asm(conduction, basis, k=constant.interpolate(k))
    held = basis.get_dofs({"xmin", "xmax"})
    u = basis.zeros()
    u[basis.get_dofs("xmin")] = 1.0
    u = skfem.solve(*skfem.condense(matrix, x=u, D=held))
    return u @ matrix @ u  # times length over height, which are the same


first, second = homogenised(skfem.ElementTriP1()), homogenised(skfem.ElementTriP2())
voigt = sum(shares[phase] * K[phase] for phase in K)
reuss = 1 / sum(shares[phase] / K[phase] for phase in K)
print(f"Reuss {reuss:.4f} < {second:.4f} (second order) < {first:.4f} (first) < Voigt {voigt:.4f}")
assert reuss < second < first < voigt

# %% [markdown]
# atomesh's own flow is the same equation: k is the permeability, a value for each cell.

# %%
flow = mesh.flow(sides={"xmin": 1.0, "xmax": 0.0}, k=np.array([0, 1.0, 10.0, 0.1])[mesh.regions], multiplier=1.0)
print(f"atomesh {flow.balance['boundary_in']:.4f}")
assert abs(flow.balance["boundary_in"] / second - 1) < 0.01
flow

# %% [markdown]
# ## Files for other programs
#
# The same mesh for Gmsh and ParaView: the ending of the name says the format. Without `order=2` triangles are CPS3.

# %%
for name in ("micrograph.msh", "micrograph.vtu", "first.inp"):
    mesh.write(name)
    assert am.read_mesh(name).cell_count == mesh.cell_count
assert set(am.read_mesh("micrograph.msh").region_names.values()) == {"region-1", "region-2", "region-3"}
