"""Images and meshes from other packages, and for them. Each package is imported when it is asked for."""

import math
import sys
import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ._atomesh import Image
from ._errors import AtomeshNote, InputError

if TYPE_CHECKING:
    from ._atomesh import Mesh, Surface

Array = npt.NDArray[Any]


def _missing(package: str, what: str) -> ImportError:
    return ImportError(f"{what} needs {package}: pip install {package}")


def _loaded(name: str) -> Any:
    """A package if the process has it already: whoever has an object of its, has it."""
    return sys.modules.get(name)


# images


def image_of(obj: Any) -> Image:
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
    if hasattr(obj, "__array__") or hasattr(obj, "__array_interface__") or isinstance(obj, (list, tuple, memoryview)):
        return Image(obj)
    raise TypeError(
        f"{type(obj).__module__}.{type(obj).__qualname__} is not an image of a known kind; expected an array, atomesh.Image, a path, "
        "or an image of SimpleITK, ITK, nibabel, pyvista or xarray"
    )


def _of_simpleitk(image: Any) -> Image:
    import SimpleITK

    axes = image.GetDimension()
    if image.GetNumberOfComponentsPerPixel() != 1:
        raise InputError(f"an image of {image.GetNumberOfComponentsPerPixel()} components a sample; expected one")
    if axes not in (2, 3):
        raise InputError(f"an image of {axes} axes; expected 2 or 3")
    # a copy: a view does not keep the image alive, and would show memory that is another's by then
    array = SimpleITK.GetArrayFromImage(image)
    direction = np.reshape(image.GetDirection(), (axes, axes))
    return _in_ras(array, image.GetSpacing(), image.GetOrigin(), direction)


def _of_itk(image: Any) -> Image:
    import itk

    axes = image.GetImageDimension()
    if axes not in (2, 3):
        raise InputError(f"an image of {axes} axes; expected 2 or 3")
    array = itk.GetArrayFromImage(image)
    if array.ndim != axes:
        raise InputError(f"an image of {array.shape[-1]} components a sample; expected one")
    direction = itk.GetArrayFromMatrix(image.GetDirection())
    return _in_ras(array, image.GetSpacing(), image.GetOrigin(), direction)


def _in_ras(array: Array, spacing: Any, origin: Any, direction: Array) -> Image:
    """An image of ITK's: a volume's world is LPS, and is turned by half about z, as `read` turns what ITK writes."""
    turn = np.array([-1.0, -1.0, 1.0]) if array.ndim == 3 else np.ones(2)
    # + 0: no -0, which would be printed with its sign
    return Image(array, list(spacing), turn * np.asarray(origin) + 0, turn[:, None] * np.asarray(direction) + 0)


def _of_nibabel(image: Any) -> Image:
    array = np.asanyarray(image.dataobj)
    if array.ndim == 4 and array.shape[3] == 1:
        array = array[..., 0]
    if array.ndim != 3:
        raise InputError(f"an image of shape {array.shape}; expected three axes: choose one volume")
    affine = np.asarray(image.affine, float)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    if not (np.isfinite(affine).all() and (spacing > 0).all()):
        raise InputError("an image whose affine does not place its samples")
    direction = affine[:3, :3] / spacing
    if np.abs(direction.T @ direction - np.eye(3)).max() > 1e-4:
        raise InputError("an image whose affine is sheared; expected axes at right angles: resample it first")
    units = image.header.get_xyzt_units()[0] if hasattr(image.header, "get_xyzt_units") else "unknown"
    name = {"mm": "mm", "meter": "m", "micron": "um"}.get(units)
    return Image(array.T, spacing, affine[:3, 3], direction, units=[name] * 3 if name else None)


