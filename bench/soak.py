#!/usr/bin/env python3
"""Random images and options, each mesh judged by a checker that shares no code with atomesh.

    python3 bench/soak.py ATOMESH [--runs 1000] [--first 0] [--jobs 2] [--keep FOLDER]

Run k draws an image and options from seed k alone, so that a failure is had again by `--first k --runs 1 --keep FOLDER`.
Each run ends in one of:

- a valid mesh: exit 0; finite points, all of them used and none twice; cells that are neither flat nor inverted; facets of one
  cell on the sides of the box alone, all others of two; cells that fill the box; no angle below the floor, unless the
  command warns of it;
- a refusal: exit 1 or 2, a message that begins with `error: `, and no output.

Everything else is a failure: another exit code, a signal, a panic, a timeout, memory beyond twice the forecast, other bytes
with another number of threads. Needs NumPy, and meshio for Voronoi cells. Exit code 1 if a run failed.
"""
import argparse
import collections
import hashlib
import multiprocessing
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SECONDS = 120  # of wall time, for images of at most some 10,000 samples
BASE = 100e6  # bytes that a run may take whatever its forecast is


def draw(rng):
    """An image, x last, and its dimension."""
    dimension = 2 if rng.random() < 0.55 else 3
    most = 90 if dimension == 2 else 24
    shape = [int(rng.integers(1 if rng.random() < 0.03 else 2, most)) for _ in range(dimension)]
    if rng.random() < 0.15:  # thin
        shape[int(rng.integers(dimension))] = int(rng.integers(2, 5))
    if dimension == 3 and shape[-1] in (3, 4):
        shape[-1] = 5  # three or four samples along x are taken for colours, with a warning
    places = np.meshgrid(*[np.arange(n, dtype=float) for n in shape], indexing="ij")
    kind = rng.choice(["constant", "noise", "line", "lines", "ball", "step", "grains", "ramp", "spikes"])
    values = np.zeros(shape)

    def line():
        normal = rng.normal(size=dimension)
        normal /= np.linalg.norm(normal)
        middle = [rng.uniform(0, n) for n in shape]
        off = sum(n * (p - m) for n, p, m in zip(normal, places, middle))
        return np.exp(-0.5 * (off / rng.uniform(0.5, 3)) ** 2), off

    if kind == "noise":
        values = rng.normal(size=shape)
    elif kind in ("line", "lines"):
        for _ in range(1 if kind == "line" else int(rng.integers(2, 6))):
            values = np.minimum(values, -line()[0])
    elif kind == "ball":
        middle = [rng.uniform(0, n) for n in shape]
        radius = rng.uniform(0.1, 0.6) * max(shape)
        values = (sum((p - m) ** 2 for p, m in zip(places, middle)) < radius**2).astype(float)
    elif kind == "step":
        values = (line()[1] > 0).astype(float)
    elif kind == "grains":
        middles = rng.uniform(0, 1, size=(int(rng.integers(2, 12)), dimension)) * shape
        far = [sum((p - m) ** 2 for p, m in zip(places, middle)) for middle in middles]
        values = np.argmin(far, axis=0).astype(float)
    elif kind == "ramp":
        values = sum(rng.normal() * p for p in places)
    elif kind == "spikes":
        values.reshape(-1)[rng.integers(0, values.size, size=3)] = rng.choice([-1, 1])
    if rng.random() < 0.4:
        values = values + rng.uniform(0, 0.2) * rng.normal(size=shape)
    return values, dimension, kind


def typed(values, rng):
    """The image as some type of samples, now and then with extreme or missing values."""
    name = rng.choice(["uint8", "int16", "float32", "float64", "uint16"])
    low, high = values.min(), values.max()
    unit = (values - low) / (high - low) if high > low else np.zeros(values.shape)
    if name.startswith("float"):
        scale = 10.0 ** rng.uniform(-30, 30) if rng.random() < 0.1 else 1.0
        made = (unit * scale - rng.choice([0, 0.5]) * scale).astype(name)
        if rng.random() < 0.03:
            made.reshape(-1)[int(rng.integers(made.size))] = rng.choice([np.nan, np.inf])
        return made
    if name == "uint8":
        return (unit * 255).astype(name)
    return (unit * rng.choice([1, 300, 30000])).astype(name)


