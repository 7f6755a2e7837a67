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
# # Coming from pygalmesh, iso2mesh, nanomesh or SeismicMesh
#
# The same tasks in their words, which are shown, and in ours, which run. What differs most:
#
# - Atoms settle at about the distance wanted from each other, and on what the image shows. There is no surface mesh first.
# - The mesh fills the image's box; regions are labels of cells. `mask` leaves out what is outside.
# - Grey images need no segmentation: `features` says what in them matters.
# - Arrays have the axes z, y, x (x last); coordinates are x first.
# - Cells count from 0. No program is called and none downloaded.

# %%
from pathlib import Path

import numpy as np

import atomesh as am


def measures(mesh):
    """The areas or volumes of the cells."""
    corners = mesh.points[mesh.cells]
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / (2 if mesh.dim == 2 else 6)


# %% [markdown]
# ## pygalmesh: a ball from labels
#
# [pygalmesh](https://github.com/meshpro/pygalmesh) (GPL-3.0) is a frontend to CGAL:
#
# ```python
# import pygalmesh
#
# mesh = pygalmesh.generate_from_array(
#     ball, (0.5, 0.5, 0.5), max_cell_circumradius=2.0, max_facet_distance=0.25, seed=0
# )
# mesh.write("ball.vtu")  # a meshio.Mesh
# ```
#
# There array axes are x, y, z, and label 0 is not meshed. Here the first axis is z, and `features="labels"` puts points on
# the ball's boundary.

# %%
SIDE, STEP, RADIUS = 48, 0.5, 9.0
z, y, x = STEP * (np.indices((SIDE,) * 3) - (SIDE - 1) / 2)
ball = (x**2 + y**2 + z**2 < RADIUS**2).astype(np.uint8)

image = am.Image(ball, spacing=(STEP,) * 3)
mesh = am.mesh(image, size=2.0, features="labels", labels=image, seed=0)
mesh.write("ball.vtu")
mesh

# %%
middle = STEP * (SIDE - 1) / 2
on_ball = np.linalg.norm(mesh.points[np.unique(mesh.facets["interface-0-1"])] - middle, axis=1)
volume = measures(mesh)[mesh.regions == 1].sum() / (4 / 3 * np.pi * RADIUS**3)
print(f"{mesh.cell_count} cells; boundary at r = {on_ball.min():.2f} to {on_ball.max():.2f}; volume {volume:.3f} of the ball's")
assert abs(on_ball - RADIUS).max() < 0.5 * STEP
assert 0.95 < volume < 1.0
assert mesh.quality()["angle_min"] > 14  # dihedral, in degrees
as_meshio = mesh.to_meshio()  # to go on as before

# %% [markdown]
# Only the ball, as there: its cells alone, or `mask=`, which meshes no more than the ball.

# %%
inside = am.mesh(image, size=2.0, features="none", mask=image)
outline = np.linalg.norm(inside.points[np.unique(inside.facets["mask"])] - middle, axis=1)
print(f"{inside.cell_count} cells, {measures(inside).sum() / (4 / 3 * np.pi * RADIUS**3):.3f} of the ball's volume")
assert abs(outline - RADIUS).max() < 0.75 * STEP
assert abs(measures(inside).sum() / (4 / 3 * np.pi * RADIUS**3) - 1) < 0.02

# %% [markdown]
# | pygalmesh | atomesh |
# | --- | --- |
# | `vol`, axes x, y, z | array, axes z, y, x |
# | `voxel_size=(hx, hy, hz)` | `Image(array, spacing=(hx, hy, hz))`, also `origin`, `direction` |
# | `max_cell_circumradius=r` | `size=`, an edge length: 1.6 r of a regular cell |
# | `max_cell_circumradius={label: r}` | `size=` an image d(x), such as `np.select` on the labels gives |
# | `max_facet_distance` | none: points lie on the boundary, facets are as large as `size` |
# | `min_facet_angle`, `max_circumradius_edge_ratio` | `min_angle`, the least dihedral angle worked for |
# | `lloyd`, `odt`, `perturb`, `exude` | always: that is the method |
# | `seed` | `seed` |
# | `mesh.cell_data["medit:ref"]` | `mesh.regions`, `mesh.region_names` |
#
# Sources: pygalmesh's [README](https://github.com/meshpro/pygalmesh#readme) and
# [PyPI page](https://pypi.org/project/pygalmesh/).

