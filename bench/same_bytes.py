#!/usr/bin/env python3
"""Whether two builds of atomesh write the same bytes: SHA-256 of every file of some fifty runs.

    python3 bench/same_bytes.py OLD NEW            compare two binaries
    python3 bench/same_bytes.py --record F OLD     keep the digests of one
    python3 bench/same_bytes.py --against F NEW    compare another with what was kept

Every run is made at 1 and at 2 threads, on images that the program draws itself, and on real ones where
ATOMESH_DATA names their folder. For changes that must not change results. Exit code 1 if anything differs.
"""
import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# drawn first, by the old binary alone where two are compared
IMAGES = [
    "synth faults -o faults.png --shape 128,112",
    "synth disc -o disc.npy --shape 72,64 --noise 0.05",
    "synth grains -o grains.png --shape 96,96 --noise 0.05",
    "synth section -o section.npy --shape 150,130 --noise 0.1",
    "synth slit -o slit.png --shape 64,48",
    "synth sphere -o ball.nii.gz --shape 36,34,30 --noise 0.1 --spacing 1,1,1.5",
    "synth layers-faults -o volume.npy --shape 44,44,44",
    "synth layers -o layers.nii.gz --shape 48,48,48 --noise 0.1",
]

# name: commands, one after the other in one folder
RUNS = {
    # the plane
    "plane": ["mesh faults.png -o a.vtu --size 8"],
    "plane-sampled": ["mesh faults.png -o a.npz --size 8 --engine sampled"],
    "plane-nearest": ["mesh faults.png -o a.npz --size 8 --interpolation nearest --align off"],
    "plane-linear": ["mesh faults.png -o a.npz --size 8 --interpolation linear --align swaps"],
    "plane-random": ["mesh faults.png -o a.msh --size 8 --lattice random --seed 3"],
    "plane-graded": ["mesh faults.png -o a.vtu --size 5..14"],
    "plane-curvature": ["mesh faults.png -o a.npz --size 5..14 --grade-by curvature"],
    "plane-distance": ["mesh faults.png -o a.npz --size 5..14 --grade-by distance --beta 0.2"],
    "plane-order-2": ["mesh disc.npy -o a.vtu --size 6 --features edges --order 2"],
    "plane-wells": ["mesh faults.png -o a.vtk --size 8 --seed-point 30,40 --seed-point 90.5,71.25"],
    "plane-regular": ["mesh faults.png -o a.inp --size 8 --beta 0"],
    "plane-regular-graded": ["mesh faults.png -o a.npz --size 5..14 --beta 0"],
    "plane-tags": ["mesh faults.png -o a.msh --size 7 --tag-features -0.3 --regions --least-island 4"],
    "plane-frame": [
        "mesh faults.png -o a.vtu --size 20 --spacing 2,3 --origin 100,-50 --direction 0,1,1,0 --crop 130..300,-20..150"
    ],
    "plane-samples": ["mesh faults.png -o a.vtu --size 8 --spacing 2,3 --units samples"],
    "plane-frequency": ["mesh disc.npy -o a.npz --features none --frequency 0.02 --points-per-wavelength 4"],
    "plane-potential": [
        "enhance faults.png -o b.npy --as dark",
        "mesh --potential b.npy -o a.vtu --size 8 --write-potential c.npy",
    ],
    "plane-fields": [
        "enhance faults.png -o b.npy --as bright --smooth 9",
        "mesh faults.png -o a.vtu --beta-field w.npy --size-field d.npy",
    ],
    "plane-mask": ["mesh disc.npy -o a.vtu --size 5 --mask m.npy --features edges"],
    "plane-mask-order-2": ["mesh disc.npy -o a.inp --size 5 --mask m.npy --order 2 --features none"],
    "plane-labels": ["mesh --labels l.npy -o a.msh --size 5 --least-island 3"],
    "plane-labels-mask": ["mesh disc.npy --features labels --labels l.npy --mask m.npy -o a.vtu --size 5"],
    "plane-voronoi": ["mesh faults.png -o a.vtu --size 8 --mesh voronoi --connections a.json --picture a.png"],
    "plane-voronoi-foam": ["mesh slit.png -o polyMesh --size 6 --mesh voronoi"],
    "plane-voronoi-plain": ["mesh faults.png -o a.vtu --size 8 --mesh voronoi --mirror=false"],
    "plane-pictures": ["mesh faults.png -o a.vtk --size 8 --picture a.svg --picture-of distance"],
    # each kind of features
    "bright": ["mesh faults.png -o a.npz --size 8 --features bright"],
    "edges": ["mesh grains.png -o a.npz --size 6 --features edges --write-potential b.npy"],
    "prewitt": ["mesh grains.png -o a.npz --size 6 --features edges --edge-operator prewitt"],
    "edge-crests": ["mesh grains.png -o a.npz --size 6 --features edges --edge-operator crest --write-potential b.npy"],
    "ridges": ["mesh faults.png -o a.npz --size 8 --features ridges --polarity dark --write-potential b.npy"],
    "faults": ["mesh section.npy -o a.vtu --size 6 --features faults --write-potential b.npy --picture a.png"],
    "horizons": ["mesh section.npy -o a.npz --size 6 --features horizons --write-potential b.npy"],
    "mixture": ["mesh section.npy -o a.npz --size 6 --features faults,horizons:0.5 --denoise"],
    "labels": ["mesh --labels l.npy -o a.npz --size 6 --features labels"],
    "repel": ["mesh faults.png -o a.npz --size 8 --repel"],
    # space
    "space": ["mesh ball.nii.gz -o a.vtu --size 4 --features edges"],
    "space-fcc": ["mesh ball.nii.gz -o a.npz --size 4 --features edges --lattice fcc --align swaps"],
    "space-random": ["mesh volume.npy -o a.msh --size 6 --lattice random"],
    "space-graded": ["mesh volume.npy -o a.vtu --size 4..9 --tag-features -0.3"],
    "space-sampled": ["mesh volume.npy -o a.npz --size 6 --engine sampled --align off"],
    "space-spline": ["mesh volume.npy -o a.npz --size 6 --interpolation spline --smoothing-steps 1"],
    "space-mask": ["mesh ball.nii.gz -o a.inp --size 5 --mask ball-mask.nii.gz --features none --order 2"],
    "space-voronoi": ["mesh volume.npy -o a.vtu --size 7 --mesh voronoi --connections a.json"],
    "space-foam": ["mesh volume.npy -o polyMesh --size 7"],
    "space-faults": ["mesh layers.nii.gz -o a.vtu --size 7 --features faults --picture a.png"],
    "space-horizons": ["enhance layers.nii.gz -o b.nii.gz --as horizons:0.5,ridges --denoise"],
    # after the mesh
    "features": [
        "mesh faults.png -o m.vtu --size 7",
        "features m.vtu faults.png --below -0.3 -o f.obj --mesh-output t.msh --json f.json --regions --least-island 4",
        "features m.vtu faults.png -o g.vtp --close-gaps",
    ],
    "features-space": [
        "mesh volume.npy -o m.vtu --size 6",
        "features m.vtu volume.npy -o f.stl --mesh-output t.vtu --json f.json",
    ],
    "sample": [
        "mesh faults.png -o m.npz --size 7",
        "sample m.npz --image a=faults.png --image b=faults.png --statistic mean -o s.vtu",
        "sample m.npz --image a=faults.png --statistic majority -o t.vtu",
    ],
    "sample-space": [
        "mesh volume.npy -o m.npz --size 6",
        "sample m.npz --image a=volume.npy --statistic harmonic --statistic total -o s.vtu",
    ],
    "flow": [
        "flow faults.png --size 7 --source 8,8 --sink 110,100 --multiplier 0.1 -o a.vtu --picture a.png --streamlines l.vtp --fluxes f.json"
    ],
    "flow-order-1": [
        "mesh faults.png -o m.msh --size 6 --tag-features -0.3",
        "sample m.msh --image k=faults.png -o r.vtu",
        "flow r.vtu --permeability k --side xmin=pressure:1 --side xmax=pressure:0 -o a.vtu --order 1",
    ],
    "flow-voronoi": [
        "flow faults.png --mesh voronoi --size 7 --source 8,8:pressure=2:radius=0.1 --sink 110,100:rate=1 --multiplier 0.01 -o a.vtu --picture a.png"
    ],
    "flow-space": [
        "flow volume.npy --size 7 --source 6,6,6 --sink 38,38,38 --multiplier 0.01 --order 1 --picture a.png -o a.vtu"
    ],
    "export": [
        "mesh slit.png -o c.vtu --mesh voronoi --size 6 --connections c.json",
        "export c.vtu -o e.json --permeability 2.5",
        "export c.json -o e.disv --permeability 3 --thickness 10",
    ],
    "export-space": [
        "mesh volume.npy -o c.vtu --mesh voronoi --size 9 --connections c.json",
        "export c.json -o e.disu",
    ],
}
REAL = {
    "real-fig1": ["mesh {data}/hale2001-fig1-faults.png -o a.vtu --size 8"],
    "real-torso": ["mesh {data}/hale2001-fig11-torso.png -o a.vtu --size 8 --features edges"],
    "real-f3": ["mesh {data}/f3-fault-likelihood.npy -o a.vtu --size 6 --features bright"],
    "real-mni": ["mesh {data}/mni152-t1.nii.gz -o a.vtu --size 6 --features edges"],
}


