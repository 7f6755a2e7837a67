"""Python writes the bytes that the command writes."""

from pathlib import Path

import numpy as np
import pytest

import atomesh as am
from conftest import ball, command, faults, labels

FLAT, VOLUME = faults(), ball()
PLANE = {"size": 7}
SPACE = {"size": 5, "features": "edges"}

# name: image, keywords, the command's options, extension
SAME = {
    "triangles": (FLAT, PLANE, "--size 7", "vtu"),
    "gmsh": (FLAT, {**PLANE, "seed": 3}, "--size 7 --seed 3", "msh"),
    "abaqus": (FLAT, {**PLANE, "min_angle": 25}, "--size 7 --min-angle 25", "inp"),
    "sizes": (FLAT, {"size": (4, 12), "grade_by": "distance"}, "--size 4..12 --grade-by distance", "vtu"),
    "voronoi": (FLAT, {**PLANE, "kind": "voronoi"}, "--size 7 --mesh voronoi", "vtu"),
    "fixed": (
        FLAT,
        {**PLANE, "fixed": [(20, 30), (61.5, 12.25)], "features": {"dark": 1, "edges": 0.5}, "beta": 0.3},
        "--size 7 --seed-point 20,30 --seed-point 61.5,12.25 --features dark:1,edges:0.5 --beta 0.3",
        "vtu",
    ),
    "frame": (
        FLAT,
        {"size": 3.5, "spacing": (0.5, 0.75), "origin": (10, -20), "direction": [[0, -1], [1, 0]]},
        "--size 3.5 --spacing 0.5,0.75 --origin=10,-20 --direction=0,-1,1,0",
        "vtu",
    ),
    "samples": (
        FLAT, {**PLANE, "spacing": (0.5, 0.75), "units": "samples"}, "--size 7 --spacing 0.5,0.75 --units samples", "vtu",
    ),
    "faults": (
        np.random.default_rng(0).normal(size=(40, 50)).astype(np.float32),
        {"size": 8, "features": ["faults", "horizons"], "least_length": 5, "layer_reach": 2},
        "--size 8 --features faults,horizons --least-length 5 --layer-reach 2",
        "vtu",
    ),
    "sampled": (
        FLAT,
        {**PLANE, "engine": "sampled", "interpolation": "linear", "tolerance": 1e-2, "inner_limit": 20, "repel": True},
        "--size 7 --engine sampled --interpolation linear --tolerance 0.01 --inner-limit 20 --repel",
        "vtu",
    ),
    "random": (FLAT, {**PLANE, "lattice": "random", "align": "off"}, "--size 7 --lattice random --align off", "npz"),
    "tetrahedra": (VOLUME, SPACE, "--size 5 --features edges", "vtu"),
    "polyhedra": (VOLUME, {**SPACE, "kind": "voronoi"}, "--size 5 --features edges --mesh voronoi", "vtu"),
    "crop": (VOLUME, {**SPACE, "crop": ((2, 25), (3, 20), (0, 20))}, "--size 5 --features edges --crop 2..25,3..20,0..20", "msh2"),
}


def both(tmp_path: Path, image: np.ndarray, keywords: dict, options: str, ending: str, **output: object) -> None:
    """Meshes by either and compares."""
    np.save(tmp_path / "image.npy", image)
    by_command, by_python, by_path = (tmp_path / f"{name}.{ending}" for name in ("command", "python", "path"))
    flags = [f"--{name.replace('_', '-')}={str(value).lower()}" for name, value in output.items()]
    command(["mesh", tmp_path / "image.npy", "-o", by_command, *options.split(), *flags])
    am.mesh(image, **keywords).write(by_python, **output)
    assert by_python.read_bytes() == by_command.read_bytes()
    am.mesh(tmp_path / "image.npy", **keywords).write(by_path, **output)
    assert by_path.read_bytes() == by_command.read_bytes()


@pytest.mark.parametrize("name", SAME)
def test_same_options_give_the_bytes_of_the_command(name: str, tmp_path: Path) -> None:
    both(tmp_path, *SAME[name])


@pytest.mark.parametrize(
    ("ending", "output"),
    [("msh", {"msh": "2.2", "msh_text": True}), ("vtu", {"order": 2}), ("msh", {"tag_features": -0.2, "regions": True})],
)
def test_options_of_writing_give_the_bytes_of_the_command(ending: str, output: dict, tmp_path: Path) -> None:
    both(tmp_path, FLAT, PLANE, "--size 7", ending, **output)