def _of_pyvista(grid: Any) -> Image:
    name = grid.active_scalars_name
    values = grid.point_data.active_scalars
    count, places = np.asarray(grid.dimensions), np.asarray(grid.origin, float)
    direction = np.asarray(getattr(grid, "direction_matrix", np.eye(3)), float)
    spacing = np.asarray(grid.spacing, float)
    # a part of a larger grid may count its samples from other numbers than 0
    places = places + direction @ (spacing * np.asarray(grid.offset))
    if values is None:
        values = grid.cell_data.active_scalars
        if values is None:
            raise InputError("a pyvista.ImageData without active scalars; set_active_scalars chooses some")
        # values of cells are samples at their middles
        is_flat = count == 1
        places = places + direction @ (np.where(is_flat, 0.0, 0.5) * spacing)
        count = np.where(is_flat, 1, count - 1)
    if values.ndim != 1:
        raise InputError(f"scalars {name!r} of {values.shape[1]} components; expected one")
    array = np.asarray(values).reshape(tuple(count[::-1]))
    # turned in its plane at most
    if count[2] == 1 and np.array_equal(direction[2], (0, 0, 1)) and np.array_equal(direction[:, 2], (0, 0, 1)):
        return Image(array[0], spacing[:2], places[:2], direction[:2, :2])
    return Image(array, spacing, places, direction)


def _of_xarray(data: Any) -> Image:
    if data.ndim not in (2, 3):
        raise InputError(f"a DataArray of {data.ndim} axes ({', '.join(map(str, data.dims))}); expected 2 or 3: choose a slice")
    spacing: list[float] = []
    origin: list[float] = []
    units: list[str] = []
    for axis in reversed(data.dims):
        coordinates = data.coords.get(axis)
        if coordinates is None or len(coordinates) < 2:
            spacing.append(1.0)
            origin.append(0.0 if coordinates is None or not len(coordinates) else float(coordinates[0]))
            units.append("" if coordinates is None else str(coordinates.attrs.get("units", "")))
            continue
        if coordinates.dtype.kind not in "iuf":
            raise InputError(f"coordinates of {axis!r} are {coordinates.dtype}; expected numbers")
        places = np.asarray(coordinates, float)
        steps = np.diff(places)
        if steps[0] < 0:
            # samples are turned, so that coordinates ascend
            data, places, steps = data.isel({axis: slice(None, None, -1)}), places[::-1], -steps[::-1]
        step = (places[-1] - places[0]) / (len(places) - 1)
        if not (step > 0 and np.abs(steps - step).max() <= 1e-4 * step):
            raise InputError(f"coordinates of {axis!r} are not evenly spaced; interpolate onto even ones first")
        spacing.append(step)
        origin.append(places[0])
        units.append(str(coordinates.attrs.get("units", "")))
    return Image(np.asarray(data), spacing, origin, units=units if all(units) else None)

def image_to_pyvista(image: Image) -> Any:
    """A pyvista.ImageData with the samples as scalars "values" at its points."""
    try:
        import pyvista
    except ImportError:
        raise _missing("pyvista", "an image for pyvista") from None
    axes = len(image.shape)
    direction = np.eye(3)
    direction[:axes, :axes] = image.direction
    grid = pyvista.ImageData(
        dimensions=(*image.shape, 1)[:3],
        spacing=(*image.spacing, 1.0)[:3],
        origin=(*image.origin, 0.0)[:3],
        direction_matrix=direction,
    )
    grid.point_data["values"] = image.array.ravel()
    return grid


# meshes


def _cell_kind(mesh: "Mesh") -> str:
    return "triangle" if mesh.dim == 2 else "tetra"


def _simplices(mesh: "Mesh", what: str) -> None:
    if mesh.kind != "delaunay":
        raise InputError(f"{what} is for triangles and tetrahedra, not Voronoi cells")


def _columns(points: Array) -> Array:
    """Points of three coordinates."""
    return points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))])


def _cell_values(mesh: "Mesh") -> dict[str, Array]:
    values = {name: np.asarray(array) for name, array in mesh.cell_data.items()}
    if mesh.regions is not None:
        values.setdefault("region", mesh.regions)
    return values