def number(rng, low, high):
    """A number as people type it."""
    return f"{rng.uniform(low, high):.{int(rng.integers(0, 4))}f}"


def options(rng, shape, dimension, folder, kind):
    """Options of one run; `shape` is x first."""
    given = []

    def add(name, value):
        given.extend([f"--{name}", str(value)])

    physical = rng.random() < 0.4
    spacing = [1.0] * dimension
    origin = [0.0] * dimension
    if physical:
        scale = 10.0 ** (rng.uniform(-6, 6) if rng.random() < 0.2 else rng.uniform(-1, 1))
        spacing = [float(f"{scale * rng.choice([1, 1, 0.5, 2, 3, 7.3]):.3g}") for _ in range(dimension)]
        add("spacing", ",".join(f"{s!r}" for s in spacing))
        if rng.random() < 0.5:
            origin = [float(f"{rng.uniform(-1e3, 1e3) * scale:.4g}") for _ in range(dimension)]
            add("origin", ",".join(f"{o!r}" for o in origin))
    in_samples = physical and rng.random() < 0.3
    if in_samples:
        add("units", "samples")
    step = 1.0 if in_samples else min(spacing)
    extent = [(n - 1) * (1.0 if in_samples else s) for n, s in zip(shape, spacing)]
    largest = max(max(extent), step)
    size = 1.0
    if rng.random() < 0.85:
        size = step * 10.0 ** rng.uniform(np.log10(1.2 if rng.random() < 0.9 else 0.4), np.log10(max(3.0, largest / step / 2)))
        least = (np.prod([max(e, step) for e in extent]) / 4000) ** (1 / dimension)
        size = max(size, least)  # some thousand atoms at most
        if rng.random() < 0.25:
            add("size", f"{size:.4g}..{size * rng.uniform(1, 4):.4g}")
            if rng.random() < 0.3:
                add("grade-by", rng.choice(["density", "curvature", "distance"]))
        else:
            add("size", f"{size:.4g}")
    elif rng.random() < 0.05:
        add("size", rng.choice(["0", "-3", "nan", "1e300", "8..4", "x"]))
    if rng.random() < 0.7:
        add("features", rng.choice(["dark", "bright", "edges", "edges", "ridges", "none", "faults", "horizons", "dark,edges:0.5"]))
    voronoi = rng.random() < 0.2
    if voronoi:
        add("mesh", "voronoi")
    if rng.random() < 0.15:
        add("beta", number(rng, 0, 1))
    if rng.random() < 0.15:
        add("lattice", rng.choice(["hexagonal", "random"] if dimension == 2 else ["bcc", "fcc", "random"]))
    if rng.random() < 0.1:
        add("spacing-factor", number(rng, 0.1, 1))
    for _ in range(int(rng.choice([0, 0, 0, 1, 2, 3]))):
        if rng.random() < 0.6:  # a side, an edge or a corner, typed in decimals
            place = [rng.choice([0.0, 1.0]) if rng.random() < 0.6 else rng.uniform() for _ in range(dimension)]
        else:
            place = rng.uniform(0, 1, size=dimension)
        world = [o + p * (n - 1) * s for o, p, n, s in zip(origin, place, shape, spacing)]
        add("seed-point", ",".join(f"{w:.{int(rng.integers(3, 18))}g}" for w in world))
    if rng.random() < 0.1:
        add("engine", "sampled")
    if rng.random() < 0.1:
        add("interpolation", rng.choice(["nearest", "linear", "spline"]))
    if rng.random() < 0.3:
        add("align", rng.choice(["off", "swaps", "full", "conform"]))
    if rng.random() < 0.1:
        add("min-angle", number(rng, 0, 40))
    if rng.random() < 0.08:
        add("smooth", number(rng, 0, 3 * step))
    if rng.random() < 0.05:
        add("denoise", "0.4") if rng.random() < 0.5 else given.append("--denoise")
        if given[-1] == "0.4":
            given[-2:] = ["--denoise=0.4"]
    if rng.random() < 0.05:
        given.append("--repel")
    if rng.random() < 0.2:
        add("seed", int(rng.integers(0, 1000)))
    masked = rng.random() < 0.12 and not voronoi
    if masked:
        inside = sum((np.arange(n) - n * rng.uniform(0.3, 0.7)).reshape([-1 if k == i else 1 for i in range(dimension)]) ** 2
                     for k, n in enumerate(shape[::-1]))
        np.save(folder / "mask.npy", (inside < (rng.uniform(0.2, 0.9) * max(shape)) ** 2).astype("uint8"))
        add("mask", "mask.npy")
    if rng.random() < 0.12 and not voronoi:
        middles = rng.uniform(0, 1, size=(4, dimension)) * shape[::-1]
        places = np.meshgrid(*[np.arange(n) for n in shape[::-1]], indexing="ij")
        far = [sum((p - m) ** 2 for p, m in zip(places, middle)) for middle in middles]
        np.save(folder / "labels.npy", np.argmin(far, axis=0).astype("int32"))
        add("labels", "labels.npy")
        if rng.random() < 0.3:
            add("least-island", int(rng.integers(1, 20)))
    second = not voronoi and rng.random() < 0.1
    if second:
        add("order", 2)
    box = [[o, o + (n - 1) * s] for o, n, s in zip(origin, shape, spacing)]
    scale = [1 / s if in_samples else 1.0 for s in spacing]
    output = "m.vtu" if voronoi or second or rng.random() < 0.1 else "m.npz"
    return given, output, box, masked, scale