@pytest.mark.parametrize("image", [FLAT, VOLUME], ids=["plane", "space"])
def test_images_in_memory_are_what_images_in_files_are(image: np.ndarray, tmp_path: Path) -> None:
    grid = np.indices(image.shape).astype(np.float32)
    fields = {
        "potential": -np.exp(-((grid[-1] - 15) ** 2) / 8),
        "size_field": 5 + grid[-1] / 10,
        "beta_field": 0.3 + grid[0] / 200,
        "mask": (((grid[-1] - image.shape[-1] / 2) / image.shape[-1]) ** 2 < 0.2).astype(np.uint8),
        "labels": labels(image.shape),
    }
    np.save(tmp_path / "image.npy", image)
    arguments: list[object] = ["mesh", tmp_path / "image.npy", "-o", tmp_path / "command.vtu"]
    for name, field in fields.items():
        np.save(tmp_path / f"{name}.npy", field)
        arguments += [f"--{name.replace('_', '-')}", tmp_path / f"{name}.npy"]
    command(arguments)
    expected = (tmp_path / "command.vtu").read_bytes()
    am.mesh(image, **fields).write(tmp_path / "arrays.vtu")
    assert (tmp_path / "arrays.vtu").read_bytes() == expected
    paths = {name: tmp_path / f"{name}.npy" for name in fields}
    am.mesh(tmp_path / "image.npy", **paths).write(tmp_path / "paths.vtu")
    assert (tmp_path / "paths.vtu").read_bytes() == expected
    # a size or weight may be an image where it may be a number
    fields["size"], fields["beta"] = fields.pop("size_field"), fields.pop("beta_field")
    am.mesh(image, **fields).write(tmp_path / "short.vtu")
    assert (tmp_path / "short.vtu").read_bytes() == expected


def test_a_potential_and_labels_alone_are_enough(tmp_path: Path) -> None:
    b = -np.exp(-((np.indices(FLAT.shape)[1] - 30.0) ** 2) / 8).astype(np.float32)
    np.save(tmp_path / "b.npy", b)
    np.save(tmp_path / "labels.npy", labels(FLAT.shape))
    command(["mesh", "--potential", tmp_path / "b.npy", "--size", 7, "-o", tmp_path / "command.vtu"])
    am.mesh(None, potential=b, size=7).write(tmp_path / "python.vtu")
    assert (tmp_path / "python.vtu").read_bytes() == (tmp_path / "command.vtu").read_bytes()
    command(["mesh", "--labels", tmp_path / "labels.npy", "--size", 7, "-o", tmp_path / "command.vtu"])
    am.mesh(None, labels=labels(FLAT.shape), size=7).write(tmp_path / "python.vtu")
    assert (tmp_path / "python.vtu").read_bytes() == (tmp_path / "command.vtu").read_bytes()


def test_the_number_of_threads_does_not_matter(tmp_path: Path) -> None:
    for threads in (1, 2, 3):
        am.mesh(VOLUME, threads=threads, **SPACE).write(tmp_path / f"{threads}.vtu")
    assert len({(tmp_path / f"{threads}.vtu").read_bytes() for threads in (1, 2, 3)}) == 1


def test_potentials_and_flows_are_the_commands(tmp_path: Path) -> None:
    np.save(tmp_path / "image.npy", FLAT)
    command(["enhance", tmp_path / "image.npy", "-o", tmp_path / "b.npy", "--features", "edges", "--edge-scale", 2])
    b = am.enhance(FLAT, "edges", edge_scale=2)
    np.testing.assert_array_equal(b.array, np.load(tmp_path / "b.npy"))
    wells = ["--source", "20,30", "--sink", "61.5,12.25", "--side", "xmax=pressure:0", "--multiplier", 0.5]
    command(["flow", tmp_path / "image.npy", "--size", 7, *wells, "-o", tmp_path / "command.vtu"])
    mesh = am.mesh(FLAT, size=7, fixed=[(20, 30), (61.5, 12.25)])
    flow = mesh.flow([(20, 30)], [(61.5, 12.25)], {"xmax": 0.0}, multiplier=0.5)
    flow.write(tmp_path / "python.vtu")
    made, expected = am.read_mesh(tmp_path / "python.vtu"), am.read_mesh(tmp_path / "command.vtu")
    assert set(made.cell_data) == set(expected.cell_data)
    np.testing.assert_array_equal(made.points, expected.points)
    np.testing.assert_allclose(made.cell_data["pressure"], expected.cell_data["pressure"], rtol=1e-9, atol=1e-12)