def to_meshio(mesh: "Mesh") -> Any:
    """A meshio.Mesh: cells first, then the facets of each group, named by cell sets."""
    try:
        import meshio
    except ImportError:
        raise _missing("meshio", "to_meshio()") from None
    _simplices(mesh, "to_meshio()")
    facets = {name: group for name, group in mesh.facets.items() if len(group)}
    kind = "line" if mesh.dim == 2 else "triangle"
    # not all of meshio's writers know unsigned integers
    cells = [(_cell_kind(mesh), mesh.cells.astype(np.int64)), *((kind, group.astype(np.int64)) for group in facets.values())]
    counts = [len(block) for _, block in cells]
    # a value for each block: facets have none
    cell_data = {
        name: [values, *(np.full(n, -1 if values.dtype.kind in "iu" else math.nan, values.dtype) for n in counts[1:])]
        for name, values in _cell_values(mesh).items()
    }

    def alone(at: int, indices: Array) -> list[Array]:
        """The set of a block's cells, nothing of others."""
        return [indices if i == at else np.empty(0, np.int64) for i in range(len(cells))]

    sets = {name: alone(i, np.arange(counts[i])) for i, name in enumerate(facets, start=1)}
    regions = np.zeros(len(mesh.cells), np.int32) if mesh.regions is None else mesh.regions
    if mesh.regions is not None:
        for number, name in mesh.region_names.items():
            sets[name] = alone(0, np.flatnonzero(regions == number))
    # Gmsh's files have numbers, and names of these
    tags = [regions, *(np.full(n, i, np.int32) for i, n in enumerate(counts[1:], start=1))]
    cell_data["gmsh:physical"], cell_data["gmsh:geometrical"] = tags, tags
    names = {name: np.array([i, mesh.dim - 1]) for i, name in enumerate(facets, start=1)}
    names |= {name: np.array([number, mesh.dim]) for number, name in mesh.region_names.items()}
    return meshio.Mesh(
        mesh.points, cells, point_data=dict(mesh.point_data), cell_data=cell_data, cell_sets=sets, field_data=names
    )


FACETS = "facets "  # what names of groups of facets begin with in a grid's field data
REGION = "region "  # likewise those of regions, which a number follows


def to_pyvista(mesh: "Mesh") -> Any:
    """A pyvista.UnstructuredGrid; groups of facets and names of regions are field data."""
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
        np.asarray(cells, np.int64), np.full(mesh.cell_count, kind, np.uint8), np.asarray(points, np.float64)
    )
    for name, values in mesh.point_data.items():
        grid.point_data[name] = values
    for name, values in _cell_values(mesh).items():
        grid.cell_data[name] = values
    for number, name in mesh.region_names.items():
        grid.field_data[f"{REGION}{number}"] = [name]
    for name, group in mesh.facets.items():
        if len(group):
            grid.field_data[FACETS + name] = group.astype(np.int64)
    return grid


def surface_to_pyvista(surface: "Surface") -> Any:
    """A pyvista.PolyData of triangles, or lines in the plane."""
    try:
        import pyvista
    except ImportError:
        raise _missing("pyvista", "to_pyvista()") from None
    corners = surface.cells.shape[1]
    cells = np.column_stack([np.full(len(surface.cells), corners), surface.cells]).ravel().astype(np.int64)
    points = np.asarray(_columns(surface.points), np.float64)
    return pyvista.PolyData(points, lines=cells) if corners == 2 else pyvista.PolyData(points, faces=cells)


def _rows(table: Array, rows: Array) -> Array:
    """The number in `table` of each of `rows`, whichever the order of their entries. Cost: O(n log n)."""
    both = np.sort(np.concatenate([table, rows]), axis=1).astype(np.int64)
    rank = both[:, 0]
    for column in both.T[1:]:
        # ranks stay below the number of rows, so that products do not overflow
        rank = np.unique(rank * (column.max() + 1) + column, return_inverse=True)[1]
    order = np.argsort(rank[: len(table)], kind="stable")
    return order[np.searchsorted(rank[: len(table)], rank[len(table) :], sorter=order)]


