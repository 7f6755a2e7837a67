"""Files that hold several images, and folders of slices: what is chosen, and what is refused."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import atomesh as am

VOLUME = np.arange(7 * 6 * 5, dtype=np.int16).reshape(7, 6, 5)


def test_an_array_of_an_archive_is_chosen_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "two.npz"
    np.savez(path, ct=VOLUME, label=VOLUME % 3)
    with pytest.raises(am.InputError, match=r"ct \(7, 6, 5\), label \(7, 6, 5\)"):
        am.read(path)
    np.testing.assert_array_equal(am.read(path, array="label").array, VOLUME % 3)
    with pytest.raises(am.InputError, match="not \"x\""):
        am.read(path, array="x")


def test_slices_of_a_folder_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for z, plane in zip((2, 9, 10, 11, 100, 101, 102), VOLUME, strict=True):
        (tmp_path / f"s{z}.pgm").write_bytes(b"P5 5 6 65535\n" + plane.astype(">u2").tobytes())
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        image = am.read(tmp_path, spacing=(0.5, 0.5, 2.0))
    np.testing.assert_array_equal(image.array, VOLUME)
    assert tuple(image.spacing) == (0.5, 0.5, 2.0)


def test_choices_that_are_none_are_input_errors(tmp_path: Path) -> None:
    path = tmp_path / "v.npy"
    np.save(path, VOLUME)
    for keywords in ({"volume": 0}, {"duplicates": "both"}):
        with pytest.raises((am.InputError, TypeError)):
            am.read(path, **keywords)


def test_wells_have_names(tmp_path: Path) -> None:
    image = am.Image(np.zeros((30, 40)))
    wells = [(12.5, 7.25), (31.0, 20.0)]
    for kind in ("delaunay", "voronoi"):
        mesh = am.mesh(image, size=5, features="none", fixed=wells, kind=kind)
        places = mesh.points if kind == "delaunay" else mesh.sites
        mesh.write(tmp_path / "m.vtu")
        for found in (mesh, am.read_mesh(tmp_path / "m.vtu")):
            assert list(found.point_groups) == ["well-1", "well-2"]
            for (number,), well in zip(found.point_groups.values(), wells, strict=True):
                np.testing.assert_allclose(places[number], well, atol=1e-12)


def test_a_slice_that_stands_in_space_is_meshed_there(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    header = (
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 40 30 1\nencoding: raw\nspace dimension: 3\n"
        "space directions: (0,0,2) (0,1,0) (1,0,0)\nspace origin: (5,6,7)\n\n"
    )
    grey = np.zeros((30, 40), np.uint8)
    grey[:, 20:] = 200
    (tmp_path / "slice.nrrd").write_bytes(header.encode() + grey.tobytes())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        image = am.read(tmp_path / "slice.nrrd")
        mesh = am.mesh(image, size=6)
    for name in ("m.vtu", "m.vtk", "m.msh", "m.inp"):
        mesh.write(tmp_path / name)
        x, y, z = meshio.read(tmp_path / name).points.T
        # the first axis runs along z by twos, the second along y; NRRD's world is not turned
        np.testing.assert_allclose(x, 5, atol=1e-9)
        np.testing.assert_allclose([y.min(), y.max(), z.min(), z.max()], [6, 35, 7, 85], atol=1e-9)
        back = am.read_mesh(tmp_path / name)
        np.testing.assert_allclose(back.points, mesh.points, atol=1e-9)
    # who says where it is says it in a plane
    flat = am.mesh(image, size=6, origin=(0, 0))
    flat.write(tmp_path / "flat.vtu")
    np.testing.assert_array_equal(meshio.read(tmp_path / "flat.vtu").points[:, 2], 0)
