"""Threads, forks and memory."""

import multiprocessing
import os
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import atomesh as am
from conftest import ball, faults, python

FLAT, VOLUME = faults(), ball()
pytestmark = pytest.mark.filterwarnings("ignore::atomesh.AtomeshWarning")


def test_four_threads_at_once_make_what_one_makes() -> None:
    jobs = [
        lambda: am.mesh(FLAT, size=6).points,
        lambda: am.mesh(VOLUME, size=5, features="edges").points,
        lambda: am.mesh(FLAT, size=6, kind="voronoi", threads=1).points,
        lambda: am.mesh(FLAT.T, size=(5, 12), threads=1, progress=lambda event: None).points,
    ]
    expected = [np.array(job()) for job in jobs]
    made: dict[int, list[np.ndarray]] = {i: [] for i in range(4)}

    def work(i: int) -> None:
        for _ in range(3):
            made[i].append(np.array(jobs[i]()))

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive()
    for i in range(4):
        assert len(made[i]) == 3
        for points in made[i]:
            np.testing.assert_array_equal(points, expected[i])


def test_several_threads_may_ask_one_mesh() -> None:
    mesh = am.mesh(FLAT, size=5)
    expected = mesh.quality()
    found: list[dict] = []
    threads = [threading.Thread(target=lambda: found.append(mesh.quality())) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert found == [expected] * 4


def child(size: float, pipe) -> None:
    pipe.send(np.array(am.mesh(FLAT, size=size).points))
    pipe.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_child_that_was_forked_can_mesh() -> None:
    expected = np.array(am.mesh(FLAT, size=6).points)  # now the parent has threads
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=child, args=(6, theirs))
    process.start()
    assert ours.poll(30), "the child made no mesh"
    np.testing.assert_array_equal(ours.recv(), expected)
    process.join(10)
    assert process.exitcode == 0
    np.testing.assert_array_equal(am.mesh(FLAT, size=6).points, expected)


GROWTH = """
import gc, sys, warnings
import numpy as np
import atomesh as am
warnings.simplefilter("ignore")

def resident():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

image = np.full((60, 80), 200, np.uint8)
image[30] = 10
mark = 0
for number in range(220):
    mesh = am.mesh(image.copy(), size=8, progress=lambda event: None)
    mesh.points, mesh.cells, mesh.facets, mesh.point_data["potential"]
    mesh.sample(image, name="k")
    if number % 20 == 0:
        mesh.flow(sides={"xmin": 1.0, "xmax": 0.0}, k="k"), mesh.picture(max_side=200)
        for step in am.lattice(image, 8).optimize():
            break
        try:
            am.mesh(image, size=8, progress=lambda event: False)
        except am.Cancelled:
            pass
    if number == 60:
        mark = resident()
print(resident() - mark)
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="resident memory is asked for by /proc")
def test_two_hundred_meshes_leave_no_memory_behind() -> None:
    # threads have arenas of their own, whose sizes settle slowly: with one arena growth is a leak
    made = python(GROWTH, MALLOC_ARENA_MAX="1")
    assert made.returncode == 0, made.stderr
    assert int(made.stdout) < 5e6


def test_images_given_away_are_freed() -> None:
    code = """
import gc, weakref, numpy as np, atomesh as am
array = np.zeros((50, 60))
gone = weakref.ref(array)
img = am.Image(array)
del array
shown = img.array
del img
gc.collect()
assert shown.sum() == 0
del shown
gc.collect()
print(gone() is None)
"""
    made = python(code)
    assert made.stdout.strip() == "True", made.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="no such count here")
def test_threads_end_with_the_steps_that_they_were_made_for() -> None:
    lat = am.lattice(FLAT, 6)
    before = threading_count()
    for _ in range(20):
        for _step in lat.optimize():
            break
    for _ in range(50):
        if threading_count() <= before + 4:
            return
        threading.Event().wait(0.05)
    raise AssertionError(f"{threading_count()} threads, {before} before")


def threading_count() -> int:
    task = Path("/proc/self/task")
    return len(list(task.iterdir())) if task.exists() else 0