def _normals(corners: Array) -> Array:
    """Normals of facets (k, D, D), which point to the right of segments, and out of triangles seen counter-clockwise."""
    if corners.shape[1] == 2:
        along = corners[:, 1] - corners[:, 0]
        return np.column_stack([along[:, 1], -along[:, 0]])
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def to_skfem(mesh: "Mesh") -> Any:
    """A skfem.MeshTri or MeshTet with boundaries and subdomains; inner facets are oriented boundaries."""
    try:
        import skfem
        from skfem.generic_utils import OrientedBoundary
    except ImportError:
        raise _missing("scikit-fem", "to_skfem()") from None
    _simplices(mesh, "to_skfem()")
    kind = skfem.MeshTri if mesh.dim == 2 else skfem.MeshTet
    points = np.ascontiguousarray(mesh.points.T)
    made = kind(points, np.ascontiguousarray(mesh.cells.T.astype(np.int64)))
    centres = mesh.points[mesh.cells].mean(axis=1)
    boundaries = {}
    for name, group in mesh.facets.items():
        if not len(group):
            continue
        indices = _rows(made.facets.T, group)
        if (made.f2t[1, indices] < 0).all():
            boundaries[name] = indices
            continue
        # the normal points out of the cell behind the facet: the label named first, of an interface
        corners = mesh.points[group]
        behind = centres[made.f2t[0, indices]] - corners[:, 0]
        is_first = np.einsum("ij,ij->i", _normals(corners), behind) < 0
        is_outer = made.f2t[1, indices] < 0
        boundaries[name] = OrientedBoundary(indices, np.where(is_first | is_outer, 0, 1))
    made = made.with_boundaries(boundaries)
    if mesh.regions is None:
        return made
    return made.with_subdomains(
        {name: np.flatnonzero(mesh.regions == number) for number, name in mesh.region_names.items()}
    )


class Parts(NamedTuple):
    """A mesh as plain arrays, for `Mesh.of`."""

    points: Array  # (n, D), float64
    cells: Array  # (m, D + 1), uint32, positively oriented
    facets: dict[str, Array]  # (k, D), uint32
    regions: Array | None  # (m,), int32
    region_names: dict[int, str]
    point_data: dict[str, Array]  # (n,), float64
    cell_data: dict[str, Array]  # (m,), float64


def mesh_parts(obj: Any) -> Parts:
    """The parts of a pyvista.UnstructuredGrid, a meshio.Mesh, a mesh of scikit-fem, or a pair (points, cells): triangles in a
    plane of constant z, or tetrahedra. Points of three coordinates in such a plane lose z.
    """
    if (pyvista := _loaded("pyvista")) is not None and isinstance(obj, pyvista.DataSet):
        return _of_grid(obj)
    if (meshio := _loaded("meshio")) is not None and isinstance(obj, meshio.Mesh):
        return _of_meshio(obj)
    if (skfem := _loaded("skfem")) is not None and isinstance(obj, skfem.Mesh):
        return _of_skfem(obj)
    if isinstance(obj, (tuple, list)) and len(obj) == 2:
        return _parts(np.asarray(obj[0]), np.asarray(obj[1]))
    raise TypeError(
        f"{type(obj).__module__}.{type(obj).__qualname__} is not a mesh of a known kind; expected a pyvista.UnstructuredGrid, a "
        "meshio.Mesh, a mesh of scikit-fem, or a pair (points, cells)"
    )