def call(binary, folder, arguments):
    done = subprocess.run([binary, *arguments.split()], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{binary} {arguments}: exit {done.returncode}\n{done.stderr}")
    return done.stdout


def draw(binary, folder):
    """Images that all runs share, and fields made of plain numbers."""
    for arguments in IMAGES:
        call(binary, folder, arguments + " -q")
    plain(folder / "m.npy", (64, 72), lambda y, x: (x - 36) ** 2 + (y - 32) ** 2 < 26**2)
    plain(folder / "l.npy", (64, 72), lambda y, x: 1 + (x > 30) + 2 * (y > 25 + x / 8))
    plain(folder / "w.npy", (112, 128), lambda y, x: x / 160, "f")
    plain(folder / "d.npy", (112, 128), lambda y, x: 6 + y / 16, "f")
    plain(folder / "b.npy", (112, 128), lambda y, x: -1 / (1 + 0.1 * (x - 60 - y / 7) ** 2), "f")
    raw = plain(None, (30, 34, 36), lambda z, y, x: (x - 17) ** 2 + (y - 17) ** 2 + (1.5 * (z - 14)) ** 2 < 200)
    nifti(folder / "ball-mask.nii.gz", (36, 34, 30), (1, 1, 1.5), raw)


def plain(path, shape, value, kind="u"):
    import itertools
    import struct

    flat = [value(*index) for index in itertools.product(*map(range, shape))]
    code, pack = ("|u1", "B") if kind == "u" else ("<f4", "f")
    data = struct.pack(f"<{len(flat)}{pack}", *[int(v) if kind == "u" else float(v) for v in flat])
    if path is None:
        return data
    text = f"{{'descr': '{code}', 'fortran_order': False, 'shape': {shape}, }}"
    text += " " * (-(10 + len(text) + 1) % 64) + "\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode() + data)


def nifti(path, shape, steps, data):
    import gzip
    import struct

    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *shape, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 2, 8)
    struct.pack_into("<8f", head, 76, 1, *steps, 0, 0, 0, 0)
    struct.pack_into("<f", head, 108, 352)
    struct.pack_into("<2h", head, 252, 0, 1)
    for row in range(3):
        line = [0.0] * 4
        line[row] = steps[row]
        struct.pack_into("<4f", head, 280 + 16 * row, *line)
    head[344:348] = b"n+1\0"
    path.write_bytes(gzip.compress(bytes(head) + data, mtime=0))


