"""Stages of a run, own atoms and fields, editing, sampling, surfaces, flow."""

import gc
import pickle
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import atomesh as am
from conftest import ball, faults, labels

FLAT, VOLUME = faults(), ball()
pytestmark = pytest.mark.filterwarnings("ignore::atomesh.AtomeshWarning")
CASES = pytest.mark.parametrize(
    ("image", "options"),
    [
        (FLAT, {"size": 7}),
        (FLAT, {"size": (4, 12), "seed": 5, "beta": 0.6}),
        (FLAT, {"size": 7, "kind": "voronoi"}),
        (VOLUME, {"size": 5, "features": "edges"}),
        (am.Image(FLAT, (0.5, 2), (3, 4), [[0, -1], [1, 0]]), {"size": 4}),
        (am.Image(VOLUME, (1, 1.5, 2), direction=np.diag([1, -1, 1])), {"size": 6, "features": "edges"}),
    ],
    ids="plane sizes voronoi space frame mirrored".split(),
)


@CASES
def test_stages_one_by_one_give_the_mesh(image: object, options: dict) -> None:
    expected = am.mesh(image, **options)
    made = am.lattice(image, **options).settle().connect().improve()
    np.testing.assert_array_equal(made.points, expected.points)
    np.testing.assert_array_equal(made.cells, expected.cells)
    assert made.facets.keys() == expected.facets.keys()
    # step by step too
    lat = am.lattice(image, **options)
    steps = list(lat.optimize())
    assert [step.number for step in steps] == list(range(1, len(steps) + 1))
    assert all(abs(step.energy - step.energy_atomic - step.energy_image) < 1e-9 * abs(step.energy) for step in steps)
    assert steps[-1].energy < steps[0].energy
    np.testing.assert_array_equal(lat.connect().improve().points, expected.points)


def test_connected_atoms_are_the_lattices() -> None:
    lat = am.lattice(FLAT, 7, align="off").settle()
    connected = lat.connect()
    np.testing.assert_array_equal(np.sort(connected.points, axis=0), np.sort(lat.atoms, axis=0))
    corners = connected.points[connected.cells]
    assert (np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0).all()
    assert "cells" in repr(connected) and f"{len(lat)} atoms" in repr(lat)


def test_leaving_the_loop_stops_the_work_where_it_is() -> None:
    lat = am.lattice(FLAT, 6)
    before = lat.atoms
    for step in lat.optimize():
        if step.number == 3:
            break
    np.testing.assert_array_equal(lat.atoms, step.atoms)
    assert not np.array_equal(lat.atoms, before)
    del step
    gc.collect()
    # and goes on from there with other options
    energies = [step.energy for step in lat.optimize(beta=0.2)]
    assert energies[-1] < energies[0]
    assert lat.connect().improve().cell_count > 0
    steps = lat.optimize()
    assert iter(steps) is steps
    list(steps)
    with pytest.raises(StopIteration):
        next(steps)


def test_atoms_of_ones_own_stay_where_they_are_until_they_are_moved() -> None:
    img = am.Image(FLAT, (0.5, 0.25), (10, 20))
    atoms = am.lattice(img, 2.5).atoms
    rng = np.random.default_rng(0)
    inner = ((atoms > atoms.min(0)) & (atoms < atoms.max(0))).all(axis=1)
    atoms[inner] += rng.uniform(-0.1, 0.1, atoms[inner].shape)
    lat = am.Lattice.of(atoms, img, size=2.5, align="off")
    np.testing.assert_allclose(lat.atoms, atoms, atol=1e-12)
    assert len(lat.connect().points) == len(atoms)
    with pytest.raises(am.InputError):
        am.Lattice.of(atoms[inner], img)  # the corners of the box are missing
    with pytest.raises(am.InputError):
        am.Lattice.of(np.zeros((5, 3)), img)
    with pytest.raises(am.InputError):
        am.Lattice.of(np.zeros(5), img)


def test_fields_of_ones_own_are_felt() -> None:
    b = am.enhance(FLAT, "dark")
    assert b.array.dtype == np.float32 and -1 <= b.array.min() < -0.5 and b.array.max() <= 1
    lat = am.lattice(FLAT, 6, features="none")
    list(lat.optimize(potential=b, beta=0.6))
    dark = FLAT < 100
    x, y = np.rint(lat.atoms).astype(int).T
    assert dark[y, x].mean() > 2 * dark.mean()
    d = am.size_field(FLAT, (4, 12))
    assert 4 <= d.array.min() < d.array.max() <= 12.0001
    np.testing.assert_array_equal(am.lattice(FLAT, distance=d).atoms.shape[1], 2)
    edited = d.array.copy()
    edited[:, :40] = 12
    coarse, fine = (np.sum(am.mesh(FLAT, size=s).points[:, 0] < 40) for s in (edited, d))
    assert coarse < fine


