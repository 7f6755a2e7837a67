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
