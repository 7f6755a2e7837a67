#!/usr/bin/env python3
"""Whether a killed atomesh leaves whole files or the old ones, and nothing else.

    python3 bench/kills.py ATOMESH [--rounds N] [--seed S]

Each command is run over old outputs, and sent SIGINT, SIGTERM or SIGHUP after a random share of the time that it takes
by itself. Then its outputs are all old or all new, no file of another name is there, and the exit code is 0, or 128
and the signal. Exit code 1 if any of that does not hold.
"""
import argparse
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

INPUTS = [
    "synth faults -o faults.png --shape 200,200",
    "synth sphere -o ball.npy --shape 32,32,32",
    "mesh faults.png -o in.vtu --size 6 --tag-features -0.2 --write-potential b.npy",
    "mesh faults.png -o cells.vtu --mesh voronoi --size 8 --connections cells.json",
]
RUNS = [
    "mesh faults.png -o m.vtu --size 5 --report r.json --picture p.png --html h.html --write-potential q.npy --write-config c.toml",
    "mesh ball.npy -o polyMesh --size 3",
    "mesh faults.png -o v.vtu --mesh voronoi --size 6 --connections v.json",
    "enhance faults.png -o e.nrrd --as edges --picture e.png",
    "features in.vtu --potential b.npy -o f.vtp --mesh-output f.msh --json f.json",
    "surfaces in.vtu -o s.obj",
    "flow in.vtu --source 40,40 --sink 150,150 -o w.vtu --streamlines w.vtp --fluxes x.json --report y.json --picture w.png",
    "report in.vtu --potential b.npy --json t.json --html t.html",
    "sample in.vtu --image k=faults.png -o k.vtu",
    "export cells.json -o d.json --permeability 2",
    "synth layers -o l.nii.gz --shape 48,48,48",
    "man -o pages",
]
SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


def content(folder):
    """The bytes of every file under a folder, by name."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def start(program, run, folder):
    return subprocess.Popen([program, "-q", *run.split()], cwd=folder, stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)


def fault(program, run, folder, rounds, chance):
    """What a killed run does wrong, or nothing."""
    before = content(folder)
    began = time.monotonic()
    if code := start(program, run, folder).wait():
        return f"exit code {code} without a kill"
    needed = time.monotonic() - began
    names = [name for name, data in content(folder).items() if before.get(name) != data]
    for _ in range(rounds):
        for name in names:
            (folder / name).write_bytes(b"old")
        process, number = start(program, run, folder), chance.choice(SIGNALS)
        time.sleep(chance.uniform(0.02, 1.1) * needed)
        process.send_signal(number)
        code = process.wait()
        after = content(folder)
        old = [name for name in names if after.get(name) == b"old"]
        # before the handlers stand, the system ends the process
        if code not in (0, 128 + number, -number):
            return f"exit code {code} after signal {number}"
        if extra := set(after) - set(before) - set(names):
            return f"left {sorted(extra)} after signal {number}"
        if old and len(old) < len(names) or set(names) - set(after):
            return f"only {old} are old of {names} after signal {number}"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    program, chance = options.program.resolve(), random.Random(options.seed)
    is_whole = True
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "pages").mkdir()
        for run in INPUTS:
            if start(program, run, folder).wait():
                sys.exit(f"{run}: failed")
        for run in RUNS:
            found = fault(program, run, folder, options.rounds, chance)
            print(f"{found or 'whole'}: {run}", flush=True)
            is_whole &= found is None
    sys.exit(not is_whole)


if __name__ == "__main__":
    main()