def test_a_number_replaces_a_field_given_before() -> None:
    lat, other = (am.lattice(FLAT, 7, beta=beta) for beta in (np.full(FLAT.shape, 0.9), 0.3))
    lat.settle(beta=0.3)
    other.settle()
    np.testing.assert_array_equal(lat.atoms, other.atoms)


def test_an_editor_changes_atoms_one_by_one() -> None:
    img = am.Image(FLAT, (0.5, 0.5), (100, 200))
    mesh = am.mesh(img, size=4)
    ed = mesh.edit()
    names, places = ed.atoms
    np.testing.assert_allclose(places, mesh.points[names])
    new = ed.add((110.2, 210.1))
    assert new == len(names)
    ed.move(new, (111.0, 211.0))
    ed.pin(new)
    with pytest.raises(am.InputError, match="pinned"):
        ed.move(new, (112, 211))
    with pytest.raises(am.InputError, match="pinned"):
        ed.remove(new)
    assert ed.relax(new, reach=10) > 0
    assert ed.nearest((111.01, 211.0)) == new
    made = ed.mesh()
    assert np.abs(made.points - (111, 211)).sum(axis=1).min() < 1e-9
    ed.unpin(new)
    ed.remove(new)
    with pytest.raises(am.InputError, match="no atom"):
        ed.move(new, (112, 211))
    with pytest.raises(am.InputError):
        ed.add((0, 0))  # outside
    with pytest.raises(am.InputError, match="3 coordinates"):
        ed.add((110, 210, 1))
    assert len(ed.atoms[0]) == len(names)
    assert "atoms" in repr(ed)


def test_an_untouched_editor_of_voronoi_cells_gives_their_sites() -> None:
    mesh = am.mesh(FLAT, size=7, kind="voronoi", mirror=False, repel=False)
    ed = mesh.edit()
    assert mesh.sites is not None
    np.testing.assert_allclose(ed.atoms[1], mesh.sites)
    assert ed.mesh().cell_count == mesh.cell_count


def test_meshes_that_were_read_cannot_be_edited(in_tmp: Path) -> None:
    am.mesh(FLAT, size=8).write("m.vtu")
    with pytest.raises(am.InputError, match="read"):
        am.read_mesh("m.vtu").edit()


def test_voronoi_cells_are_vtks_lists() -> None:
    flat = am.mesh(FLAT, size=8, kind="voronoi")
    assert flat.offsets is not None and len(flat.offsets) == flat.cell_count + 1 and flat.regions is None
    area = 0.0
    for start, end in zip(flat.offsets[:-1], flat.offsets[1:], strict=True):
        count, *corners = flat.cells[start:end]
        assert count == len(corners)
        x, y = flat.points[corners].T
        area += (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    np.testing.assert_allclose(area, 79 * 59)
    space = am.mesh(VOLUME, size=7, kind="voronoi", features="edges")
    assert space.offsets is not None
    for start, end in zip(space.offsets[:-1], space.offsets[1:], strict=True):
        length, faces, *rest = space.cells[start:end].tolist()
        assert length == len(rest) + 1
        for _ in range(faces):
            count, *rest = rest
            rest = rest[count:]
        assert not rest


@pytest.mark.parametrize("statistic", ["mean", "harmonic", "geometric", "std", "min", "max", "majority", "homogeneity", "total"])
def test_samples_of_cells(statistic: str) -> None:
    image = 1 + np.tile(np.arange(80.0), (60, 1))
    mesh = am.mesh(FLAT, size=8)
    values = mesh.sample(image, statistic, name="k")
    assert values.shape == (mesh.cell_count,) and np.isfinite(values).all()
    np.testing.assert_array_equal(mesh.cell_data["k"], values)
    constant = mesh.sample(np.full(FLAT.shape, 3.0), statistic)
    if statistic not in ("std", "total", "homogeneity"):
        np.testing.assert_allclose(constant, 3)
    if statistic == "mean":
        centres = 1 + mesh.points[mesh.cells, 0].mean(axis=1)
        assert np.abs(values - centres).max() < 0.5
    if statistic == "total":
        # samples at the rim count by half, those at corners by a quarter
        weight = np.ones(FLAT.shape)
        for side in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]):
            weight[side] /= 2
        np.testing.assert_allclose(values.sum(), (weight * image).sum(), rtol=1e-9)


