"""What is taken for an image, what is refused, and with which words."""

import itertools

import numpy as np
import pytest

import atomesh as am
from conftest import ball, faults

FLAT = faults()


def points(array: object, **options: object) -> np.ndarray:
    return np.array(am.mesh(array, size=8, **options).points)


@pytest.fixture(scope="module")
def expected() -> np.ndarray:
    return points(FLAT)


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8"])
@pytest.mark.parametrize("order", "<>")
def test_types_and_byte_orders_do_not_matter(dtype: str, order: str) -> None:
    values = FLAT // 2
    array = values.astype(np.dtype(dtype).newbyteorder(order))
    img = am.Image(array)
    assert img.array.dtype.isnative
    np.testing.assert_array_equal(img.array, values)
    kept = {"f2": "f4", "u8": "f8", "i8": "f8"}.get(dtype, dtype)
    assert img.array.dtype == np.dtype(kept)


def test_integers_that_a_double_rounds_are_as_near_as_it_can(expected: np.ndarray) -> None:
    del expected
    assert am.Image(np.full((3, 3), 2**40 + 1, np.int64)).array[0, 0] == 2**40 + 1


@pytest.mark.parametrize(
    "view",
    [
        lambda a: np.asfortranarray(a),
        lambda a: np.repeat(np.repeat(a, 2, 0), 3, 1)[::2, ::3],
        lambda a: a[::-1, ::-1].copy()[::-1, ::-1],
        lambda a: np.ascontiguousarray(a.T).T,
        lambda a: np.lib.stride_tricks.as_strided(a, a.shape, a.strides, writeable=False),
        lambda a: a.tolist(),
        lambda a: am.Image(a).array,
        lambda a: am.Image(a),
        lambda a: memoryview(a),
        lambda a: np.ma.masked_array(a),
        lambda a: a.view(np.recarray),
    ],
    ids="fortran strided reversed transposed readonly list array image memoryview masked recarray".split(),
)
def test_layouts_do_not_matter(view, expected: np.ndarray) -> None:
    np.testing.assert_array_equal(points(view(FLAT.copy())), expected)


def test_bools_are_zero_and_one() -> None:
    img = am.Image(FLAT > 100)
    assert img.array.dtype == np.uint8
    assert set(np.unique(img.array)) == {0, 1}


def test_images_do_not_change_with_the_array_they_are_made_of_while_they_mesh() -> None:
    array = FLAT.copy()
    before = points(array)
    np.testing.assert_array_equal(array, FLAT)
    np.testing.assert_array_equal(points(array), before)


def test_arrays_of_images_and_meshes_are_read_only() -> None:
    mesh = am.mesh(FLAT, size=8)
    for array in (am.Image(FLAT).array, mesh.points, mesh.cells, *mesh.facets.values(), *mesh.point_data.values()):
        with pytest.raises(ValueError, match="read-only"):
            array.flat[0] = 1
    assert mesh.points.base is not None
    assert np.shares_memory(mesh.points, mesh.points)
    with pytest.raises(TypeError):
        mesh.point_data["mine"] = np.zeros(3)  # type: ignore[index]


def test_arrays_outlive_the_mesh_that_they_show() -> None:
    mesh = am.mesh(FLAT, size=8)
    shown, copy = mesh.points, mesh.points.copy()
    del mesh
    am.mesh(FLAT.T, size=8)
    np.testing.assert_array_equal(shown, copy)


@pytest.mark.parametrize(
    "array", [FLAT.astype(complex), FLAT.astype(object), FLAT.astype(str), FLAT.astype("M8[s]"), FLAT.astype("V3")], ids=str,
)
def test_what_is_no_number_is_a_type_error(array: np.ndarray) -> None:
    with pytest.raises(TypeError, match="expected integers or real numbers"):
        am.mesh(array)


