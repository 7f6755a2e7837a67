#!/usr/bin/env python3
"""Time that the Python package takes for a mesh, over that of the command, without reading and writing.

    python bench/python_time.py [--image FILE] [--runs 9] [--command PROGRAM]

Runs both in turn, each in a process of its own: `atomesh mesh -v`, whose phases are read from what it says, and
`atomesh.mesh` of the image as an array. Prints medians and their ratio, what importing the package takes beyond NumPy, and
how much memory a mesh adds to the image's. The package and the command are those of the Python that runs this.

The image is 256³ synthetic layers, or the file given.
"""

import argparse
import json
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

IN_PYTHON = """
import json, resource, sys, time
import numpy as np
begin = time.perf_counter()
import atomesh as am
imported = time.perf_counter() - begin
image = am.read(sys.argv[1])
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
begin = time.perf_counter()
mesh = am.mesh(image, size=float(sys.argv[2]), features="edges")
print(json.dumps({"seconds": time.perf_counter() - begin, "import": imported, "cells": mesh.cell_count, "peak": peak()}))
"""

PHASE = re.compile(r"^ *([a-z]+) +([0-9.]+) s$", re.MULTILINE)


def by_command(program, image, size, folder):
    """Seconds of a run of the command without reading and writing."""
    command = [program, "mesh", image, "-o", folder / "mesh.vtu", "--size", size, "--features", "edges", "-v"]
    said = subprocess.run(command, check=True, capture_output=True, text=True)
    phases = PHASE.findall(said.stderr + said.stdout)  # some come more than once
    return sum(float(seconds) for name, seconds in phases if name not in ("read", "write"))


def main():
    parser = argparse.ArgumentParser(description="Time of the Python package over that of the command.")
    parser.add_argument("--image", type=Path)
    parser.add_argument("--size", default="6")
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--command", default=str(Path(sys.executable).with_name("atomesh")))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        image = args.image or folder / "layers.npy"
        if args.image is None:
            synth = [args.command, "synth", "layers", "--bytes", "--shape", "256,256,256", "-o", image]
            subprocess.run(synth, check=True, capture_output=True)
        commands, packages = [], []
        for _ in range(args.runs):
            commands.append(by_command(args.command, image, args.size, folder))
            said = subprocess.run([sys.executable, "-c", IN_PYTHON, image, args.size], check=True, capture_output=True, text=True)
            packages.append(json.loads(said.stdout))
    command = statistics.median(commands)
    package = statistics.median(run["seconds"] for run in packages)
    print(f"command  {command:.3f} s, {min(commands):.3f} to {max(commands):.3f}")
    seconds = [run["seconds"] for run in packages]
    print(f"package  {package:.3f} s, {min(seconds):.3f} to {max(seconds):.3f}")
    print(f"ratio    {package / command:.3f}, medians of {args.runs} in turn")
    print(f"import   {1000 * statistics.median(run['import'] for run in packages):.1f} ms beyond NumPy")
    print(f"cells    {packages[0]['cells']}, peak {packages[0]['peak'] / 1e6:.0f} MB with the interpreter")


if __name__ == "__main__":
    main()
