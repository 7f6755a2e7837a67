"""Images of other packages: where a feature is in the world comes out the same, whichever way it came in."""

import sys
from pathlib import Path

import numpy as np
import pytest

import atomesh as am

# A bright ball in a box of three different sides, spacings and offsets, turned: no axis may be taken for another.
SHAPE = (26, 31, 37)  # z, y, x
SPACING = np.array([0.875, 1.25, 1.75])  # as exact in the single precision of NIfTI
ORIGIN = np.array([11.0, -23.0, 5.0])
ANGLE = np.radians(30)
TURNED = np.array([[np.cos(ANGLE), -np.sin(ANGLE), 0], [np.sin(ANGLE), np.cos(ANGLE), 0], [0, 0, 1.0]])
PERMUTED = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
MIRRORED = np.diag([1.0, -1.0, 1.0])
CENTRE = np.array([22.0, 12.0, 15.0])  # of the ball, in samples, x first
RADIUS = 8.0  # in world units


def phantom() -> np.ndarray:
    z, y, x = np.indices(SHAPE)
    away = (np.stack([x, y, z], axis=-1) - CENTRE) * SPACING
    return np.where((away**2).sum(-1) < RADIUS**2, 200, 30).astype(np.uint8)


def world(direction: np.ndarray) -> np.ndarray:
    """Where the ball is."""
    return ORIGIN + direction @ (SPACING * CENTRE)


def check(img: am.Image, direction: np.ndarray, spacing: np.ndarray = SPACING) -> am.Mesh:
    """The frame, and the ball in a mesh."""
    np.testing.assert_allclose(img.origin, ORIGIN, atol=1e-4)
    np.testing.assert_allclose(img.spacing, spacing, rtol=1e-6)
    np.testing.assert_allclose(img.direction, direction, atol=1e-6)
    np.testing.assert_array_equal(img.array, phantom())
    mesh = am.mesh(img, size=5, features="edges", threads=1)
    ball = mesh.facets["feature-1"]
    centre = mesh.points[np.unique(ball)].mean(axis=0)
    assert np.linalg.norm(centre - world(direction)) < 0.5
    away = np.linalg.norm(mesh.points[np.unique(ball)] - world(direction), axis=1)
    # edges are blurred over some samples of 0.9 to 1.7
    assert abs(away.mean() - RADIUS) < 0.5 and away.std() < 0.8
    assert (volumes(mesh) > 0).all()
    inside = volumes(mesh).sum()
    np.testing.assert_allclose(inside, np.prod((np.array(SHAPE[::-1]) - 1) * SPACING), rtol=1e-6)
    return mesh


def same(mesh: am.Mesh, expected: am.Mesh, direction: np.ndarray, signs: np.ndarray | tuple[int, ...] = (1, 1, 1)) -> None:
    """The same points, but for signs of axes. In a turned frame spacings are rounded, and a lattice is not the same then."""
    if direction is not TURNED:
        np.testing.assert_allclose(mesh.points, signs * expected.points, atol=1e-3)
    centre = mesh.points[np.unique(mesh.facets["feature-1"])].mean(axis=0)
    assert np.linalg.norm(centre - signs * world(direction)) < 0.5


def volumes(mesh: am.Mesh) -> np.ndarray:
    corners = mesh.points[mesh.cells]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6


DIRECTIONS = pytest.mark.parametrize("direction", [np.eye(3), TURNED, PERMUTED, MIRRORED], ids="axes turned permuted mirrored".split())


@DIRECTIONS
def test_arrays(direction: np.ndarray) -> None:
    check(am.Image(phantom(), SPACING, ORIGIN, direction), direction)


