#!/usr/bin/env python3
"""Time and memory of `atomesh mesh` against the number of samples N and of atoms n.

    bench/cost_law.py [--atomesh PROGRAM] [--scene layers-faults] [--large] [--repeat 3] [--work FOLDER]

Draws seeded images of 64³ to 512³ bytes (with --large 1024³ too, which takes 7 GB of memory) by `atomesh synth`,
meshes each from file to VTU with d = 8, and one of 256³ with several d, and prints a Markdown table: atoms, cells, wall
time, user time and peak resident memory of the whole process, medians of some runs; the memory that a run may take; the
exponents of time against N and n, fitted by least squares to logarithms; the seconds of each phase. Peaks below 30 MB or
so are Python's own, which a process counts as its own until it has started.

Exit code 1 if a bound is broken:

- memory: at most the image in its own type, two single-precision copies, 600 bytes an atom, 60 a cell and 64 MB;
- 512³ at d = 8: at most 40 s and 3 GB;
- the exponent of wall time against N: at most 1.05.

Needs Python 3 and NumPy.
"""
import argparse
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

DISTANCE = 8.0
SIDES = [64, 128, 256, 512]
LARGE_SIDE = 1024
DISTANCES = [16.0, 12.0, 8.0, 6.0, 5.0, 4.0]
DISTANCES_SIDE = 256
MOST_EXPONENT = 1.05
MOST_SECONDS_512 = 40.0
MOST_BYTES_512 = 3e9

PHASES = ["read", "potential", "distance", "grow", "optimize", "connect", "measure", "write"]

SUMMARY = re.compile(r": (\d+) points, (\d+) (?:tetrahedra|triangles)")
PHASE = re.compile(r"^ *([a-z]+) +([0-9.]+) s$", re.MULTILINE)


def budget(samples, sample_bytes, atoms, cells):
    """The bytes that a run in space may take at its peak."""
    return sample_bytes * samples + 2 * 4 * samples + 600 * atoms + 60 * cells + 64e6


def measured(command):
    """Runs a command; its wall and user seconds, peak bytes, and what it said."""
    with tempfile.TemporaryFile() as said:
        start = time.perf_counter()
        process = subprocess.Popen(command, stdout=said, stderr=said)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read().decode()
    if process.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\nended with {process.returncode}:\n{text}")
    return wall, usage.ru_utime, usage.ru_maxrss * 1024, text


class Run:
    """Medians of some runs of the same work."""

    def __init__(self, args, side, distance):
        image = draw(args, side)
        mesh = args.work / "mesh.vtu"
        command = [args.atomesh, "mesh", image, "-o", mesh, "--size", str(distance), "-v"]
        command += ["--features", "edges"] if args.scene == "layers" else []
        # the largest run once: it takes as long as all others together
        runs = [measured(command) for _ in range(1 if side >= LARGE_SIDE else args.repeat)]
        median = lambda k: statistics.median(run[k] for run in runs)
        self.side, self.distance, self.samples = side, distance, side**3
        self.wall, self.user, self.peak = median(0), median(1), max(run[2] for run in runs)
        text = runs[-1][3]
        self.atoms, self.cells = map(int, SUMMARY.search(text).groups())
        self.phases = {name: float(seconds) for name, seconds in PHASE.findall(text)}
        self.allowed = budget(self.samples, 1, self.atoms, self.cells)
        mesh.unlink()

    def row(self):
        fits = "yes" if self.peak <= self.allowed else "**no**"
        return (
            f"| {self.side}³ | {self.distance:g} | {self.atoms:,} | {self.cells:,} | {self.wall:.2f} | {self.user:.2f} "
            f"| {self.cells / self.wall:,.0f} | {self.peak / 1e6:,.0f} | {self.allowed / 1e6:,.0f} | {fits} |"
        )


def draw(args, side):
    """The image of a cube of this side, drawn if it is not there."""
    path = args.work / f"{args.scene}-{side}.npy"
    if not path.exists():
        shape = ",".join([str(side)] * 3)
        measured([args.atomesh, "synth", args.scene, "--bytes", "--shape", shape, "-o", path])
    return path


def exponent(runs, size, cost):
    """The slope of the logarithm of the cost against that of the size; None of fewer than two runs."""
    if len(runs) < 2:
        return None
    logarithms = [np.log([of(run) for run in runs]) for of in (size, cost)]
    return float(np.polyfit(*logarithms, 1)[0])


def table(runs):
    print("| samples | d | atoms | cells | wall s | user s | cells/s | peak MB | allowed MB | within |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for run in runs:
        print(run.row())


def phase_table(runs):
    print(f"\n| samples | d | {' | '.join(PHASES)} |\n| --- | --- |{' --- |' * len(PHASES)}")
    for run in runs:
        seconds = " | ".join(f"{run.phases.get(name, 0.0):.2f}" for name in PHASES)
        print(f"| {run.side}³ | {run.distance:g} | {seconds} |")


def main():
    parser = argparse.ArgumentParser(description="Time and memory of `atomesh mesh` against N and n.")
    parser.add_argument("--atomesh", default="target/release/atomesh", help="the program; default: %(default)s")
    parser.add_argument("--scene", default="layers-faults", choices=["layers-faults", "layers"],
                        help="faults alone, dark; or layers as amplitudes, whose edges are taken")
    parser.add_argument("--sides", type=int, nargs="+", default=SIDES, help="default: %(default)s")
    parser.add_argument("--large", action="store_true", help=f"{LARGE_SIDE}³ too")
    parser.add_argument("--repeat", type=int, default=3, help="runs of which the median counts; default: %(default)s")
    parser.add_argument("--work", type=Path, help="where images and meshes go; default: a folder that is removed")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        args.work = args.work or Path(folder)
        args.work.mkdir(parents=True, exist_ok=True)
        sides = args.sides + [LARGE_SIDE] * args.large
        by_samples = [Run(args, side, DISTANCE) for side in sides]
        table(by_samples)
        law = exponent(by_samples, lambda r: r.samples, lambda r: r.wall)
        user_law = exponent(by_samples, lambda r: r.samples, lambda r: r.user)
        by_atoms = []
        if DISTANCES_SIDE in sides:
            by_atoms = [Run(args, DISTANCES_SIDE, d) for d in DISTANCES]
            print()
            table(by_atoms)
        phase_table(by_samples + by_atoms)

    broken = [f"{r.side}³, d = {r.distance:g}: {r.peak / 1e6:,.0f} MB" for r in by_samples + by_atoms
              if r.peak > r.allowed]
    if law is not None:
        print(f"\nWall time grows as N^{law:.3f}, user time as N^{user_law:.3f} at d = {DISTANCE:g}.")
        if law > MOST_EXPONENT and max(sides) >= 512:  # the smallest images are all overhead
            broken.append(f"the exponent of wall time against N is {law:.3f}")
    atom_law = exponent(by_atoms, lambda r: r.atoms, lambda r: r.wall)
    if atom_law is not None:
        user_atom_law = exponent(by_atoms, lambda r: r.atoms, lambda r: r.user)
        print(f"At {DISTANCES_SIDE}³ wall time grows as n^{atom_law:.3f}, user time as n^{user_atom_law:.3f}.")
    for run in by_samples:
        if run.side == 512 and (run.wall > MOST_SECONDS_512 or run.peak > MOST_BYTES_512):
            broken.append(f"512³ takes {run.wall:.1f} s and {run.peak / 1e9:.2f} GB")
    if broken:
        sys.exit("\nBroken bounds:\n" + "\n".join(broken))
    print("All bounds hold.")


if __name__ == "__main__":
    main()