@pytest.mark.parametrize("shape", [(), (5,), (2, 3, 4, 5)])
def test_other_numbers_of_axes_are_refused_with_their_shape(shape: tuple[int, ...]) -> None:
    with pytest.raises(am.InputError, match="expected two axes"):
        am.mesh(np.zeros(shape))


@pytest.mark.parametrize("shape", [(0, 5), (5, 0), (0, 0), (3, 0, 3)])
def test_empty_arrays_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(am.InputError, match="expected samples"):
        am.Image(np.zeros(shape))


@pytest.mark.parametrize("other", [object(), 3.5, {"a": 1}, None], ids=str)
def test_other_things_are_type_errors(other: object) -> None:
    with pytest.raises(TypeError):
        am.mesh(other)


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_samples_that_are_no_numbers_are_refused(axes: int, value: float) -> None:
    array = (FLAT if axes == 2 else ball()).astype(np.float32)
    array.flat[17] = value
    with pytest.raises(am.InputError, match="17|[Nn]a[Nn]|inf|finite") as refusal:
        am.mesh(array, size=8)
    if np.isnan(value):
        assert "fill" in str(refusal.value) and "--" not in str(refusal.value)


def test_nan_is_no_feature_where_a_fill_is_given() -> None:
    array = FLAT.astype(np.float32)
    array[:20, :20] = np.nan
    with pytest.warns(am.AtomeshNote, match="(?i)nan|without data|fill"):
        mesh = am.mesh(array, size=8, fill=200)
    assert any("fill" in note.lower() or "nan" in note.lower() for note in mesh.notes)
    assert np.isfinite(mesh.points).all() and mesh.quality()["inverted"] == 0


def test_masked_samples_are_samples_without_data() -> None:
    array = np.ma.masked_array(FLAT.astype(np.float32), np.zeros(FLAT.shape, bool))
    array[:20, :20] = np.ma.masked
    with_nan = FLAT.astype(np.float32)
    with_nan[:20, :20] = np.nan
    np.testing.assert_array_equal(
        am.mesh(array, size=8, mask="live").points, am.mesh(with_nan, size=8, mask="live", fill=0).points
    )


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"spacing": (1, 2, 3)}, "spacing has 3 numbers; expected 2"),
        ({"spacing": (0, 1)}, "spacing"),
        ({"spacing": (-1, 1)}, "spacing"),
        ({"spacing": (np.nan, 1)}, "spacing"),
        ({"origin": (0,)}, "origin has 1 numbers; expected 2"),
        ({"origin": (np.inf, 0)}, "origin"),
        ({"direction": np.eye(3)}, "direction has 9 numbers; expected 2 × 2"),
        ({"direction": np.ones((2, 2))}, "direction"),
    ],
)
def test_frames_that_are_none_are_refused(keywords: dict, message: str) -> None:
    with pytest.raises(am.InputError, match=message):
        am.Image(FLAT, **keywords)
    with pytest.raises(am.InputError):
        am.mesh(FLAT, **keywords)


def test_images_say_what_they_are_and_are_arrays() -> None:
    array = ball()
    img = am.Image(array, (1, 2, 3), (4, 5, 6), [[0, 0, 1], [1, 0, 0], [0, 1, 0]], units=["mm"] * 3)
    assert img.shape == array.shape[::-1]
    assert (img.spacing, img.origin, img.units) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), ["mm"] * 3)
    np.testing.assert_array_equal(img.direction, [[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(np.asarray(img), array)
    np.testing.assert_array_equal(img.__array__(), array)
    assert np.asarray(img, dtype=float).dtype == float
    assert "spacing=(1.0, 2.0, 3.0)" in repr(img)
    assert am.Image.of(img) is img


def test_lone_samples_and_thin_images_are_meshed_or_refused_in_words() -> None:
    for shape in itertools.product((1, 2, 3), repeat=2):
        try:
            mesh = am.mesh(np.zeros(shape), size=1)
        except am.InputError as refusal:
            assert str(refusal)
        else:
            assert mesh.cell_count > 0
