"""Images from other packages, and meshes for them. Each package is imported when it is asked for."""

import math
import sys

import numpy as np

from ._atomesh import Image


def _missing(package, what):
    return ImportError(f"{what} needs {package}: pip install {package}")


def _loaded(name):
    """A package if the process has it already: whoever has an object of its, has it."""
    return sys.modules.get(name)


# images


def image_of(obj):
    """The image of another package's object."""
    for package, kind, convert in (
        ("SimpleITK", "Image", _of_simpleitk),
        ("nibabel", "spatialimages.SpatialImage", _of_nibabel),
        ("pyvista", "ImageData", _of_pyvista),
        ("xarray", "DataArray", _of_xarray),
    ):
        if (module := _loaded(package)) is not None:
            for name in kind.split("."):
                module = getattr(module, name, None)
            if module is not None and isinstance(obj, module):
                return convert(obj)
    if type(obj).__module__.partition(".")[0] == "itk" and hasattr(obj, "GetLargestPossibleRegion"):
        return _of_itk(obj)
    if hasattr(obj, "__array__") or hasattr(obj, "__array_interface__") or isinstance(obj, (list, tuple)):
        return Image(obj)
    raise TypeError(
        f"{type(obj).__module__}.{type(obj).__qualname__} is no image that is known; expected an array, atomesh.Image, a path, "
        "or an image of SimpleITK, ITK, nibabel, pyvista or xarray"
    )


def _of_simpleitk(image):
    import SimpleITK

    axes = image.GetDimension()
    if image.GetNumberOfComponentsPerPixel() != 1:
        raise _input(f"an image of {image.GetNumberOfComponentsPerPixel()} components a sample; expected one")
    if axes not in (2, 3):
        raise _input(f"an image of {axes} axes; expected 2 or 3")
    # a view keeps the image alive and is read-only
    array = SimpleITK.GetArrayViewFromImage(image)
    direction = np.reshape(image.GetDirection(), (axes, axes))
    return _in_ras(array, image.GetSpacing(), image.GetOrigin(), direction)


def _of_itk(image):
    import itk

    axes = image.GetImageDimension()
    if axes not in (2, 3):
        raise _input(f"an image of {axes} axes; expected 2 or 3")
    array = itk.GetArrayFromImage(image)
    if array.ndim != axes:
        raise _input(f"an image of {array.shape[-1]} components a sample; expected one")
    direction = itk.GetArrayFromMatrix(image.GetDirection())
    return _in_ras(array, list(image.GetSpacing()), list(image.GetOrigin()), direction)


def _in_ras(array, spacing, origin, direction):
    """An image of ITK's: a volume's world is LPS, and is turned by half about z, as `read` turns what ITK writes."""
    turn = np.array([-1.0, -1.0, 1.0]) if array.ndim == 3 else np.ones(2)
    # + 0: no -0, which would be printed with its sign
    return Image(array, spacing, turn * np.asarray(origin) + 0, turn[:, None] * np.asarray(direction) + 0)


def _of_nibabel(image):
    array = np.asanyarray(image.dataobj)
    if array.ndim == 4 and array.shape[3] == 1:
        array = array[..., 0]
    if array.ndim != 3:
        raise _input(f"an image of shape {array.shape}; expected three axes: choose one volume")
    affine = np.asarray(image.affine, float)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    if not (np.isfinite(affine).all() and (spacing > 0).all()):
        raise _input("an image whose affine is no placement")
    direction = affine[:3, :3] / spacing
    if np.abs(direction.T @ direction - np.eye(3)).max() > 1e-4:
        raise _input("an image whose affine is sheared; expected axes at right angles: resample it first")
    units = image.header.get_xyzt_units()[0] if hasattr(image.header, "get_xyzt_units") else "unknown"
    name = {"mm": "mm", "meter": "m", "micron": "um"}.get(units)
    return Image(array.T, spacing, affine[:3, 3], direction, units=[name] * 3 if name else None)