def simplices(path):
    """Points and cells of what was written."""
    if path.suffix == ".npz":
        with np.load(path) as arrays:
            return arrays["points"], arrays["cells"].astype(np.int64)
    import meshio

    mesh = meshio.read(path)
    corners = {"triangle": 3, "tetra": 4, "triangle6": 3, "tetra10": 4}
    cells = [block.data[:, : corners[block.type]] for block in mesh.cells if block.type in corners]
    cells = np.concatenate(cells).astype(np.int64)
    used = np.unique(cells)
    return mesh.points[used], np.searchsorted(used, cells)


def judge_simplices(path, box, masked, floor, scale, warned):
    """What is wrong with a mesh of triangles or tetrahedra."""
    points, cells = simplices(path)
    dimension = len(box)
    if cells.shape[1] != dimension + 1 or len(cells) == 0:
        return f"{len(cells)} cells of {cells.shape[1]} corners"
    points = points[:, :dimension]
    if not np.isfinite(points).all():
        return "a point is not finite"
    if len(np.unique(cells)) != len(points):
        return "points without a cell"
    if len(np.unique(points, axis=0)) != len(points):
        return "two points are one"
    low, high = np.array(box).T
    extent = high - low
    unit = (points - low) / extent
    edges = unit[cells[:, 1:]] - unit[cells[:, :1]]
    measure = np.linalg.det(edges) / (2 if dimension == 2 else 6)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    if not (measure > 1e-12 * longest**dimension).all():
        return f"{(measure <= 1e-12 * longest ** dimension).sum()} cells are flat or inverted"
    facets = np.sort(np.concatenate([np.delete(cells, k, axis=1) for k in range(dimension + 1)]), axis=1)
    facets, counts = np.unique(facets, axis=0, return_counts=True)
    if counts.max() > 2:
        return f"a facet has {counts.max()} cells"
    if not masked:
        if abs(measure.sum() - 1) > 1e-9:
            return f"cells fill {measure.sum()} of the box"
        outer = unit[facets[counts == 1]]
        on_side = np.zeros(len(outer), bool)
        for side in (0.0, 1.0):
            on_side |= (np.abs(outer - side) < 1e-9).all(axis=1).any(axis=1)
        if not on_side.all():
            return f"{(~on_side).sum()} facets of one cell lie within the box"
    angles = least_angles(points * scale, cells)
    if angles.min() < floor - 0.01 and not warned:
        return f"angle {angles.min():.2f} below {floor} unsaid"
    return None


