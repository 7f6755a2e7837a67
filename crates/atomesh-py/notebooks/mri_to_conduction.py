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
# # From a scan to heat conduction
#
# A scan with voxels of unequal size, taken at an angle, becomes tetrahedra; scikit-fem computes the temperature of an organ
# with a hot core. Core and organ are spheres, so that the answer is known.
#
# Needs `nibabel`, `SimpleITK` and `scikit-fem`.

# %%
import os
import warnings
from pathlib import Path

import nibabel as nib
import numpy as np
import SimpleITK as sitk
import skfem
from skfem.helpers import dot, grad

import atomesh as am

# %% [markdown]
# ## A scan
#
# nibabel's arrays have axes i, j, k and a matrix that takes them to RAS: right, anterior, superior, in millimetres.

# %%
CORE, ORGAN = 16.0, 38.0  # radii
CENTRE = np.array([5.0, -12.0, 30.0])  # in RAS
SHAPE, ZOOMS = (64, 60, 42), (1.5, 1.6, 2.4)


def turned(axis, degrees):
    """A rotation about an axis."""
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i], matrix[j, j], matrix[i, j], matrix[j, i] = c, c, -s, s
    return matrix


affine = np.eye(4)
affine[:3, :3] = turned(0, 12) @ turned(2, -20) @ np.diag(ZOOMS)
affine[:3, 3] = CENTRE - affine[:3, :3] @ ((np.array(SHAPE) - 1) / 2)

places = np.moveaxis(np.indices(SHAPE), 0, -1) @ affine[:3, :3].T + affine[:3, 3]
radius = np.linalg.norm(places - CENTRE, axis=-1)
tissue = np.select([radius < CORE, radius < ORGAN], [2, 1], 0).astype(np.uint8)
grey = np.select([tissue == 2, tissue == 1], [190.0, 110.0], 15.0)
grey += np.random.default_rng(0).normal(scale=6, size=SHAPE)

scan = nib.Nifti1Image(grey.astype(np.float32), affine)
segmentation = nib.Nifti1Image(tissue, affine)
scan.header.set_xyzt_units("mm")

# %% [markdown]
# ## Frames
#
# `Image.of` takes frame and order of axes from the object. Arrays of atomesh are z, y, x, and coordinates x first, in RAS
# as nibabel's; volumes of SimpleITK, which has them in LPS (left, posterior, superior), are turned.

# %%
image, labels = am.Image.of(scan), am.Image.of(segmentation)
assert image.array.shape == SHAPE[::-1] and image.shape == SHAPE
assert np.allclose(image.spacing, ZOOMS) and image.units == ["mm"] * 3
assert np.allclose(image.origin, affine[:3, 3])

# SimpleITK reads the same file to the same places
nib.save(scan, "scan.nii.gz")
by_itk = am.Image.of(sitk.ReadImage("scan.nii.gz"))
assert np.array_equal(by_itk.array, image.array)
assert np.allclose(by_itk.spacing, image.spacing, atol=1e-6) and np.allclose(by_itk.direction, image.direction, atol=1e-6)
assert np.allclose(by_itk.origin, image.origin, atol=1e-4)

# %% [markdown]
# ## Tetrahedra
#
# Points go onto the edges of the grey image; `labels` says which cell is which tissue. Both surfaces are tagged:
# `interface-0-1` is the skin, `interface-1-2` the core's.

# %%
mesh = am.mesh(image, size=6, features="edges", labels=labels)
mesh

# %%
volumes = np.abs(np.linalg.det(mesh.points[mesh.cells][:, 1:] - mesh.points[mesh.cells][:, :1])) / 6
print(f"{mesh.cell_count} tetrahedra; regions {mesh.region_names}")
for name, wanted, share in (
    ("interface-0-1", ORGAN, volumes[mesh.regions > 0].sum()),
    ("interface-1-2", CORE, volumes[mesh.regions == 2].sum()),
):
    on = np.linalg.norm(mesh.points[np.unique(mesh.facets[name])] - CENTRE, axis=1)
    ratio = share / (4 / 3 * np.pi * wanted**3)
    print(f"{name}: {np.mean(np.abs(on - wanted) < 0.8):.1%} of its points within 0.8 mm of r = {wanted}; volume {ratio:.3f}")
    assert np.mean(np.abs(on - wanted) < 0.8) > 0.9
    assert 0.9 < ratio < 1.01  # flat facets between points on a sphere cut its volume
