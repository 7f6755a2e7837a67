"""Phases, voids, lengths by label, sections, and images that stand upright."""

from pathlib import Path

import numpy as np
import pytest

import atomesh as am
from conftest import command

Y, X = np.indices((60, 90))
GREY = np.where((X - 40) ** 2 + (Y - 20) ** 2 < 15**2, 200, 60).astype(np.uint8)


def test_thresholds_part_an_image_as_digitize_does() -> None:
    mesh = am.mesh(GREY, threshold=128, size=6)
    by_labels = am.mesh(GREY, labels=np.digitize(GREY, [128]), features="labels", size=6)
    np.testing.assert_array_equal(mesh.points, by_labels.points)
    np.testing.assert_array_equal(mesh.regions, by_labels.regions)
    assert set(mesh.region_names) == {0, 1} and "interface-0-1" in mesh.facets
    radius = np.hypot(*(mesh.points[np.unique(mesh.facets["interface-0-1"])] - (40, 20)).T)
    assert abs(radius - 15).max() < 0.8  # half a sample of the staircase, and its smoothing
    with pytest.raises(am.InputError, match="ascending"):
        am.mesh(GREY, threshold=(128, 20))
    with pytest.raises(am.InputError, match="parts nothing"):
        am.mesh(GREY, threshold=250)


def test_voids_are_left_out_and_labels_have_lengths_of_their_own() -> None:
    void = am.mesh(GREY, threshold=128, void=0, size=6)
    only = am.mesh(GREY, threshold=[128], only=[1], size=6)
    np.testing.assert_array_equal(void.points, only.points)
    areas = np.linalg.det(void.points[void.cells[:, 1:]] - void.points[void.cells[:, :1]]) / 2
    np.testing.assert_allclose(areas.sum(), (GREY == 200).sum(), rtol=0.03)
    fine = am.mesh(GREY, threshold=128, size=9, size_of={1: 3})
    inner, outer = (np.sqrt(_areas(fine)[fine.regions == label].mean() * 4 / 3**0.5) for label in (1, 0))
    assert inner < 4 and outer > 4.5
    with pytest.raises(am.InputError, match="labels"):
        am.mesh(GREY, void=0)


def _areas(mesh: am.Mesh) -> np.ndarray:
    corners = mesh.points[mesh.cells]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2


def test_sections_are_those_of_the_command_and_images_stand_upright(tmp_path: Path) -> None:
    np.save(tmp_path / "grey.npy", GREY)
    mesh = am.mesh(GREY, threshold=128, size=8, y_up=True)
    mesh.write(tmp_path / "python.inp", section="plane-stress", material={0: (70e3, 0.33), 1: (210e3, 0.3)})
    command([
        "mesh", tmp_path / "grey.npy", "-o", tmp_path / "command.inp", "--threshold", "128", "--size", "8", "--y-up",
        "--section", "plane-stress", "--material", "0=70e3,0.33", "--material", "1=210e3,0.3",
    ])
    assert (tmp_path / "python.inp").read_bytes() == (tmp_path / "command.inp").read_bytes()
    # the disc is near the first rows, which are above now
    middle = mesh.points[np.unique(mesh.facets["interface-0-1"])].mean(axis=0)
    np.testing.assert_allclose(middle, (40, 59 - 20), atol=0.5)
    with pytest.raises(am.InputError, match="section"):
        mesh.write(tmp_path / "m.vtu", section="plane-stress")


def test_waves_have_edges_within_bounds() -> None:
    velocity = np.where(Y < 10, 0.0, 60.0 + 3 * Y)
    with pytest.raises(am.InputError, match="velocities"):
        am.mesh(velocity, features="none", frequency=4)
    with pytest.warns(am.AtomeshNote, match="no waves travel"):
        mesh = am.mesh(velocity, features="none", frequency=4, size=(4, 7))
    assert mesh.point_data["distance"].min() >= 4 - 1e-6 and mesh.point_data["distance"].max() <= 7 + 1e-6
