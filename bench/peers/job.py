"""What every Python peer needs: a stopwatch, raw arrays in and out, one line of JSON as the answer."""

import json
import os
import sys
import time

import numpy as np


class Stopwatch:
    """Wall and CPU seconds of a `with` block; CPU time is of all threads and of programs it ran."""

    def __enter__(self):
        self.wall, self.cpu = time.perf_counter(), cpu_time()
        return self

    def __exit__(self, *_):
        self.wall, self.cpu = time.perf_counter() - self.wall, cpu_time() - self.cpu


def cpu_time():
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def read_points(path, dimension):
    """Points from raw little-endian f64, x fastest."""
    return np.fromfile(path, "<f8").reshape(-1, dimension)


def write_mesh(path, points, cells):
    """Writes a mesh where `run.py` measures it: PATH.points (f64) and PATH.cells (u32); "-" writes none."""
    if path != "-":
        np.ascontiguousarray(points, "<f8").tofile(path + ".points")
        np.ascontiguousarray(cells, "<u4").tofile(path + ".cells")


def finish(clock, **figures):
    """Prints the answer, the last line of standard output."""
    sys.stdout.flush()
    print("\n" + json.dumps({"wall": clock.wall, "cpu": clock.cpu, **figures}), flush=True)