def test_samples_outside_and_wrong_ones() -> None:
    mesh = am.mesh(FLAT, size=8)
    part = am.Image(np.ones((60, 30)), origin=(0, 0))
    assert np.isnan(mesh.sample(part)).any()
    assert (mesh.sample(part, outside=-1) == -1).any()
    with pytest.raises(am.InputError, match="statistic"):
        mesh.sample(FLAT, "median")  # type: ignore[arg-type]
    with pytest.raises(am.InputError, match="axes"):
        mesh.sample(VOLUME)
    mesh.cell_data["short"] = np.zeros(3)
    with pytest.raises(am.InputError, match="short.*expected"):
        mesh.flow(sides={"xmin": 1, "xmax": 0})


def test_values_of_cells_are_written_and_read(in_tmp: Path) -> None:
    mesh = am.mesh(FLAT, size=8)
    mesh.cell_data["mine"] = np.arange(mesh.cell_count)
    for name in ("m.vtu", "m.msh", "m.msh2", "m.npz", "m.vtk"):
        mesh.write(name)
        again = am.read_mesh(name)
        np.testing.assert_allclose(again.points, mesh.points, rtol=1e-6)
        np.testing.assert_array_equal(again.cells, mesh.cells)
        if name != "m.npz":
            np.testing.assert_array_equal(again.cell_data["mine"], np.arange(mesh.cell_count))
        if name in ("m.vtu", "m.msh", "m.msh2"):
            assert {k: len(v) for k, v in again.facets.items()} == {k: len(v) for k, v in mesh.facets.items()}


def test_meshes_say_where_they_come_from() -> None:
    img = am.Image(FLAT, (0.5, 0.5), (1, 2), units=["m", "m"])
    meta = am.mesh(img, size=4, seed=7).meta
    assert meta["seed"] == 7 and meta["version"] == am.__version__
    assert meta["frame"]["spacing"] == [0.5, 0.5] and meta["frame"]["origin"] == [1, 2] and meta["frame"]["shape"] == [80, 60]
    assert meta["units"] == ["m", "m"]
    assert repr(am.mesh(img, size=4)).startswith("Mesh(triangles: ")


def test_surfaces_have_the_points_that_they_need(in_tmp: Path) -> None:
    two = labels(VOLUME.shape)
    mesh = am.mesh(VOLUME, size=5, features="edges", labels=two)
    for name in mesh.facets:
        surface = mesh.surface(name)
        np.testing.assert_array_equal(mesh.points[surface.point_ids], surface.points)
        np.testing.assert_array_equal(surface.point_ids[surface.cells], mesh.facets[name])
    assert mesh.surface("xmax").info is None
    right = mesh.surface(2)
    corners = right.points[right.cells]
    volume = np.linalg.det(corners).sum() / 6  # closed, and outward: by the divergence theorem
    of_cells = mesh.points[mesh.cells[mesh.regions == 2]]
    np.testing.assert_allclose(abs(volume), np.linalg.det(of_cells[:, 1:] - of_cells[:, :1]).sum() / 6, rtol=1e-9)
    with pytest.raises(KeyError, match="xmin"):
        mesh.surface("nothing")
    for name in ("s.vtp", "s.obj", "s.ply", "s.stl", "s.ts"):
        right.write(name)
        assert Path(name).stat().st_size > 100
    found = mesh.features()
    assert found and found[0].name == "feature-1" and found[0].info is not None and found[0].info["measure"] > 0
    flat = am.mesh(FLAT, size=7)
    assert flat.features(below=-0.3) and not flat.features(below=-0.3, min_facets=10**6)
    own = flat.features()
    longest = own[0].info["measure"]
    assert [s.name for s in flat.features(min_measure=longest)] == ["feature-1"] and not flat.features(min_facets=10**6)
    assert all(-1 <= s.info["mean"] < 0 for s in own)  # of the values at the points
    with pytest.raises(am.InputError, match="close_gaps"):
        flat.features(close_gaps=True)
    with pytest.raises(am.FileError):
        right.write("no folder/s.vtp")