def _of_pyvista(grid):
    name = grid.active_scalars_name
    values = grid.point_data.active_scalars
    count, places = np.asarray(grid.dimensions), np.asarray(grid.origin, float)
    direction = np.asarray(getattr(grid, "direction_matrix", np.eye(3)), float)
    spacing = np.asarray(grid.spacing, float)
    if values is None:
        values = grid.cell_data.active_scalars
        if values is None:
            raise _input("a pyvista.ImageData without active scalars; set_active_scalars chooses some")
        # values of cells are samples at their middles
        is_flat = count == 1
        places = places + direction @ (np.where(is_flat, 0.0, 0.5) * spacing)
        count = np.where(is_flat, 1, count - 1)
    if values.ndim != 1:
        raise _input(f"scalars {name!r} of {values.shape[1]} components; expected one")
    array = np.asarray(values).reshape(tuple(count[::-1]))
    if count[2] == 1 and np.array_equal(direction, np.eye(3)):
        return Image(array[0], spacing[:2], places[:2])
    return Image(array, spacing, places, direction)


def _of_xarray(data):
    if data.ndim not in (2, 3):
        raise _input(f"a DataArray of {data.ndim} axes ({', '.join(map(str, data.dims))}); expected 2 or 3: choose a slice")
    spacing, origin, units = [], [], []
    for axis in reversed(data.dims):
        coordinates = data.coords.get(axis)
        if coordinates is None or len(coordinates) < 2:
            spacing.append(1.0)
            origin.append(0.0 if coordinates is None else float(coordinates[0]))
            units.append("")
            continue
        places = np.asarray(coordinates, float)
        steps = np.diff(places)
        if steps[0] < 0:
            # samples are turned, so that coordinates ascend
            data, places, steps = data.isel({axis: slice(None, None, -1)}), places[::-1], -steps[::-1]
        step = (places[-1] - places[0]) / (len(places) - 1)
        if not (step > 0 and np.abs(steps - step).max() <= 1e-4 * step):
            raise _input(f"coordinates of {axis!r} are not evenly spaced; interpolate onto even ones first")
        spacing.append(step)
        origin.append(places[0])
        units.append(str(coordinates.attrs.get("units", "")))
    return Image(np.asarray(data), spacing, origin, units=units if all(units) else None)


def _input(message):
    from ._errors import InputError

    return InputError(message)


# meshes


def _cell_kind(mesh):
    return "triangle" if mesh.dim == 2 else "tetra"


def _simplices(mesh, what):
    if mesh.kind != "delaunay":
        raise _input(f"{what} is for triangles and tetrahedra, not Voronoi cells")


def _columns(points):
    """Points of three coordinates."""
    return points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))])


def _cell_values(mesh):
    values = {name: np.asarray(array) for name, array in mesh.cell_data.items()}
    if mesh.regions is not None:
        values.setdefault("region", mesh.regions)
    return values


def to_meshio(mesh):
    """A meshio.Mesh: cells first, then the facets of each group, named by cell sets."""
    try:
        import meshio
    except ImportError:
        raise _missing("meshio", "to_meshio()") from None
    _simplices(mesh, "to_meshio()")
    facets = {name: group for name, group in mesh.facets.items() if len(group)}
    kind = "line" if mesh.dim == 2 else "triangle"
    cells = [(_cell_kind(mesh), mesh.cells), *((kind, group) for group in facets.values())]
    counts = [len(block) for _, block in cells]
    # a value for each block: facets have none
    cell_data = {
        name: [values, *(np.full(n, -1 if values.dtype.kind in "iu" else math.nan, values.dtype) for n in counts[1:])]
        for name, values in _cell_values(mesh).items()
    }

    def alone(at, indices):
        """The set of a block's cells, nothing of others."""
        return [indices if i == at else np.empty(0, np.int64) for i in range(len(cells))]

    sets = {name: alone(i, np.arange(counts[i])) for i, name in enumerate(facets, start=1)}
    if mesh.regions is not None:
        for number, name in mesh.region_names.items():
            sets[name] = alone(0, np.flatnonzero(mesh.regions == number))
    return meshio.Mesh(
        mesh.points, cells, point_data=dict(mesh.point_data), cell_data=cell_data, cell_sets=sets,
    )