def _parts(points: Array, cells: Array) -> Parts:
    """Points and cells, checked and oriented."""
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise InputError(f"points of shape {points.shape}; expected (n, 2) or (n, 3)")
    if cells.ndim != 2 or cells.shape[1] not in (3, 4) or cells.dtype.kind not in "iu" or not len(cells):
        raise InputError(f"cells of {cells.dtype}, shape {cells.shape}; expected integers, (m, 3) or (m, 4)")
    points = np.ascontiguousarray(points, np.float64)
    if not np.isfinite(points).all():
        raise InputError("a point that is not finite")
    if cells.min() < 0 or cells.max() >= len(points):
        raise InputError(f"cells name points {cells.min()} to {cells.max()}; there are {len(points)}")
    dim = cells.shape[1] - 1
    if points.shape[1] > dim:
        if np.ptp(points[cells, 2]) != 0:
            raise InputError("triangles in space are a surface; expected triangles in a plane of constant z, or tetrahedra")
        points = np.ascontiguousarray(points[:, :2])
    elif points.shape[1] < dim:
        raise InputError("tetrahedra of points with two coordinates; expected three")
    cells = np.array(cells, np.uint32)
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    turned = np.linalg.det(edges) < 0
    cells[turned, :2] = cells[turned, 1::-1]
    if turned.any():
        warnings.warn(f"{turned.sum()} of {len(cells)} cells are oriented the other way; they are turned", AtomeshNote, stacklevel=2)
    return Parts(points, cells, {}, None, {}, {}, {})


def _values(data: Any, count: int, without: tuple[str, ...] = ()) -> dict[str, Array]:
    """Values by name; those of several components are left out, with a note."""
    kept = {}
    for name, values in data.items():
        values = np.asarray(values)
        if name in without:
            continue
        if values.shape == (count,) and values.dtype.kind in "biuf":
            kept[name] = values.astype(np.float64)
        else:
            message = f"{name!r} is left out: {values.dtype}, shape {values.shape}; a mesh has one number for each point or cell"
            warnings.warn(message, AtomeshNote, stacklevel=2)
    return kept


def _of_grid(grid: Any) -> Parts:
    """The parts of a pyvista.DataSet."""
    import pyvista

    if not isinstance(grid, pyvista.UnstructuredGrid):
        grid = grid.cast_to_unstructured_grid()
    types = pyvista.CellType
    kinds = set(np.unique(grid.celltypes).tolist())
    flat = {int(types.VERTEX), int(types.LINE)}
    top = types.TETRA if int(types.TETRA) in kinds else types.TRIANGLE
    expected = {int(top)} | flat | ({int(types.TRIANGLE)} if top == types.TETRA else set())
    if int(top) not in kinds or kinds - expected:
        names = ", ".join(types(kind).name.lower() for kind in sorted(kinds)) or "none"
        raise InputError(f"cells of these kinds: {names}; expected triangles, or tetrahedra: triangulate() makes them")
    chosen = grid.celltypes == top
    parts = _parts(np.asarray(grid.points), np.asarray(grid.cells_dict[top]))
    cell_data = {name: np.asarray(values)[chosen] for name, values in grid.cell_data.items()}
    regions: Array | None = None
    region_names: dict[int, str] = {}
    if "region" in cell_data and cell_data["region"].dtype.kind in "iu" and cell_data["region"].ndim == 1:
        regions = cell_data["region"].astype(np.int32)
        for number in np.unique(regions).tolist():
            if (key := f"{REGION}{number}") in grid.field_data:
                region_names[number] = str(grid.field_data[key][0])
    facets = {
        name.removeprefix(FACETS): np.asarray(group).astype(np.uint32).reshape(-1, parts.points.shape[1])
        for name, group in grid.field_data.items()
        if name.startswith(FACETS)
    }
    return parts._replace(
        facets=facets,
        regions=regions,
        region_names=region_names,
        point_data=_values(grid.point_data, len(parts.points)),
        cell_data=_values(cell_data, len(parts.cells), ("region",) if regions is not None else ()),
    )