@pytest.mark.parametrize("kind", ["delaunay", "voronoi"])
def test_clusters_end_at_features_and_are_nested(in_tmp: Path, kind: str) -> None:
    # a dark column through the whole image at x = 30: no part has cells on both sides of it
    image = np.full((60, 80), 200, np.uint8)
    image[:, 30] = 10
    mesh = am.mesh(image, size=6, kind=kind)  # type: ignore[arg-type]
    five, six = mesh.clusters(parts=5), mesh.clusters(parts=6)
    assert (five.dtype, five.shape) == (np.int32, (mesh.cell_count,))
    assert sorted(set(five.tolist())) == [1, 2, 3, 4, 5]
    assert len({(a, b) for a, b in zip(five.tolist(), six.tolist(), strict=True)}) == 6
    x = mesh.sample(np.tile(np.arange(80.0), (60, 1)))
    right = {part: x[five == part].mean() > 30 for part in range(1, 6)}
    assert np.mean([right[part] == (at > 30) for part, at in zip(five.tolist(), x, strict=True)]) > 0.98
    mesh.write("m.vtu")
    read = am.read_mesh("m.vtu")
    np.testing.assert_array_equal(read.clusters(image, parts=5, threads=1), read.clusters(image, parts=5, threads=2))
    with pytest.raises(am.InputError, match="0 parts"):
        mesh.clusters(parts=0)
    with pytest.raises(am.InputError, match="contrast"):
        mesh.clusters(contrast=0.0)


def test_reports_are_those_of_the_mesh_or_of_an_image(in_tmp: Path) -> None:
    mesh = am.mesh(FLAT, size=7)
    report = mesh.report()
    assert report["shape"]["inverted"] == 0 and report["alignment"]["recall"] > 0.8
    mesh.write("m.vtu")
    read = am.read_mesh("m.vtu")
    with pytest.raises(am.InputError, match="image"):
        read.report()
    np.testing.assert_allclose(read.report(FLAT, size=7)["alignment"]["recall"], report["alignment"]["recall"], atol=0.05)
    with pytest.raises(am.InputError, match="no other images"):
        read.report(FLAT, mask=FLAT)  # type: ignore[call-arg]
    assert read.quality()["cells"] == mesh.cell_count
    assert read.picture(FLAT)[:4] == b"\x89PNG"
    with pytest.raises(am.InputError, match="image"):
        read.picture()


def test_voronoi_cells_that_were_read_are_measured_and_searched_by_an_image(in_tmp: Path) -> None:
    made = am.mesh(FLAT, size=7, kind="voronoi")
    made.write("v.vtu")
    read = am.read_mesh("v.vtu")
    with pytest.warns(am.AtomeshNote, match="fidelity"):
        report = read.report(FLAT, size=7)
    np.testing.assert_allclose(report["alignment"]["recall"], made.report()["alignment"]["recall"], atol=0.05)
    with pytest.raises(am.InputError, match="image"):
        read.report()
    own = read.features()
    assert [s.name for s in own] == [s.name for s in made.features()]
    length = np.linalg.norm(np.diff(own[0].points[own[0].cells], axis=1), axis=2).sum()
    np.testing.assert_allclose(own[0].info["measure"], length, rtol=1e-9)
    assert read.features(FLAT, below=-0.3) and not read.features(FLAT, below=-0.3, min_facets=10**6)
    with pytest.raises(am.InputError, match="below"):
        read.features(FLAT)


def test_pictures_of_later_stages_may_be_over_another_image_in_the_same_place() -> None:
    lat = am.lattice(FLAT, distance=7)
    lat.settle()
    connected = lat.connect()
    own, inverted = connected.improve(), connected.improve(255 - FLAT)
    np.testing.assert_array_equal(own.points, inverted.points)
    assert own.picture() != inverted.picture()
    assert own.edit(255 - FLAT).mesh().picture() == inverted.edit().mesh().picture()
    with pytest.raises(am.InputError, match="samples"):
        connected.improve(FLAT[1:])


def test_the_loop_is_the_progress_of_steps() -> None:
    with pytest.raises(TypeError, match="settle"):
        am.lattice(FLAT, distance=7).optimize(progress=print)


def test_flow_is_conserved_in_each_cell_and_exact_where_pressure_is_linear() -> None:
    img = am.Image(np.zeros((21, 31)), (2, 2), (5, 6))
    mesh = am.mesh(img, size=8, features="none")
    k = 2.5
    flow = mesh.flow(sides={"xmin": 3.0, "xmax": 1.0}, k=k)
    # pressure falls linearly along x: k (3 - 1) / 60 through a height of 40
    np.testing.assert_allclose(flow.balance["boundary_in"], k * 2 / 60 * 40)
    np.testing.assert_allclose(flow.pressure, 3 - (mesh.points[mesh.cells, 0].mean(axis=1) - 5) / 30)
    np.testing.assert_allclose(flow.velocity, np.tile([k * 2 / 60, 0], (mesh.cell_count, 1)), atol=1e-12)
    facets = flow.facets
    np.testing.assert_allclose(flow.fluxes, facets["area"] @ [k * 2 / 60, 0], atol=1e-12)
    assert set(facets["group"]) >= {"xmin", "xmax", ""}