def to_pyvista(mesh):
    """A pyvista.UnstructuredGrid; for each group of facets the surfaces are under `surface`."""
    try:
        import pyvista
    except ImportError:
        raise _missing("pyvista", "to_pyvista()") from None
    types = pyvista.CellType
    points = _columns(mesh.points)
    if mesh.kind == "delaunay":
        kind = types.TRIANGLE if mesh.dim == 2 else types.TETRA
        corners = mesh.cells.shape[1]
        cells = np.column_stack([np.full(len(mesh.cells), corners), mesh.cells]).ravel()
    else:
        kind = types.POLYGON if mesh.dim == 2 else types.POLYHEDRON
        cells = mesh.cells
    grid = pyvista.UnstructuredGrid(
        np.asarray(cells, np.int64), np.full(mesh.cell_count, kind, np.uint8), np.asarray(points, float)
    )
    for name, values in mesh.point_data.items():
        grid.point_data[name] = values
    for name, values in _cell_values(mesh).items():
        grid.cell_data[name] = values
    for number, name in mesh.region_names.items():
        grid.field_data[f"region {number}"] = [name]
    return grid


def surface_to_pyvista(surface):
    """A pyvista.PolyData of triangles, or lines in the plane."""
    try:
        import pyvista
    except ImportError:
        raise _missing("pyvista", "to_pyvista()") from None
    corners = surface.cells.shape[1]
    cells = np.column_stack([np.full(len(surface.cells), corners), surface.cells]).ravel().astype(np.int64)
    points = np.asarray(_columns(surface.points), float)
    return pyvista.PolyData(points, lines=cells) if corners == 2 else pyvista.PolyData(points, faces=cells)


def to_skfem(mesh):
    """A skfem.MeshTri or MeshTet with boundaries and subdomains; inner facets are oriented boundaries."""
    try:
        import skfem
    except ImportError:
        raise _missing("scikit-fem", "to_skfem()") from None
    _simplices(mesh, "to_skfem()")
    kind = skfem.MeshTri if mesh.dim == 2 else skfem.MeshTet
    points = np.ascontiguousarray(mesh.points.T)
    made = kind(points, np.ascontiguousarray(mesh.cells.T.astype(np.int64)))
    order = {tuple(corners): i for i, corners in enumerate(np.sort(made.facets, axis=0).T.tolist())}
    boundaries = {}
    for name, group in mesh.facets.items():
        if len(group):
            boundaries[name] = np.array([order[tuple(sorted(corners))] for corners in group.tolist()])
    subdomains = None
    if mesh.regions is not None:
        subdomains = {name: np.flatnonzero(mesh.regions == number) for number, name in mesh.region_names.items()}
    return made.with_boundaries(boundaries) if subdomains is None else made.with_boundaries(boundaries).with_subdomains(subdomains)


class _Parts:
    """A mesh of triangles or tetrahedra as arrays and lists of pairs."""

    def __init__(self, points, cells):
        self.points = np.ascontiguousarray(points, float)
        self.cells = np.ascontiguousarray(cells, np.int64)
        self.facets, self.point_data, self.cell_data, self.region_names = [], [], [], []
        self.regions = None

    def flat(self):
        """Triangles in a plane of constant z have two coordinates."""
        if self.cells.shape[1:] == (3,) and self.points.shape[1:] == (3,):
            used = self.points[np.unique(self.cells), 2] if len(self.cells) else self.points[:, 2]
            if len(used) and np.ptp(used) > 1e-9 * np.abs(self.points).max():
                raise _input("triangles in space; expected tetrahedra, or triangles in a plane of constant z")
            self.points = np.ascontiguousarray(self.points[:, :2])
        return self


def mesh_parts(obj):
    """The points, cells, groups of facets, regions and values of another package's mesh."""
    if isinstance(obj, (tuple, list)) and len(obj) == 2:
        return _Parts(*obj).flat()
    for package, kind, convert in (
        ("pyvista", "UnstructuredGrid", _parts_of_pyvista),
        ("meshio", "Mesh", _parts_of_meshio),
        ("skfem", "Mesh", _parts_of_skfem),
    ):
        module = _loaded(package)
        if module is not None and isinstance(obj, getattr(module, kind, ())):
            return convert(obj)
    raise TypeError(
        f"{type(obj).__module__}.{type(obj).__qualname__} is no mesh that is known; expected (points, cells), or a mesh of "
        "pyvista, meshio or scikit-fem"
    )


