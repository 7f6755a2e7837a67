"""Meshes for other packages and from them: names of facets and regions go along, inner facets too."""

from pathlib import Path

import numpy as np
import pytest

import atomesh as am
from atomesh import _interop
from conftest import TESTS, ball, faults, labels, python

FLAT, VOLUME = faults(), ball()
pytestmark = pytest.mark.filterwarnings("ignore::atomesh.AtomeshWarning")
needs_mesh_of = pytest.mark.skipif(not hasattr(am.Mesh, "of"), reason="this build has no Mesh.of")


@pytest.fixture(scope="module", params=["plane", "space"])
def mesh(request: pytest.FixtureRequest) -> am.Mesh:
    """A mesh with two regions, an interface, and values."""
    two = labels((60, 80) if request.param == "plane" else VOLUME.shape)
    made = am.mesh(two, size=8, features="labels", labels=two)
    made.sample(np.arange(two.size, dtype=float).reshape(two.shape), name="k")
    return made


def columns(points: np.ndarray) -> np.ndarray:
    return points if points.shape[1] == 3 else np.pad(points, ((0, 0), (0, 1)))


def same_facets(made: np.ndarray, expected: np.ndarray) -> bool:
    """The same facets in any order, corners in the same cyclic order."""
    def turned(facets: np.ndarray) -> list[list[int]]:
        return sorted(np.roll(f, -int(np.argmin(f))).tolist() for f in facets)

    return turned(made) == turned(expected)


