"""Makes the inputs once, so that every program gets the same: points, a velocity model, an image's labels.

usage: inputs.py FOLDER IMAGE [BP2004]

Raw little-endian files, x fastest: points as f64, velocities as f32, labels as u8. Runs where NumPy is.
"""

import gzip
import json
import sys
from pathlib import Path

import numpy as np

COUNT = 1_000_000
# BP2004's sampling: samples and metres along x and z.
VELOCITY_SHAPE, VELOCITY_SPACING = (5395, 1911), (12.5, 6.25)
# 2 Hz at 5 points a wavelength, 1/s, and the greatest slope of sizes: atomesh's own limit.
BP_RATE, SLOPE = 10, 0.25


def jittered(points, share, seed=1):
    """Each coordinate moved by up to `share` / 2, at random."""
    return points + share * (np.random.default_rng(seed).random(points.shape) - 0.5)


def face_centred(count):
    """A crystal of unit cells with 4 sites each."""
    side = round((count / 4) ** (1 / 3))
    k = np.arange(side)
    cells = np.stack(np.meshgrid(k, k, k, indexing="ij"), -1)[..., ::-1].reshape(-1, 1, 3)
    sites = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    return (cells + sites).reshape(-1, 3)


def hexagonal(count):
    """Rows of sites 1 apart, every other row shifted by half."""
    side = round(count**0.5)
    y, x = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    return np.stack([x + 0.5 * (y % 2), y * 0.75**0.5], -1).reshape(-1, 2)


def write_points(folder):
    random = np.random.default_rng(1)
    sets = {
        "random-3": random.random((COUNT, 3)),
        "jittered-3": jittered(face_centred(COUNT), 0.1),
        "perfect-3": face_centred(COUNT),
        "random-2": random.random((COUNT, 2)),
        "jittered-2": jittered(hexagonal(COUNT), 0.1),
        "perfect-2": hexagonal(COUNT),
    }
    for name, points in sets.items():
        points.astype("<f8").tofile(folder / f"{name}.f64")


def step(x, at, width):
    """From 0 to 1 around `at`, within about `width`."""
    return 0.5 * (1 + np.tanh((x - at) / width))


def velocity():
    """Water, sediments that harden with depth, layers and a salt body: 1500 to 4500 m/s, smooth.

    Transitions are so wide that velocity / 20, the sizes asked for, changes by 0.17 a metre at most.
    """
    nx, nz = VELOCITY_SHAPE
    x = (np.arange(nx) * VELOCITY_SPACING[0])[None, :]
    z = (np.arange(nz) * VELOCITY_SPACING[1])[:, None]
    floor = 1200 + 400 * np.sin(x / 9000) + 150 * np.cos(x / 2300)
    below = np.maximum(z - floor, 0)
    v = 1500 + 200 * step(z, floor, 120) + 0.22 * below
    for layer, depth in enumerate((2500, 4200, 6100, 8300)):
        v = v + 60 * step(z, depth + 300 * np.sin(x / 7000 + layer), 90)
    for middle, deep, wide, high in ((20000, 5200, 7000, 1900), (45000, 6000, 9000, 2400)):
        bumps = 0.12 * np.sin(x / 900) + 0.08 * np.sin(z / 700)
        away = np.hypot((x - middle) / wide, (z - deep) / high) + bumps
        salt = 1 - step(away * high, high, 420)
        v = v + salt * (4500 - v)
    return np.clip(v, 1500, 4500)


def bp2004(path):
    """The BP 2004 velocity benchmark from its SEG-Y file (IBM floats), its slope limited as sizes must be.

    Read apart from atomesh, so that its reader is checked by the way. Water and salt end in jumps, which no mesh of
    good shape follows: velocities are lowered until v / RATE changes by SLOPE at most from sample to sample, also
    across corners, so that all programs get the same sizes and none has to limit them.
    """
    nx, nz = VELOCITY_SHAPE
    traces = np.fromfile(path, [("header", "V240"), ("samples", ">u4", nz)], offset=3600)
    bits = traces["samples"].T  # z, x
    fraction, exponent = bits & 0xFFFFFF, (bits >> 24 & 0x7F).astype(int)
    v = np.ldexp(fraction.astype(float), 4 * (exponent - 64) - 24)
    dx, dz = VELOCITY_SPACING
    slope = SLOPE * BP_RATE
    ramp = slope * dx * np.arange(nx)
    across = slope * np.hypot(dx, dz)

    def along(row):
        row = np.minimum.accumulate(row - ramp) + ramp
        return (np.minimum.accumulate((row + ramp)[::-1])[::-1]) - ramp

    def down(v):
        v[0] = along(v[0])
        for z in range(1, nz):
            above = v[z - 1]
            row = np.minimum(v[z], above + slope * dz)
            row[1:] = np.minimum(row[1:], above[:-1] + across)
            row[:-1] = np.minimum(row[:-1], above[1:] + across)
            v[z] = along(row)

    for _ in range(2):
        down(v)
        down(v[::-1])
    return v


def read_nifti(path):
    """The samples of a NIfTI-1 image, axes z, y, x, and its spacing; little-endian, no scaling."""
    data = gzip.open(path).read()
    shape = np.frombuffer(data, "<i2", 3, 42)
    kind = {2: "u1", 4: "<i2", 16: "<f4", 64: "<f8", 512: "<u2"}[int(np.frombuffer(data, "<i2", 1, 70)[0])]
    start = int(np.frombuffer(data, "<f4", 1, 108)[0])
    spacing = np.frombuffer(data, "<f4", 3, 80)
    return np.frombuffer(data, kind, int(shape.prod()), start).reshape(shape[::-1]), spacing


def otsu(values):
    """The threshold that parts values into the two classes of greatest variance between them (Otsu 1979)."""
    counts, edges = np.histogram(values, 256)
    middles = 0.5 * (edges[1:] + edges[:-1])
    below, total = np.cumsum(counts), np.cumsum(counts * middles)
    above = below[-1] - below
    with np.errstate(invalid="ignore", divide="ignore"):
        between = below * above * (total / below - (total[-1] - total) / above) ** 2
    return middles[np.nanargmax(between[:-1])]


def main():
    folder, image = Path(sys.argv[1]), sys.argv[2]
    write_points(folder)
    velocity().astype("<f4").tofile(folder / "velocity.f32")
    if len(sys.argv) > 3:
        bp2004(sys.argv[3]).astype("<f4").tofile(folder / "bp2004.f32")
    samples, spacing = read_nifti(image)
    labels = (samples > otsu(samples)).astype("u1")
    labels.tofile(folder / "labels.u8")
    about = {"shape": labels.shape[::-1], "spacing": [float(s) for s in spacing], "inside": float(labels.mean())}
    (folder / "labels.json").write_text(json.dumps(about))


if __name__ == "__main__":
    main()