@DIRECTIONS
def test_simpleitk_and_the_files_it_writes(direction: np.ndarray, tmp_path: Path) -> None:
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(phantom())
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirection(direction.ravel())
    # x to the right and y to the front, as of files, where ITK's world has left and back
    right_front = np.array([-1, -1, 1])
    img = am.Image.of(image)
    np.testing.assert_allclose(img.origin, right_front * ORIGIN)
    mesh = am.mesh(img, size=5, features="edges")
    np.testing.assert_array_equal(am.mesh(image, size=5, features="edges").points, mesh.points)
    same(mesh, check(am.Image(phantom(), SPACING, ORIGIN, direction), direction), direction, right_front)
    # what the object says of places in the world
    index = [int(i) for i in CENTRE]
    np.testing.assert_allclose(image.TransformIndexToPhysicalPoint(index), world(direction))
    for name in ("x.nii.gz", "x.nrrd"):
        sitk.WriteImage(image, str(tmp_path / name))
        read = am.read(tmp_path / name)
        np.testing.assert_array_equal(read.array, phantom())
        np.testing.assert_allclose(read.direction, right_front[:, None] * direction, atol=1e-5)
        if direction is not TURNED:  # whose spacings files round
            np.testing.assert_allclose(am.mesh(read, size=5, features="edges").points, mesh.points, atol=1e-3)
    # and back: the potential as an image of theirs
    b = am.enhance(image, "edges")
    back = sitk.GetImageFromArray(b.array)
    back.SetSpacing(b.spacing)
    back.SetOrigin(right_front * b.origin)
    back.SetDirection((right_front[:, None] * b.direction).ravel())
    assert back.GetDirection() == image.GetDirection() and back.GetOrigin() == image.GetOrigin()


@DIRECTIONS
def test_itk(direction: np.ndarray) -> None:
    itk = pytest.importorskip("itk")
    image = itk.GetImageFromArray(phantom())
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirection(direction)
    img = am.Image.of(image)
    right_front = np.array([-1, -1, 1])
    np.testing.assert_allclose(img.origin, right_front * ORIGIN)
    np.testing.assert_allclose(img.direction, right_front[:, None] * direction)


@DIRECTIONS
def test_nibabel_and_the_files_it_writes(direction: np.ndarray, tmp_path: Path) -> None:
    nib = pytest.importorskip("nibabel")
    affine = np.eye(4)
    affine[:3, :3] = direction * SPACING
    affine[:3, 3] = ORIGIN
    image = nib.Nifti1Image(phantom().T, affine)
    image.header.set_xyzt_units("mm")
    img = am.Image.of(image)
    mesh = check(img, direction)
    assert img.units == ["mm"] * 3
    nib.save(image, tmp_path / "x.nii.gz")
    read = am.read(tmp_path / "x.nii.gz")
    np.testing.assert_array_equal(read.array, img.array)
    assert read.units == img.units
    same(am.mesh(read, size=5, features="edges"), mesh, direction)
    check(am.Image.of(nib.load(tmp_path / "x.nii.gz")), direction)


def test_nibabel_refuses_what_is_no_placement() -> None:
    nib = pytest.importorskip("nibabel")
    sheared = np.eye(4)
    sheared[0, 1] = 0.5
    with pytest.raises(am.InputError, match="sheared"):
        am.Image.of(nib.Nifti1Image(phantom().T, sheared))
    with pytest.raises(am.InputError, match="three axes"):
        am.Image.of(nib.Nifti1Image(np.zeros((3, 4, 5, 6), np.uint8), np.eye(4)))


@DIRECTIONS
def test_pyvista(direction: np.ndarray) -> None:
    pv = pytest.importorskip("pyvista")
    grid = pv.ImageData(dimensions=SHAPE[::-1], spacing=SPACING, origin=ORIGIN, direction_matrix=direction)
    grid["values"] = phantom().ravel()
    mesh = check(am.Image.of(grid), direction)
    # what the object says of places in the world
    number = np.ravel_multi_index([int(i) for i in CENTRE[::-1]], SHAPE)
    np.testing.assert_allclose(grid.points[number], world(direction), atol=1e-4)
    # and back: points in the object's own world, features beside them
    back = mesh.to_pyvista()
    np.testing.assert_allclose(back.bounds, grid.bounds, atol=1e-4)
    np.testing.assert_allclose(back.volume, volumes(mesh).sum(), rtol=1e-6)