def test_meshio(mesh: am.Mesh, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    made = mesh.to_meshio()
    assert set(made.cell_sets) == {name for name, group in mesh.facets.items() if len(group)} | set(mesh.region_names.values())
    kind, facet = ("triangle", "line") if mesh.dim == 2 else ("tetra", "triangle")
    for name, group in mesh.facets.items():
        assert same_facets(np.concatenate([made.cells[i].data[s] for i, s in enumerate(made.cell_sets[name]) if len(s)]), group)
    assert set(made.point_data) == {"distance", "potential"}
    np.testing.assert_array_equal(made.get_cell_data("k", kind), mesh.cell_data["k"])
    np.testing.assert_array_equal(made.get_cell_data("region", kind), mesh.regions)
    assert set(made.cells_dict) == {kind, facet}
    # written by meshio, read by meshio and by atomesh
    for name, file_format in (("m.vtu", None), ("m.msh", "gmsh22"), ("m.vtk", None), ("m.inp", None)):
        meshio.write(tmp_path / name, made, file_format)
        if name == "m.msh":  # meshio cannot read the values of several blocks of cells that it writes itself
            continue
        again = meshio.read(tmp_path / name)
        np.testing.assert_allclose(again.points[:, : mesh.dim], mesh.points)
        np.testing.assert_array_equal(again.cells_dict[kind], mesh.cells)
    # its triangles in .inp are of a type that atomesh does not read
    for name in ("m.vtu", "m.msh", "m.inp")[: mesh.dim]:
        read = am.read_mesh(tmp_path / name)
        np.testing.assert_allclose(read.points, mesh.points)
        np.testing.assert_array_equal(read.cells, mesh.cells)
    read = am.read_mesh(tmp_path / "m.msh")
    assert read.region_names == mesh.region_names
    for name, group in mesh.facets.items():
        assert same_facets(read.facets[name], group)
    # written by atomesh, read by meshio
    for name, file_format in (("a.vtu", None), ("a.inp", None), ("a.msh", "gmsh")):
        mesh.write(tmp_path / name)
        again = meshio.read(tmp_path / name, file_format)
        # Gmsh's files are in order of regions
        np.testing.assert_array_equal(np.sort(again.cells_dict[kind], axis=0), np.sort(mesh.cells, axis=0))


def test_pyvista(mesh: am.Mesh) -> None:
    pytest.importorskip("pyvista")
    grid = mesh.to_pyvista()
    assert grid.n_cells == mesh.cell_count
    np.testing.assert_allclose(grid.points, columns(mesh.points))
    np.testing.assert_array_equal(grid.cell_data["k"], mesh.cell_data["k"])
    np.testing.assert_array_equal(grid.cell_data["region"], mesh.regions)
    np.testing.assert_array_equal(grid.point_data["potential"], mesh.point_data["potential"])
    assert grid.field_data["region 2"][0] == mesh.region_names[2]
    for name, group in mesh.facets.items():
        np.testing.assert_array_equal(grid.field_data[f"facets {name}"], group)
    surface = mesh.surface("interface-1-2").to_pyvista()
    assert surface.n_cells == len(mesh.facets["interface-1-2"])


def test_voronoi_cells_of_pyvista_have_the_volume_of_the_box() -> None:
    pytest.importorskip("pyvista")
    flat = am.mesh(FLAT, size=8, kind="voronoi").to_pyvista()
    np.testing.assert_allclose(flat.area, 79 * 59)
    space = am.mesh(VOLUME, size=7, kind="voronoi", features="edges").to_pyvista()
    sizes = space.compute_cell_sizes()["Volume"]
    # vtk cuts each polyhedron into tetrahedra of its own, in single precision
    np.testing.assert_allclose(np.abs(sizes).sum(), np.prod(np.array(VOLUME.shape) - 1), rtol=1e-3)
    for convert in ("to_meshio", "to_skfem"):
        pytest.importorskip(convert.removeprefix("to_"))
        with pytest.raises(am.InputError, match="not Voronoi"):
            getattr(am.mesh(FLAT, size=8, kind="voronoi"), convert)()


def test_skfem_has_boundaries_subdomains_and_oriented_interfaces(mesh: am.Mesh) -> None:
    skfem = pytest.importorskip("skfem")
    made = mesh.to_skfem()
    assert set(made.boundaries) == {name for name, group in mesh.facets.items() if len(group)}
    assert set(made.subdomains) == set(mesh.region_names.values())
    for name, group in mesh.facets.items():
        corners = np.sort(made.facets[:, np.asarray(made.boundaries[name])].T, axis=1)
        np.testing.assert_array_equal(corners, np.sort(group, axis=1))
    for number, name in mesh.region_names.items():
        np.testing.assert_array_equal(made.subdomains[name], np.flatnonzero(mesh.regions == number))
    interface = made.boundaries["interface-1-2"]
    # the cell that the normal leaves is of region 1, and it points along x
    assert (mesh.regions[made.f2t[interface.ori, interface]] == 1).all()
    element = skfem.ElementTriP1() if mesh.dim == 2 else skfem.ElementTetP1()
    basis = skfem.FacetBasis(made, element, facets="interface-1-2")
    through = skfem.Functional(lambda w: w.n[0]).assemble(basis)
    span = np.ptp(mesh.points, axis=0)
    np.testing.assert_allclose(through, np.prod(span[1:]), rtol=1e-9)


def test_skfem_solves_poissons_equation_with_the_known_answer(mesh: am.Mesh) -> None:
    skfem = pytest.importorskip("skfem")
    from skfem.models.poisson import laplace, unit_load

    made = mesh.to_skfem()
    element = skfem.ElementTriP2() if mesh.dim == 2 else skfem.ElementTetP2()
    basis = skfem.Basis(made, element)
    # -u'' = 1 between u = 0 at xmin and xmax: u = (x - a)(b - x) / 2, which is quadratic
    fixed = basis.get_dofs({"xmin", "xmax"})
    u = skfem.solve(*skfem.condense(laplace.assemble(basis), unit_load.assemble(basis), D=fixed))
    x = basis.doflocs[0]
    np.testing.assert_allclose(u, (x - x.min()) * (x.max() - x) / 2, atol=1e-8 * np.ptp(x) ** 2)
    # conductances in series across the interface: 1 on the left, 3 on the right
    k = np.where(mesh.regions == 1, 1.0, 3.0)
    form = skfem.BilinearForm(lambda u, v, w: w.k * skfem.helpers.dot(skfem.helpers.grad(u), skfem.helpers.grad(v)))
    of_cells = basis.with_element(skfem.ElementTriP0() if mesh.dim == 2 else skfem.ElementTetP0())
    matrix = form.assemble(basis, k=of_cells.interpolate(k))
    start = basis.zeros()
    start[basis.get_dofs("xmin")] = 1.0
    u = skfem.solve(*skfem.condense(matrix, x=start, D=fixed))
    span = np.ptp(mesh.points, axis=0)
    at = mesh.points[np.unique(mesh.facets["interface-1-2"]), 0].mean() - mesh.points[:, 0].min()
    expected = np.prod(span[1:]) / (at + (span[0] - at) / 3)
    np.testing.assert_allclose(u @ matrix @ u, expected, rtol=1e-2)


@pytest.mark.parametrize("source", ["pyvista", "meshio"])
def test_parts_of_meshes_come_back(mesh: am.Mesh, source: str) -> None:
    pytest.importorskip(source)
    parts = _interop.mesh_parts(getattr(mesh, f"to_{source}")())
    np.testing.assert_allclose(parts.points, mesh.points)
    np.testing.assert_array_equal(parts.cells, mesh.cells)
    np.testing.assert_array_equal(parts.regions, mesh.regions)
    assert parts.region_names == mesh.region_names
    assert parts.facets.keys() == mesh.facets.keys()
    for name, group in parts.facets.items():
        np.testing.assert_array_equal(group, mesh.facets[name])
    np.testing.assert_array_equal(parts.cell_data["k"], mesh.cell_data["k"])
    np.testing.assert_allclose(parts.point_data["potential"], mesh.point_data["potential"])


def test_parts_of_files_that_meshio_reads(mesh: am.Mesh, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    mesh.write(tmp_path / "m.msh")
    parts = _interop.mesh_parts(meshio.read(tmp_path / "m.msh"))
    # Gmsh's files are in order of regions
    order = np.argsort(mesh.regions, kind="stable")
    np.testing.assert_array_equal(parts.cells, mesh.cells[order])
    np.testing.assert_array_equal(parts.regions, mesh.regions[order])
    assert parts.region_names == mesh.region_names
    assert set(parts.facets) == set(mesh.facets)
    for name, group in parts.facets.items():
        assert same_facets(group, mesh.facets[name])


def test_parts_are_oriented_and_refused_where_they_make_no_mesh() -> None:
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    parts = _interop.mesh_parts((square, [(0, 1, 2), (0, 3, 2)]))
    corners = parts.points[parts.cells]
    assert (np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0).all()
    lifted = np.column_stack([square, np.full(4, 7.0)])
    assert _interop.mesh_parts((lifted, [(0, 1, 2)])).points.shape == (4, 2)
    lifted[2, 2] = 8
    for points, cells, message in [
        (lifted, [(0, 1, 2)], "surface"), (square, [(0, 1, 4)], "0 to 4; there are 4"), (square, [(0, 1)], "shape"),
        (square, np.zeros((0, 3), int), "shape"), (square, [(0.5, 1, 2)], "integers"), (square, [(0, 1, 2, 3)], "two coordinates"),
        (np.full((4, 2), np.nan), [(0, 1, 2)], "finite"), (np.zeros(4), [(0, 1, 2)], "points of shape"),
    ]:
        with pytest.raises(am.InputError, match=message):
            _interop.mesh_parts((points, cells))
    with pytest.raises(TypeError, match="expected a pyvista.UnstructuredGrid"):
        _interop.mesh_parts(3)


def test_parts_of_grids_with_other_cells_are_refused_in_words() -> None:
    pv = pytest.importorskip("pyvista")
    with pytest.raises(am.InputError, match="voxel|hexahedron"):
        _interop.mesh_parts(pv.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid())
    plane = pv.Plane().triangulate()
    plane["vectors"] = np.zeros((plane.n_points, 3))
    with pytest.warns(am.AtomeshNote, match="vectors"):
        parts = _interop.mesh_parts(plane)
    assert parts.cells.shape == (200, 3) and parts.points.shape[1] == 2
    with pytest.raises(am.InputError, match="surface"):
        _interop.mesh_parts(pv.Sphere())


@needs_mesh_of
def test_meshes_of_others_are_meshes(mesh: am.Mesh, tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    made = am.Mesh.of(mesh.to_pyvista())
    np.testing.assert_array_equal(made.cells, mesh.cells)
    assert made.region_names == mesh.region_names and made.facets.keys() == mesh.facets.keys()
    made.write(tmp_path / "m.msh")
    assert am.read_mesh(tmp_path / "m.msh").facets.keys() == mesh.facets.keys()


PLUGIN = """
import sys, numpy as np, pyvista as pv, warnings
warnings.simplefilter("ignore")
if not any(e.name == "atomesh" for e in __import__("importlib.metadata").metadata.entry_points(group="pyvista.accessors")):
    import atomesh._pyvista
grid = pv.ImageData(dimensions=(40, 30, 1), spacing=(0.5, 0.5, 1), origin=(3, 4, 0))
values = np.full((30, 40), 200, np.uint8)
values[15] = 10
grid["values"] = values.ravel()
mesh = grid.atomesh.mesh(size=4)
assert isinstance(mesh, pv.UnstructuredGrid) and mesh.n_cells > 10, mesh
assert np.allclose(mesh.bounds, grid.bounds), mesh.bounds
b = grid.atomesh.enhance("dark")
assert b["potential"].min() < -0.3 and b.dimensions == grid.dimensions
assert grid.atomesh.image.spacing == (0.5, 0.5)
"""


def test_images_of_pyvista_mesh_themselves() -> None:
    pytest.importorskip("pyvista", minversion="0.48")
    made = python(PLUGIN)
    assert made.returncode == 0, made.stderr


def test_pyvista_reads_and_writes_what_atomesh_does(mesh: am.Mesh, in_tmp: Path) -> None:
    pv = pytest.importorskip("pyvista", minversion="0.48")
    import tomllib

    from pyvista.core.utilities.reader import CLASS_READERS
    from pyvista.core.utilities.writer_registry import _get_builtin_writer_exts

    from atomesh import _pyvista

    points = tomllib.loads((TESTS.parent / "pyproject.toml").read_text())["project"]["entry-points"]
    readers, writers = points["pyvista.readers"], points["pyvista.writers"]
    # it refuses packages that take over what it reads itself
    assert not set(readers) & set(CLASS_READERS) and not set(writers) & set(_get_builtin_writer_exts())
    for table, register in ((readers, pv.register_reader), (writers, pv.register_writer)):
        for ending, place in table.items():
            module, name = place.split(":")
            assert module == "atomesh._pyvista"
            register(ending, getattr(_pyvista, name), override=True)
    np.arange(20, dtype="<f4").tofile("x.rsf@")
    Path("x.rsf").write_text('n1=5 n2=4 d1=0.5 d2=2 o1=1 o2=3 data_format="native_float" in="x.rsf@"\n')
    grid = pv.read("x.rsf")
    expected = am.read("x.rsf")
    assert grid.dimensions[:2] == expected.shape and grid.spacing[:2] == expected.spacing
    np.testing.assert_array_equal(grid["values"], expected.array.ravel())
    mesh.write("m.msh2")
    read = pv.read("m.msh2")
    assert read.n_cells == mesh.cell_count and read.field_data["region 2"][0] == mesh.region_names[2]
    if hasattr(am.Mesh, "of"):
        for ending in writers:
            read.save(f"back{ending}")
            np.testing.assert_array_equal(am.read_mesh(f"back{ending}").cells, mesh.cells)
        with pytest.raises(am.InputError):
            pv.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid().save("no.inp")


def test_what_is_missing_is_named() -> None:
    code = """
import sys
for name in ("meshio", "pyvista", "skfem", "matplotlib", "matplotlib.pyplot"):
    sys.modules[name] = None
import warnings; warnings.simplefilter("ignore")
import numpy as np, atomesh as am
mesh = am.mesh(np.zeros((30, 30)), size=8)
for call, package in ((mesh.to_meshio, "meshio"), (mesh.to_pyvista, "pyvista"), (mesh.to_skfem, "scikit-fem"), (mesh.plot, "matplotlib")):
    try:
        call()
    except ImportError as error:
        assert f"pip install {package}" in str(error), error
    else:
        raise AssertionError(package)
"""
    made = python(code)
    assert made.returncode == 0, made.stderr


def test_plots() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = am.mesh(FLAT, size=9).plot()
    assert axes.images
    import matplotlib.pyplot as plt

    plt.close("all")