# %% [markdown]
# ## iso2mesh: a ball from labels, graded
#
# [iso2mesh](https://github.com/NeuroJSON/pyiso2mesh) (GPL-3.0) runs CGAL or TetGen, which it downloads:
#
# ```python
# from iso2mesh.core import v2m
#
# node, elem, face = v2m(ball, [], 2, 4, "cgalmesh")  # img, isovalues, opt, maxvol, method
# elem[:, :4] - 1  # its indices count from 1; the fifth column is the label
# ```

# %%
distance = np.where(ball == 1, 1.5, 4.0).astype(np.float32)  # d(x); its slope is limited to 1/4
graded = am.mesh(image, size=am.Image(distance, image.spacing), features="labels", labels=image)
node, elem = graded.points, graded.cells
edges = np.linalg.norm(node[elem[:, 0]] - node[elem[:, 1]], axis=1)
inner, outer = np.median(edges[graded.regions == 1]), np.percentile(edges[graded.regions == 0], 95)
print(f"{len(elem)} cells; edges of {inner:.2f} in the ball, up to {outer:.2f} outside")
assert inner < 1.8 and outer > 2.5
face = graded.surface("interface-0-1")  # what `face` is there: points and triangles
assert face.cells.shape[1] == 3 and face.points.shape[1] == 3
face.write("ball.stl")

# %% [markdown]
# | iso2mesh | atomesh |
# | --- | --- |
# | `img`, indices as coordinates | array, or `Image` with `spacing`, `origin`, `direction` |
# | `isovalues` | none: `features="edges"` finds the steepest places of grey images |
# | `opt` (`radbound`), `maxvol` = V | `size=`, an edge length: 2 ∛V of a regular cell |
# | `maxvol="1=2:2=8"` by label | `size=` an image d(x) |
# | `method="cgalmesh"`, `"cgalsurf"`, `"simplify"` | one method |
# | `elem[:, 4]` | `mesh.regions` |
# | `face` | `mesh.facets`, `mesh.surface(name)` |
# | `meshquality(node, elem)` | `mesh.quality()` |
# | `saveabaqus`, `savemsh`, `savestl` | `mesh.write("m.inp")`, `"m.msh"`; `surface.write("s.stl")` |
#
# Source: pyiso2mesh's [README](https://github.com/NeuroJSON/pyiso2mesh#readme).

# %% [markdown]
# ## nanomesh: an image of two labels
#
# [nanomesh](https://nanomesh.readthedocs.io) (Apache 2.0) traces contours and hands them to Triangle (free for
# non-commercial use):
#
# ```python
# from nanomesh import Image, Mesher2D
#
# mesher = Mesher2D(Image(blobs))
# mesher.generate_contour(max_edge_dist=4, level=0.5)
# mesh = mesher.triangulate(opts="q30a14")
# triangles = mesh.get("triangle")
# ```

# %%
rng = np.random.default_rng(2)
across = np.fft.fftfreq(100)
wave = np.hypot(across[:, None], across[None, :])
noise = np.fft.ifft2(np.fft.fft2(rng.normal(size=(100, 100))) * np.exp(-((32 * wave) ** 2))).real
blobs = (noise > np.quantile(noise, 0.75)).astype(np.uint8)

mesh = am.mesh(blobs, size=4, features="labels", labels=blobs)
Path("blobs.png").write_bytes(mesh.picture())
mesh

# %%
share = measures(mesh)[mesh.regions == 1].sum() / measures(mesh).sum()
print(f"{mesh.cell_count} triangles; blobs {share:.4f}, in the image {blobs.mean():.4f}")
assert abs(share - blobs.mean()) < 0.01
assert mesh.quality()["angle_min"] > 20