def digests(binary, images, runs, threads):
    """The digest of every file that a run makes, by run, threads and file."""
    found = {}

    def one(name):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            for image in images.iterdir():
                (folder / image.name).symlink_to(image)
            for arguments in runs[name]:
                data = os.environ.get("ATOMESH_DATA", "")
                call(binary, folder, f"{arguments.format(data=data)} -q --threads {threads}")
            for made in sorted(p for p in folder.rglob("*") if p.is_file() and not p.is_symlink()):
                found[f"{name} ({threads}): {made.relative_to(folder)}"] = hashlib.sha256(made.read_bytes()).hexdigest()

    with ThreadPoolExecutor(2 if threads == 1 else 1) as pool:
        tries = {name: pool.submit(one, name) for name in runs}
    for name, run in tries.items():
        if run.exception():
            found[f"{name} ({threads}): {run.exception()}"] = "failed"
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binaries", nargs="+")
    parser.add_argument("--record", metavar="FILE")
    parser.add_argument("--against", metavar="FILE")
    parser.add_argument("--only", default="", help="runs whose names start so")
    parser.add_argument("--threads", type=int, nargs="*", default=[1, 2])
    options = parser.parse_args()
    binaries = [str(Path(b).resolve()) for b in options.binaries]
    runs = {**RUNS, **(REAL if os.environ.get("ATOMESH_DATA") else {})}
    runs = {name: run for name, run in runs.items() if name.startswith(options.only)}
    with tempfile.TemporaryDirectory() as images:
        images = Path(images)
        draw(binaries[0], images)
        of = lambda b: {k: v for t in options.threads for k, v in digests(b, images, runs, t).items()}
        tables = [of(b) for b in binaries]
    if options.record:
        Path(options.record).write_text(json.dumps(tables[0], indent=1))
        print(f"{len(tables[0])} files of {len(runs)} runs recorded")
        return 0
    old = json.loads(Path(options.against).read_text()) if options.against else tables[0]
    names = {name for name in old if name.split(" ")[0] in runs and int(name.split("(")[1].split(")")[0]) in options.threads}
    new = tables[-1]
    off = sorted(n for n in names | set(new) if old.get(n) != new.get(n))
    print("\n".join(f"differs: {n}" for n in off))
    print(f"{len(names) - len(set(off) & names)} of {len(names)} files of {len(runs)} runs are the same")
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main())