def least_angles(points, cells):
    """The least interior or dihedral angle of each cell, in degrees."""
    corners = points[cells]
    if cells.shape[1] == 3:
        sides = [corners[:, (k + 2) % 3] - corners[:, (k + 1) % 3] for k in range(3)]
        length = [np.linalg.norm(side, axis=1) for side in sides]
        cosines = [-(sides[k] * sides[(k + 1) % 3]).sum(axis=1) / length[k] / length[(k + 1) % 3] for k in range(3)]
    else:
        normals = []
        for k in range(4):
            a, b, c = (corners[:, i] for i in range(4) if i != k)
            normal = np.cross(b - a, c - a)
            inward = ((corners[:, k] - a) * normal).sum(axis=1)
            normal *= np.sign(inward)[:, None] / np.linalg.norm(normal, axis=1)[:, None]
            normals.append(normal)
        cosines = [-(normals[i] * normals[j]).sum(axis=1) for i in range(4) for j in range(i)]
    return np.degrees(np.arccos(np.clip(np.max(cosines, axis=0), -1, 1)))


def judge_voronoi(path, box):
    """What is wrong with a mesh of polygons; of polyhedra the points alone are looked at, and each side of each face."""
    import meshio

    mesh = meshio.read(path)
    low, high = np.array(box).T
    unit = (mesh.points[:, : len(box)] - low) / (high - low)
    if not np.isfinite(unit).all() or (unit < -1e-9).any() or (unit > 1 + 1e-9).any():
        return "points outside of the box"
    total = 0.0
    for block in mesh.cells:
        for cell in block.data:
            if len(box) == 2:
                x, y = unit[np.asarray(cell)].T
                area = 0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum()
                if not area > 0:
                    return f"a polygon of area {area}"
                total += area
            else:
                inner = unit[np.unique(np.concatenate([np.asarray(face) for face in cell]))].mean(axis=0)
                for face in cell:
                    corners = unit[np.asarray(face)] - inner
                    for a, b in zip(corners[1:-1], corners[2:]):
                        total += abs(np.linalg.det([corners[0], a, b])) / 6
    if abs(total - 1) > 1e-8:
        return f"cells fill {total} of the box"
    return None


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def run(task):
    """Run `seed` of the soak: its outcome, what was wrong, and the command."""
    binary, seed, keep = task
    rng = np.random.default_rng(seed)
    folder = Path(keep) if keep else Path(tempfile.mkdtemp(prefix="soak-"))
    folder.mkdir(exist_ok=True)
    try:
        values, dimension, kind = draw(rng)
        shape = list(values.shape[::-1])
        np.save(folder / "in.npy", typed(values, rng))
        given, output, box, masked, scale = options(rng, shape, dimension, folder, kind)
        command = [binary, "mesh", "in.npy", "-o", output, "--threads", "1", *given]
        text = " ".join(command[1:])
        code, words, peak, seconds = execute(command, folder)
        outcome, wrong = classify(code, words, folder / output)
        if wrong is None and outcome == "mesh":
            floor = floor_of(given, dimension)
            warned = "stay below the least angle" in words
            if "voronoi" in given:
                wrong = judge_voronoi(folder / output, box)
            else:
                wrong = judge_simplices(folder / output, box, masked, floor, np.array(scale), warned)
            outcome = "floor not held" if wrong is None and warned else outcome
            if wrong is None and seed % 10 == 0:
                # a child's peak begins with what its parent held when it was forked
                own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
                wrong = repeat(command, folder, output) or forecast(command, folder, max(0, peak - own))
        return seed, outcome, wrong, text, peak, seconds
    except Exception as error:  # of the checker: a failure too
        return seed, "checker", repr(error), " ".join(map(str, given)) if "given" in locals() else "", 0, 0.0
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)