quality = mesh.quality()
assert quality["inverted"] == 0 and quality["q_mean"] > 0.85

# %%
Path("mri.png").write_bytes(mesh.picture())

# %% [markdown]
# ## Conduction
#
# The core makes heat, q per unit of volume; the skin is held at 0. scikit-fem gets regions as subdomains and surfaces as
# boundaries, by their names.

# %%
K_ORGAN, K_CORE, HEAT = 0.2, 0.5, 1e-3
whole = mesh.to_skfem()
organ = whole.restrict(np.concatenate([whole.subdomains["region-1"], whole.subdomains["region-2"]]))
assert {"interface-0-1", "interface-1-2"} <= set(organ.boundaries)


@skfem.BilinearForm
def stiffness(u, v, w):
    return w.k * dot(grad(u), grad(v))


@skfem.LinearForm
def source(v, w):
    return HEAT * v


def temperature(element):
    """Temperature, what flows out of the skin, and what the core makes."""
    basis = skfem.Basis(organ, element)
    conductivity = basis.with_element(skfem.ElementTetP0())
    k = np.full(conductivity.N, K_ORGAN)
    k[conductivity.get_dofs(elements="region-2")] = K_CORE
    matrix = skfem.asm(stiffness, basis, k=conductivity.interpolate(k))
    load = skfem.asm(source, skfem.Basis(organ, element, elements="region-2"))
    skin = basis.get_dofs("interface-0-1")
    u = skfem.solve(*skfem.condense(matrix, load, D=skin))
    return u, (load - matrix @ u)[skin.flatten()].sum(), load


u1, out1, load1 = temperature(skfem.ElementTetP1())
u2, out2, load2 = temperature(skfem.ElementTetP2())

# %% [markdown]
# The temperature in the middle of two spheres of radii a and b is q a² / (6 k₂) + q a³ (1/a − 1/b) / (3 k₁). The radii are
# those of spheres of the mesh's volumes.


# %%
def in_the_middle(a, b):
    return HEAT * a**2 / (6 * K_CORE) + HEAT * a**3 / (3 * K_ORGAN) * (1 / a - 1 / b)


made = HEAT * volumes[mesh.regions == 2].sum()
radii = [(0.75 / np.pi * volumes[mesh.regions >= least].sum()) ** (1 / 3) for least in (2, 1)]
for name, u, out in (("first order", u1, out1), ("second order", u2, out2)):
    print(f"{name}: {u.max():.4f}; {u.max() / in_the_middle(*radii):.3f} of the exact, {u.max() / in_the_middle(CORE, ORGAN):.3f} of true spheres'")
    assert abs(out / made - 1) < 1e-9  # all that is made flows out
    assert abs(u.max() / in_the_middle(*radii) - 1) < 0.03
    assert abs(u.max() / in_the_middle(CORE, ORGAN) - 1) < 0.06
# the more functions there are to choose from, the greater the compliance: a bound that holds on any mesh
assert load1 @ u1 < load2 @ u2

# %% [markdown]
# ## Meshing one tissue alone
#
# `mask` keeps the mesh to a part of the image, up to its smooth outline, whose facets are the group `mask`.

# %%
mask = am.Image((labels.array > 0).astype(np.uint8), labels.spacing, labels.origin, labels.direction)
with warnings.catch_warnings():
    warnings.simplefilter("ignore", am.AtomeshWarning)  # flat cells near the outline
    alone = am.mesh(image, size=6, features="none", mask=mask)
outline = np.linalg.norm(alone.points[np.unique(alone.facets["mask"])] - CENTRE, axis=1)
print(f"{alone.cell_count} tetrahedra; the outline at r = {outline.min():.2f} to {outline.max():.2f}")
assert abs(outline - ORGAN).max() < 1.2
assert (np.linalg.norm(alone.points - CENTRE, axis=1) < ORGAN + 1.2).all()

# %% [markdown]
# ## Your own scan
#
# Where `ATOMESH_DATA` names a folder with `mni152-t1.nii.gz`, the MNI brain:

# %%
real = Path(os.environ.get("ATOMESH_DATA", ""), "mni152-t1.nii.gz")
if "ATOMESH_DATA" in os.environ and real.exists():
    brain = am.mesh(am.Image.of(nib.load(real)), size=10, features="edges")
    print(f"{brain.cell_count} tetrahedra")
    assert brain.quality()["inverted"] == 0