def net(flow: am.Flow, count: int) -> np.ndarray:
    """What flows out of each cell."""
    first, second = flow.facets["cells"].T
    out = np.zeros(count)
    np.add.at(out, first, flow.fluxes)
    np.add.at(out, second[second >= 0], -flow.fluxes[second >= 0])
    return out


@pytest.mark.parametrize("kind", ["delaunay", "voronoi"])
def test_wells_bring_what_flows_out(kind: str) -> None:
    wells = [(20.0, 12.0), (60.0, 45.0)]
    mesh = am.mesh(FLAT, size=7, fixed=wells, kind=kind)
    mesh.sample(np.where(FLAT < 100, 0.1, 2.0), "harmonic", name="k")
    flow = mesh.flow([{"at": wells[0], "rate": 2.0}], [wells[1]], k="k", multiplier=1.0)
    out = net(flow, mesh.cell_count)
    assert flow.balance["wells_in"] == pytest.approx(2) and flow.balance["wells_out"] == pytest.approx(2)
    assert out[out > 1e-9].sum() == pytest.approx(2) and out[out < -1e-9].sum() == pytest.approx(-2)
    lines = flow.streamlines(12)
    assert len(lines) >= 10
    for line in lines:
        assert (np.diff(line.times) >= 0).all() and line.points.shape == (len(line.times), 2)
        assert line.source == 0
    assert flow.picture("pressure", streamlines=5)[:4] == b"\x89PNG"
    html = flow._repr_html_()
    assert "<img" in html and len(html) <= 100_000 and "<script" not in html
    with pytest.raises(am.InputError, match="pressure"):
        flow.picture("velocity")  # type: ignore[arg-type]


def test_barriers_and_permeabilities() -> None:
    line = np.full((41, 61), 200, np.uint8)
    line[:, 30] = 10
    mesh = am.mesh(line, size=6)
    assert "feature-1" in mesh.facets
    sides = {"xmin": 1.0, "xmax": 0.0}
    through = [mesh.flow(sides=sides, barriers={"feature-1": share}).balance["boundary_in"] for share in (1.0, 0.1, 0.001)]
    assert through[0] > through[1] > through[2] > 0
    np.testing.assert_allclose(through[0], 40 / 60)
    tensor = mesh.flow(sides=sides, k=[4.0, 1.0], multiplier=1.0)
    np.testing.assert_allclose(tensor.balance["boundary_in"], 4 * 40 / 60)
    by_cell = mesh.flow(sides=sides, k=np.full(mesh.cell_count, 3.0), multiplier=1.0)
    np.testing.assert_allclose(by_cell.balance["boundary_in"], 3 * 40 / 60)
    for wrong in ({"barriers": {"nothing": 0.1}}, {"k": -1.0}, {"k": "nothing"}, {"sides": {"nowhere": 1.0}}, {"multiplier": 2}):
        with pytest.raises(am.InputError):
            mesh.flow(**{"sides": sides, **wrong})


@pytest.mark.parametrize("make", [lambda: am.mesh(FLAT, size=7), lambda: am.mesh(np.random.default_rng(0).normal(size=(300, 400)), size=6),
                                  lambda: am.mesh(VOLUME, size=5, features="edges"), lambda: am.mesh(FLAT, size=7, kind="voronoi")])
def test_notebooks_show_one_picture_and_five_numbers(make) -> None:
    html = make()._repr_html_()
    assert html.count("<img") == 1 and "data:image/png;base64," in html
    assert html.count("<tr>") in (3, 5)
    assert len(html) <= 100_000
    assert not re.search(r"<script|javascript:|on\w+=|http", html)


def test_what_cannot_be_pickled_says_so() -> None:
    mesh = am.mesh(FLAT, size=9)
    for thing in (mesh, am.Image(FLAT), mesh.surface("xmin"), am.lattice(FLAT, 9), mesh.edit()):
        with pytest.raises(TypeError, match=f"cannot pickle '.*{type(thing).__name__}' object"):
            pickle.dumps(thing)


def test_warnings_are_said_once_where_the_caller_is() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        am.mesh(np.zeros((30, 30)), size=8)
    assert [w.filename for w in caught] == [__file__]