def floor_of(given, dimension):
    """The least angle that cells are to keep."""
    if "--align" in given and given[given.index("--align") + 1] == "off":
        return 0.0
    default = 20.0 if dimension == 2 else 15.0
    return float(given[given.index("--min-angle") + 1]) if "--min-angle" in given else default


def execute(command, folder):
    """Exit code, words, peak memory in bytes and wall time."""
    started = time.monotonic()
    with open(folder / "words", "wb") as words:
        child = subprocess.Popen(command, cwd=folder, stdout=words, stderr=words,
                                 preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (2 * SECONDS, 2 * SECONDS)))
        while True:
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
            if pid:
                break
            if time.monotonic() - started > SECONDS:
                child.kill()
                os.wait4(child.pid, 0)
                return "timeout", "", 0, SECONDS
            time.sleep(0.002)
        child.returncode = os.waitstatus_to_exitcode(status)
    words = (folder / "words").read_text(errors="replace")
    return child.returncode, words, usage.ru_maxrss * 1024, time.monotonic() - started


def classify(code, words, output):
    """What a run ended in, and what is wrong with that."""
    if "panicked" in words:
        return "panic", words.strip()[-300:]
    if code == 0:
        return "mesh", None if output.exists() else "no output"
    if code not in (1, 2):
        return f"exit {code}", words.strip()[-300:]
    errors = [line for line in words.splitlines() if line.startswith("error: ")]
    if not errors:
        return "refusal", "no message: " + words.strip()[-300:]
    if output.exists():
        return "refusal", "an output in spite of it"
    kind = re.sub(r"[-+]?\d[\d.e+-]*", "#", errors[0][len("error: "):])
    return f"refused ({code}): {re.sub(r'^[^ ]*: ', '', kind)[:90]}", None


def repeat(command, folder, output):
    """Whether another number of threads gives other bytes."""
    before = digest(folder / output)
    again = [("2" if word == "1" and command[i - 1] == "--threads" else word) for i, word in enumerate(command)]
    subprocess.run(again, cwd=folder, capture_output=True, timeout=SECONDS)
    return None if digest(folder / output) == before else "other bytes with 2 threads"


def forecast(command, folder, peak):
    """Whether much more memory was taken than was forecast."""
    told = subprocess.run([*command, "--dry-run"], cwd=folder, capture_output=True, text=True, timeout=SECONDS)
    found = re.search(r"memory about ([\d.]+) ([MG])iB", told.stdout)
    if not found:
        return f"no forecast: {told.stderr.strip()[-200:]}"
    expected = float(found[1]) * (2**20 if found[2] == "M" else 2**30)
    return f"{peak / 1e6:.0f} MB for {expected / 1e6:.0f}" if peak > 2 * expected + BASE else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binary")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--keep", help="folder that keeps the files of the last run")
    args = parser.parse_args()
    binary = str(Path(args.binary).resolve())
    tasks = ((binary, seed, args.keep) for seed in range(args.first, args.first + args.runs))
    outcomes, firsts, failures, most = collections.Counter(), {}, [], (0, 0)
    with multiprocessing.Pool(args.jobs) as pool:
        for seed, outcome, wrong, text, peak, seconds in pool.imap_unordered(run, tasks, chunksize=4):
            outcome_said = outcome if wrong is None else "FAILED"
            outcomes[outcome_said] += 1
            firsts[outcome_said] = min(seed, firsts.get(outcome_said, seed))
            most = max(most, (peak, seed))
            if wrong is not None:
                failures.append(seed)
                print(f"{seed}: {outcome}: {wrong}\n    {text}", flush=True)
    for outcome, count in sorted(outcomes.items(), key=lambda pair: -pair[1]):
        print(f"{count:7} {outcome} (as run {firsts[outcome]})")
    print(f"most memory {most[0] / 1e6:.0f} MB, run {most[1]}")
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