def test_pyvista_values_of_cells_parts_of_grids_and_flat_grids() -> None:
    pv = pytest.importorskip("pyvista")
    grid = pv.ImageData(dimensions=np.array(SHAPE[::-1]) + 1, spacing=SPACING, origin=ORIGIN - SPACING / 2)
    grid.cell_data["values"] = phantom().ravel()
    check(am.Image.of(grid), np.eye(3))
    part = pv.ImageData(dimensions=SHAPE[::-1], spacing=SPACING, origin=ORIGIN - SPACING * (2, 3, 4))
    part.offset = (2, 3, 4)
    part["values"] = phantom().ravel()
    check(am.Image.of(part), np.eye(3))
    flat = pv.ImageData(dimensions=(5, 4, 1), spacing=(2, 3, 1), origin=(7, 8, 0))
    flat["values"] = np.arange(20)
    img = am.Image.of(flat)
    assert (img.shape, img.spacing, img.origin) == ((5, 4), (2.0, 3.0), (7.0, 8.0))
    np.testing.assert_array_equal(img.array, np.arange(20).reshape(4, 5))
    turned = pv.ImageData(dimensions=(5, 4, 1), direction_matrix=TURNED)
    turned["values"] = np.arange(20)
    np.testing.assert_allclose(am.Image.of(turned).direction, TURNED[:2, :2])
    with pytest.raises(am.InputError, match="active scalars"):
        am.Image.of(pv.ImageData(dimensions=(3, 3, 3)))
    vectors = pv.ImageData(dimensions=(3, 3, 3))
    vectors["v"] = np.zeros((27, 3))
    vectors.set_active_scalars("v")
    with pytest.raises(am.InputError, match="3 components"):
        am.Image.of(vectors)


def test_xarray() -> None:
    xr = pytest.importorskip("xarray")
    z, y, x = (ORIGIN[2 - i] + SPACING[2 - i] * np.arange(n) for i, n in enumerate(SHAPE))
    data = xr.DataArray(phantom(), dims=("z", "y", "x"), coords={"z": z, "y": y, "x": x})
    for name in "xyz":
        data[name].attrs["units"] = "m"
    img = am.Image.of(data)
    assert img.units == ["m"] * 3
    mesh = check(img, np.eye(3))
    # descending coordinates, as of latitudes, are the same places
    np.testing.assert_allclose(am.mesh(data.isel(y=slice(None, None, -1)), size=5, features="edges").points, mesh.points)
    at = data.sel(x=world(np.eye(3))[0], y=world(np.eye(3))[1], z=world(np.eye(3))[2], method="nearest")
    assert at == 200
    with pytest.raises(am.InputError, match="evenly spaced"):
        am.Image.of(data.isel(x=[0, 1, 3]))
    with pytest.raises(am.InputError, match="4 axes"):
        am.Image.of(data.expand_dims("t"))
    with pytest.raises(am.InputError, match="numbers"):
        am.Image.of(xr.DataArray(np.zeros((2, 3)), dims=("y", "x"), coords={"x": ["a", "b", "c"]}))


def test_colours_and_series_of_simpleitk_are_refused() -> None:
    sitk = pytest.importorskip("SimpleITK")
    with pytest.raises(am.InputError, match="3 components"):
        am.Image.of(sitk.GetImageFromArray(np.zeros((4, 5, 3), np.uint8), isVector=True))
    with pytest.raises(am.InputError, match="4 axes"):
        am.Image.of(sitk.Image([2, 3, 4, 5], sitk.sitkUInt8))


def test_none_of_these_packages_is_imported_by_atomesh() -> None:
    from conftest import python

    made = python(
        "import sys, atomesh, numpy as np\natomesh.mesh(np.eye(30), size=8)._repr_html_()\n"
        "print([n for n in 'itk SimpleITK nibabel pyvista vtk xarray meshio skfem matplotlib scipy tqdm'.split() if n in sys.modules])",
        PYTHONWARNINGS="ignore",
    )
    assert made.stdout.strip() == "[]", made.stderr
    assert sys.modules["atomesh"] is am