# %% [markdown]
# | nanomesh | atomesh |
# | --- | --- |
# | `Image(array)`, `Plane`, `Volume` | array or `Image`; two axes or three |
# | `plane.gaussian(sigma=1)`, `threshold`, `digitize` | not needed for grey images; else scikit-image's |
# | `generate_contour(level=…, max_edge_dist=…)` | `features="labels"`, or `"edges"` of the grey image itself |
# | `triangulate(opts="q30a14")` | `min_angle=`, `size=`: 1.5 √a of an equilateral triangle of area a |
# | `tetrahedralize(opts="-pAq1.2")` | the same `am.mesh` of three axes |
# | `group_regions=False` | `labels=` of connected parts, as `scipy.ndimage.label` numbers them |
# | `mesh.get("triangle").cell_data["physical"]` | `mesh.regions` |
# | `mesh.write("m.msh", file_format="gmsh22")` | `mesh.write("m.msh2")` |
# | `compare_with_mesh`, `metrics` | `mesh.plot()`, `mesh.quality()`, `mesh.report()` |
#
# Source: nanomesh's [documentation](https://nanomesh.readthedocs.io/en/latest/).

# %% [markdown]
# ## SeismicMesh: a velocity model
#
# [SeismicMesh](https://seismicmesh.readthedocs.io) (GPL-3.0) sizes edges by the shortest wavelength:
#
# ```python
# from SeismicMesh import Rectangle, generate_mesh, get_sizing_function_from_segy
#
# bbox = (-2975.0, 0.0, 0.0, 5975.0)  # z, then x
# ef = get_sizing_function_from_segy("velocity.segy", bbox, hmin=75.0, wl=6, freq=3, grade=0.15)
# points, cells = generate_mesh(domain=Rectangle(bbox), edge_length=ef, h0=75.0)
# ```
#
# Here the velocities are the image, and the salt's outline is followed too.

# %%
velocity = np.repeat(1500.0 + 15.0 * np.arange(120)[:, None], 240, axis=1).astype(np.float32)  # m/s
velocity[60:80, 80:160] = 4500  # salt
model = am.Image(velocity, spacing=(25, 25), units=["m", "m"])  # am.read("velocity.segy") gives one too

FREQUENCY, COUNT = 3.0, 6  # Hz; edges in a wavelength
mesh = am.mesh(model, frequency=FREQUENCY, points_per_wavelength=COUNT, features="edges")
Path("velocity.png").write_bytes(mesh.picture())
mesh

# %% [markdown]
# Edges against v / f / 6, cell by cell:

# %%
corners = mesh.points[mesh.cells]
length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
v = mesh.sample(model, "min", name="velocity")
ratio = length / (v / FREQUENCY / COUNT)
print(f"{mesh.cell_count} triangles; edges over wanted ones: {np.percentile(ratio, [1, 50, 99]).round(2)}")
assert 0.9 < np.median(ratio) < 1.2 and np.percentile(ratio, 99) < 1.6
assert mesh.quality()["angle_min"] > 20
# d(x) itself, to look at or to change
d = am.size_field(model, frequency=FREQUENCY, points_per_wavelength=COUNT)
assert abs(d.array.min() - 1500 / FREQUENCY / COUNT) < 1

# %% [markdown]
# | SeismicMesh | atomesh |
# | --- | --- |
# | SEG-Y or arrays, axes z, x | the same files by `am.read`; arrays z, x; coordinates x, z |
# | `bbox=(zmin, zmax, xmin, xmax)` | `Image(array, spacing, origin)`; `crop=` |
# | `freq=3`, `wl=6` | `frequency=3`, `points_per_wavelength=6` |
# | `hmin`, `hmax` | `np.clip` of `size_field`, handed back as `size=` |
# | `grade=0.15` | the slope of d(x) is at most 1/4, always |
# | `dt`, `cr_max` | none: choose `hmin` by v dt / h |
# | `domain_pad`, `pad_style` | `np.pad` of the velocities |
# | `sliver_removal(min_dh_angle_bound=10)` | `min_angle`, always on |
# | domains by signed distance | `mask=` |
# | MPI | threads of one machine |
#
# Source: SeismicMesh's [README](https://github.com/krober10nd/SeismicMesh#readme).