def _scalars(data):
    return [(name, np.asarray(values)) for name, values in data.items() if np.ndim(values) == 1 and np.asarray(values).dtype.kind in "biuf"]


def _parts_of_pyvista(grid):
    import pyvista

    types = pyvista.CellType
    volume, plane = grid.celltypes == types.TETRA, grid.celltypes == types.TRIANGLE
    kind, taken = (types.TETRA, volume) if volume.any() else (types.TRIANGLE, plane)
    if not taken.any():
        raise _input("a grid without triangles or tetrahedra")
    parts = _Parts(grid.points, grid.cells_dict[kind])
    parts.point_data = _scalars(grid.point_data)
    for name, values in _scalars(grid.cell_data):
        if name == "region":
            parts.regions = values[taken].astype(np.int32).tolist()
        else:
            parts.cell_data.append((name, values[taken]))
    return parts.flat()


def _parts_of_meshio(mesh):
    kinds = {block.type for block in mesh.cells}
    kind, facet = ("tetra", "triangle") if "tetra" in kinds else ("triangle", "line")
    if kind not in kinds:
        raise _input(f"a mesh of {', '.join(sorted(kinds)) or 'no cells'}; expected triangles or tetrahedra")
    taken = [i for i, block in enumerate(mesh.cells) if block.type == kind]
    parts = _Parts(mesh.points, np.concatenate([mesh.cells[i].data for i in taken]))
    parts.point_data = _scalars(mesh.point_data)
    for name, blocks in mesh.cell_data.items():
        values = np.concatenate([np.asarray(blocks[i]) for i in taken])
        if values.ndim != 1:
            continue
        if name == "region":
            parts.regions = values.astype(np.int32).tolist()
        else:
            parts.cell_data.append((name, values))
    regions = np.zeros(len(parts.cells), np.int32)
    starts = dict(zip(taken, np.cumsum([0, *(len(mesh.cells[i].data) for i in taken)]).tolist()))
    number = 0
    for name, blocks in mesh.cell_sets.items():
        facets = [mesh.cells[i].data[np.asarray(at, np.int64)] for i, at in enumerate(blocks)
                  if at is not None and mesh.cells[i].type == facet and len(at)]
        if facets:
            parts.facets.append((name, np.concatenate(facets)))
        cells = [starts[i] + np.asarray(at, np.int64) for i, at in enumerate(blocks)
                 if at is not None and i in starts and len(at)]
        if cells:
            cells = np.concatenate(cells)
            if parts.regions is not None:
                known = np.unique(np.asarray(parts.regions)[cells])
                if len(known) == 1:
                    parts.region_names.append((int(known[0]), name))
                continue
            number += 1
            regions[cells] = number
            parts.region_names.append((number, name))
    if number:
        parts.regions = regions.tolist()
    return parts.flat()


def _parts_of_skfem(mesh):
    parts = _Parts(mesh.p.T, mesh.t[: mesh.p.shape[0] + 1].T)
    for name, facets in (mesh.boundaries or {}).items():
        parts.facets.append((name, mesh.facets[:, np.asarray(facets)].T))
    if mesh.subdomains:
        regions = np.zeros(mesh.t.shape[1], np.int32)
        for number, (name, cells) in enumerate(mesh.subdomains.items(), start=1):
            regions[np.asarray(cells)] = number
            parts.region_names.append((number, name))
        parts.regions = regions.tolist()
    return parts


def plot(mesh):
    """Shows a mesh."""
    if mesh.dim == 3:
        return to_pyvista(mesh).plot(show_edges=True)
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise _missing("matplotlib", "plot()") from None
    import io

    _, axes = plt.subplots()
    axes.imshow(plt.imread(io.BytesIO(mesh.picture())))
    axes.set_axis_off()
    return axes
