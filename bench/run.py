#!/usr/bin/env python3
"""Runs atomesh and its peers on the same work, in alternation, and prints the tables of README.md.

Needs Python 3.11, a Rust toolchain and, for the C++ peers, a Debian (or their packages). All else is put under
target/peers: virtual environments, compiled drivers, inputs, results. With ATOMESH_DATA the image is a brain
(mni152-t1.nii.gz in that folder); without, synthetic grains. With ATOMESH_BP2004, the SEG-Y file of the BP 2004
velocity model, that is meshed too.
"""

import argparse
import datetime
import json
import os
import subprocess
import sys

sys.dont_write_bytecode = True  # leave the sources' folders as they are

from harness import child, table
from harness.install import BENCH, PEERS, ROOT, Installer
from harness.sections import ATOMESH, BP2004, INPUTS, LIMIT, MESHES, SECTIONS, Maker, scanned_image

RESULTS = PEERS / "results.json"
SLOW = 20  # seconds from which on one run of a program has to do


def main():
    options = arguments()
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    if not options.table:
        run(options, results)
    text = table.document({name: results[name] for name in SECTIONS if name in results and name in options.only})
    print(text)
    if options.update:
        table.update(BENCH / "README.md", table.document({name: results[name] for name in SECTIONS if name in results}))


def run(options, results):
    """Measures the sections wanted; each is kept when it is done, so that a run that was ended lost one at most."""
    installer = Installer(options.retry)
    build()
    make_inputs(installer)
    MESHES.mkdir(exist_ok=True)
    jobs = {name: SECTIONS[name](Maker(installer, name)) for name in options.only}  # installs all before any runs
    for name in options.only:
        results[name] = measure(name, jobs[name], options, installer)
        RESULTS.write_text(json.dumps(results, indent=1))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=5, help="runs of each program; the tables show medians (default 5)")
    parser.add_argument("--only", type=lambda s: s.split(","), default=list(SECTIONS), metavar="A,B",
                        help=f"sections to run: {', '.join(SECTIONS)} (default all)")
    parser.add_argument("--update", action="store_true",
                        help="write the tables, with what earlier runs found, into README.md")
    parser.add_argument("--table", action="store_true", help="run nothing: print what earlier runs found")
    parser.add_argument("--retry", action="store_true", help="try again to install what has failed")
    parser.add_argument("--limit", type=float, default=LIMIT, help=f"seconds that a program may take (default {LIMIT})")
    options = parser.parse_args()
    unknown = set(options.only) - set(SECTIONS)
    if unknown:
        parser.error(f"no section {', '.join(unknown)}; there are {', '.join(SECTIONS)}")
    return options


def build():
    command = ["cargo", "build", "--release", "--locked", "-p", "atomesh-cli", "-p", "atomesh-bench-driver"]
    subprocess.run(command, cwd=ROOT, check=True)


def make_inputs(installer):
    """Points, velocities, image and labels: made once, and again when their recipe or the image changes."""
    INPUTS.mkdir(parents=True, exist_ok=True)
    image = scanned_image()
    if not image.exists():
        synth = [ATOMESH, "synth", "grains3", "-o", image, "--shape", "197,233,189", "--bytes", "--blur", "1"]
        subprocess.run([str(part) for part in synth], check=True)
    model = [BP2004] if BP2004 else []
    recipe = f"{image} {model}\n" + (BENCH / "harness" / "inputs.py").read_text()
    mark = INPUTS / "recipe"
    if not (mark.exists() and mark.read_text() == recipe):
        command = [*installer.command("judge"), BENCH / "harness" / "inputs.py", INPUTS, image, *model]
        subprocess.run([str(part) for part in command], check=True)
        mark.write_text(recipe)


def measure(name, jobs, options, installer):
    """Runs a section's jobs in alternation; returns its rows and under which conditions they came about."""
    load = os.getloadavg()[0]
    taken = [[{"error": job.error}] if job.error else [] for job in jobs]
    shapes = [{} for _ in jobs]
    for run in range(options.runs):
        for place, job in enumerate(jobs):
            if taken[place] and ("error" in taken[place][-1] or taken[place][-1]["wall"] > SLOW):
                continue
            say(f"{name} {run + 1}/{options.runs}: {job.work}: {job.program}, {job.threads} thread(s)")
            # meshes are written once: writing is not timed, but takes memory
            command = job.command if run == 0 else without_mesh(job)
            taken[place].append(child.run(command, options.limit, job.environment))
            if run == 0 and job.dimension and "error" not in taken[place][0]:
                shapes[place] = judge(job, installer)
    rows = [{"work": job.work, "program": job.program, "threads": job.threads, **table.summary(runs, shape)}
            for job, runs, shape in zip(jobs, taken, shapes)]
    now = datetime.datetime.now(datetime.timezone.utc)
    conditions = [f"{now:%Y-%m-%d %H:%M} UTC", processor(), f"medians of {options.runs} runs, or one of over {SLOW} s",
                  f"load before it {load:.1f}"]
    return {"rows": rows, "conditions": ", ".join(conditions) + "."}


def without_mesh(job):
    """The command without its mesh; a file that is itself the product stays."""
    if "." in job.mesh.rsplit("/", 1)[-1]:
        return job.command
    if "--mesh" in job.command:
        place = job.command.index("--mesh")
        return job.command[:place] + job.command[place + 2:]
    return ["-" if str(part) == job.mesh else part for part in job.command]


def judge(job, installer):
    """The shape of a job's mesh, which is then deleted."""
    command = [*installer.command("judge"), BENCH / "harness" / "shape.py", job.mesh, job.dimension]
    shape = child.run(command, 600)
    for ending in ("", ".points", ".cells"):
        path = job.mesh + ending
        if os.path.exists(path):
            os.unlink(path)
    if "error" in shape:
        return shape
    return {key: value for key, value in shape.items() if key not in ("wall", "cpu", "peak")}


def processor():
    for line in open("/proc/cpuinfo"):
        if line.startswith("model name"):
            return f"{os.cpu_count()} cores of {line.split(':')[1].strip()}"
    return f"{os.cpu_count()} cores"


def say(text):
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
