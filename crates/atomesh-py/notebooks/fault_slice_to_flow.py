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
# # From a seismic section to flow past its faults
#
# A noisy section of amplitudes goes in. Faults are found in it, meshed, and sealed; water flows from one well to another
# around them. Triangles with discontinuous Galerkin elements and Voronoi cells with two-point fluxes must agree.
#
# Lengths are in samples, 12.5 m each.

# %%
import os
from pathlib import Path

import numpy as np

import atomesh as am

# %% [markdown]
# ## A section with two faults
#
# Layers of random reflectivity, blurred by a wavelet. Across each fault they are shifted down; `throw` fades out towards
# the ends of the faults, so that fluid finds a way around.

# %%
NZ, NX = 160, 240
FAULTS = [((65.0, 20.0), (105.0, 120.0)), ((185.0, 159.0), (140.0, 50.0))]  # ends (x, z)
rng = np.random.default_rng(4)
z, x = np.mgrid[:NZ, :NX].astype(float)


def throw(ends, height=9.0):
    """How far the layers at (x, z) have slid down on the right side of a fault."""
    (x0, z0), (x1, z1) = sorted(ends, key=lambda end: end[1])
    share = (z - z0) / (z1 - z0)
    line = x0 + share * (x1 - x0)
    inside = (share >= 0) & (share <= 1)
    # a smooth end at both tips, and drag that dies out away from the fault
    taper = np.where(inside, np.sin(np.pi * np.clip(share, 0, 1)) ** 0.4, 0)
    return np.where(x > line, 1, -1) * 0.5 * height * taper * np.exp(-np.abs(x - line) / 60)


depth = z - sum(throw(ends) for ends in FAULTS)
reflectivity = np.convolve(rng.normal(size=NZ + 80), np.exp(-(np.linspace(-2, 2, 9) ** 2)), "same")
section = np.interp(depth + 40, np.arange(NZ + 80), reflectivity) + 0.1 * rng.normal(size=(NZ, NX))
section = section.astype(np.float32)

# %% [markdown]
# ## The mesh
#
# `features="faults"` compares amplitudes along the layers, and averages along the fault's dip: over `dip_reach` samples,
# about which faults come out too long at their tips. So short an average lets noise through, in short pieces: what is shorter
# than `least_length` is dropped. The wells are `fixed` atoms: they become points of the mesh.

# %%
wells = {"injector": (28.0, 70.0), "producer": (215.0, 90.0)}
options = {"size": 8, "features": "faults", "dip_reach": 6, "least_length": 30}
mesh = am.mesh(section, fixed=list(wells.values()), **options)
mesh

# %%
faults = mesh.features()
lengths = {fault.name: fault.info["measure"] for fault in faults}
lengths

# %% [markdown]
# Two faults, within a sample or two of those that were drawn.

# %%
assert len(faults) == 2


def off_line(point, ends):
    """The distance of a point from a line."""
    (x0, z0), (x1, z1) = ends
    along = np.array([x1 - x0, z1 - z0]) / np.hypot(x1 - x0, z1 - z0)
    to_point = np.asarray(point) - (x0, z0)
    return abs(to_point[0] * along[1] - to_point[1] * along[0])


for fault in faults:
    nearest = min(FAULTS, key=lambda ends: max(off_line(p, ends) for p in fault.points))
    off = [off_line(p, nearest) for p in fault.points]
    drawn = np.hypot(nearest[1][0] - nearest[0][0], nearest[1][1] - nearest[0][1])
    print(f"{fault.name}: {fault.info['measure']:.0f} of {drawn:.0f} samples, at most {max(off):.1f} off")
    assert max(off) < 2 and 0.9 * drawn < fault.info["measure"] < 1.15 * drawn

# every well is a point of the mesh
for place in wells.values():
    assert np.abs(mesh.points - place).sum(axis=1).min() < 1e-9

# %% [markdown]
# ## Flow
#
# Features seal unless `barriers` or `multiplier` let a share through. All that the injector gives, the producer takes.

# %%
flow = mesh.flow(sources=[wells["injector"]], sinks=[wells["producer"]])
balance = flow.balance
assert abs(balance["wells_in"] - 1) < 1e-12 and abs(balance["wells_out"] - 1) < 1e-12
assert abs(balance["error"]) < 1e-10
group = np.array(flow.facets["group"])
for fault in faults:
    assert np.abs(flow.fluxes[group == fault.name]).max() < 1e-12  # sealed
flow

# %%
lines = flow.streamlines(24)
arrival = np.array([line.times[-1] for line in lines if line.sink is not None])
print(f"{len(arrival)} of {len(lines)} streamlines arrive; the first after {arrival.min():.0f}, half after {np.median(arrival):.0f}")
assert len(arrival) >= 22
assert all(np.hypot(*(line.points[-1] - wells["producer"])) < 8 for line in lines if line.sink is not None)

# %% [markdown]
# The picture: pressure, with streamlines coloured by their time of flight.

# %%
Path("fault-slice-flow.png").write_bytes(flow.picture("pressure", streamlines=24))

# %% [markdown]
# ## Voronoi cells give the same answer
#
# From pressure 1 on the left to 0 on the right: the total flow of two meshes and two schemes. Without faults it would be
# height over width. Triangles with elements of second order have the answer at any of these sizes; two-point fluxes, which
# see the gap above a fault as one or two cells, come to it as cells become small.

# %%
sides = {"xmin": 1.0, "xmax": 0.0}
by_triangles = mesh.flow(sides=sides).balance["boundary_in"]
open_flow = mesh.flow(sides=sides, multiplier=1.0).balance["boundary_in"]
off = []
for size in (8, 3):
    cells = am.mesh(section, kind="voronoi", **{**options, "size": size})
    by_cells = cells.flow(sides=sides).balance["boundary_in"]
    off.append(abs(by_cells / by_triangles - 1))
    print(f"size {size}: triangles {by_triangles:.4f}, {cells.cell_count} Voronoi cells {by_cells:.4f}, {off[-1]:.1%} off")
print(f"open faults {open_flow:.4f}")
assert off[0] < 0.12 and off[1] < 0.05
assert abs(open_flow - (NZ - 1) / (NX - 1)) < 1e-9
assert by_triangles < 0.5 * open_flow

# %% [markdown]
# Faults that leak lie between sealed and open.

# %%
leaky = [mesh.flow(sides=sides, multiplier=share).balance["boundary_in"] for share in (0.01, 0.1)]
assert by_triangles < leaky[0] < leaky[1] < open_flow

# %% [markdown]
# ## Your own section
#
# Where the environment variable `ATOMESH_DATA` names a folder with `f3-amplitude.npy`, a section of the Dutch F3 survey,
# the same lines mesh it.

# %%
real = Path(os.environ.get("ATOMESH_DATA", ""), "f3-amplitude.npy")
if "ATOMESH_DATA" in os.environ and real.exists():
    image = am.read(real)
    if len(image.shape) == 2:
        mesh = am.mesh(image, size=12, features="faults")
        print(mesh.cell_count, "triangles", len(mesh.features()), "faults")
        assert mesh.quality()["inverted"] == 0