def _of_meshio(mesh: Any) -> Parts:
    """The parts of a meshio.Mesh; cell sets are groups of facets, or regions."""
    kinds = [block.type for block in mesh.cells]
    top, facet = ("tetra", "triangle") if "tetra" in kinds else ("triangle", "line")
    if others := sorted(set(kinds) - {top, facet, "line", "vertex"}) or (["none"] if top not in kinds else []):
        raise InputError(f"cells of these kinds: {', '.join(others)}; expected triangles, or tetrahedra")
    at = [i for i, kind in enumerate(kinds) if kind == top]
    starts = dict(zip(at, np.cumsum([0, *(len(mesh.cells[i].data) for i in at)])[:-1], strict=True))
    parts = _parts(np.asarray(mesh.points), np.concatenate([mesh.cells[i].data for i in at]))
    count = len(parts.cells)
    data = {name: np.concatenate([values[i] for i in at]) for name, values in mesh.cell_data.items()}
    facets: dict[str, Array] = {}
    regions = np.zeros(count, np.int32)
    names: dict[int, str] = {}
    taken = None
    for name in ("region", "gmsh:physical", "medit:ref"):
        if name in data and data[name].dtype.kind in "iu" and data[name].ndim == 1 and taken is None:
            regions, taken = data[name].astype(np.int32), name

    def put(name: str, group: Array) -> None:
        group = group.astype(np.uint32)
        facets[name] = np.concatenate([facets[name], group]) if name in facets else group

    for name, sets in mesh.cell_sets.items():
        if name.startswith("gmsh:"):
            continue
        inside = np.zeros(count, bool)
        for i, chosen in enumerate(sets):
            if chosen is None or not len(chosen):
                continue
            chosen = np.asarray(chosen, np.int64)
            if i in starts:
                inside[starts[i] + chosen] = True
            elif kinds[i] == facet:
                put(name, mesh.cells[i].data[chosen])
        if not inside.any():
            continue
        numbers = np.unique(regions[inside])
        if taken is None or len(numbers) > 1 or int(numbers[0]) in names:
            number = max(names, default=0) + 1 if taken is None else int(regions.max()) + 1
            regions[inside] = number
        else:
            number = int(numbers[0])
        names[number] = name
    by_tag = {(int(tag), int(dim)): name for name, (tag, dim) in mesh.field_data.items() if len((tag, dim)) == 2}
    dim = parts.points.shape[1]
    for i, kind in enumerate(kinds):
        tags = mesh.cell_data.get("gmsh:physical")
        if kind == facet and tags is not None and not any(not n.startswith("gmsh:") for n in mesh.cell_sets):
            for tag in np.unique(tags[i]).tolist():
                put(by_tag.get((tag, dim - 1), f"facets-{tag}"), mesh.cells[i].data[tags[i] == tag])
    for number in np.unique(regions).tolist():
        if (number, dim) in by_tag:
            names.setdefault(number, by_tag[number, dim])
    has_regions = taken is not None or bool(names)
    dropped = tuple(name for name in data if name.startswith(("gmsh:", "medit:")) or name == taken)
    return parts._replace(
        facets=facets,
        regions=regions if has_regions else None,
        region_names=names,
        point_data=_values(mesh.point_data, len(parts.points), ("gmsh:dim_tags",)),
        cell_data=_values(data, count, dropped),
    )


def _of_skfem(mesh: Any) -> Parts:
    """The parts of a mesh of scikit-fem: boundaries are groups of facets, subdomains regions."""
    axes = mesh.p.shape[0]
    parts = _parts(mesh.p.T, mesh.t[: axes + 1].T)  # of cells of second order, the corners
    facets = {name: mesh.facets[:, np.asarray(chosen)].T.astype(np.uint32) for name, chosen in (mesh.boundaries or {}).items()}
    if not mesh.subdomains:
        return parts._replace(facets=facets)
    regions = np.zeros(mesh.t.shape[1], np.int32)
    names: dict[int, str] = {}
    for number, (name, chosen) in enumerate(mesh.subdomains.items(), start=1):
        regions[np.asarray(chosen)] = number
        names[number] = name
    return parts._replace(facets=facets, regions=regions, region_names=names)


def plot(mesh: "Mesh") -> Any:
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
