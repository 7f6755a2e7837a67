"""Meshes of several kinds, made by the command, and what is true of each."""

import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np


@dataclass
class Truth:
    """What every reader must find: cells by their centroids, with measures and values, and groups by name."""

    dimension: int
    centroids: np.ndarray
    measures: np.ndarray
    values: np.ndarray | None = None
    names: set[str] = field(default_factory=set)

    def check(self, what, centroids, measures, values=None, names=None):
        """Ends the program unless a reader found the same."""
        own, other = order(self.centroids), order(centroids)
        compare(what, "cells", len(self.measures), len(measures))
        scale = np.abs(self.centroids).max()
        near(what, "centroids", self.centroids[own], centroids[other][:, : self.dimension], scale)
        near(what, "measures", self.measures[own], measures[other], self.measures.max())
        if self.values is not None:
            compare(what, "values", len(self.values), -1 if values is None else len(values))
            near(what, "values", self.values[own], values[other], np.abs(self.values).max())
        if names is not None:
            # how many features a mesh has is not known beforehand
            found = {name for name in names if not re.fullmatch(r"feature-\d+", name)}
            compare(what, "names", sorted(self.names), sorted(found))


def order(centroids):
    """The cells by centroid, whatever order a file has them in; rounded, as readers add in orders of their own."""
    return np.lexsort(np.round(centroids[:, ::-1], 6).T)


def compare(what, name, expected, found):
    if expected != found:
        raise SystemExit(f"{what}: {name} {found}; expected {expected}")


def near(what, name, expected, found, scale):
    # single precision where a file keeps it: 2^-23 of the greatest
    worst = np.abs(expected - found).max()
    if not worst <= 1.2e-7 * scale:
        raise SystemExit(f"{what}: {name} are off by {worst}")


def simplex_measures(points, cells):
    """Areas or volumes of triangles or tetrahedra by their corners."""
    dimension = cells.shape[1] - 1
    edges = points[cells[:, 1:], :dimension] - points[cells[:, :1], :dimension]
    return np.abs(np.linalg.det(edges)) / [1, 1, 2, 6][dimension]


class Maker:
    """Runs the command in a folder of its own."""

    def __init__(self, binary, folder):
        self.binary, self.folder = Path(binary).resolve(), Path(folder)

    def run(self, line):
        subprocess.run([self.binary, *line.split(), "-q"], cwd=self.folder, check=True)

    def images(self):
        """A flat image and a volume, each with labels of three parts."""
        for name, shape in [("flat", (60, 80)), ("solid", (20, 22, 24))]:
            axes = np.indices(shape)
            labels = 1 + (axes[-1] > shape[-1] * 0.4) + (axes[0] > shape[0] * 0.6)
            wave = np.sin(axes[-1] / 5.0) + axes[0] / 10.0
            np.save(self.folder / f"{name}-labels.npy", labels.astype(np.uint8))
            np.save(self.folder / f"{name}.npy", wave.astype(np.float32))

    def truth(self, name, groups):
        """That of an NPZ file, which NumPy reads."""
        with np.load(self.folder / f"{name}.npz") as arrays:
            points, cells = arrays["points"], arrays["cells"]
            values = arrays["cell.v"] if "cell.v" in arrays else None
        measures = simplex_measures(points, cells)
        return Truth(cells.shape[1] - 1, points[cells].mean(axis=1), measures, values, groups)


SIDES = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"]


def simplices(maker):
    """Triangles and tetrahedra with regions, interfaces, sides and values in cells: name, files, truth."""
    for name, size, axes in [("flat", 7, 2), ("solid", 5, 3)]:
        options = f"--labels {name}-labels.npy --features labels --size {size}"
        maker.run(f"mesh {name}.npy -o {name}.vtu {options}")
        for ending in ["npz", "vtu", "vtk", "msh", "msh2"]:
            maker.run(f"sample {name}.vtu --image v={name}.npy -o {name}-v.{ending}")
        regions = {f"region-{label}" for label in (1, 2, 3)}
        interfaces = {"interface-1-2", "interface-2-3"}
        yield f"{name}-v", maker.truth(f"{name}-v", {*SIDES[: 2 * axes], *regions, *interfaces})


def quadratic(maker):
    """Cells of second order: name and truth."""
    for name, size, axes in [("flat", 7, 2), ("solid", 5, 3)]:
        options = f"{name}.npy --size {size} --features none"
        maker.run(f"mesh {options} -o {name}-2.npz")
        for ending in ["vtu", "msh", "msh2", "inp"]:
            maker.run(f"mesh {options} -o {name}-2.{ending} --order 2")
        yield f"{name}-2", maker.truth(f"{name}-2", {*SIDES[: 2 * axes], "domain"})


def voronoi(maker):
    """Polygons and polyhedra with values, in VTU and OpenFOAM's folder: name and number of cells."""
    for name, size in [("flat", 8), ("solid", 6)]:
        cells = f"{name}-cells"
        maker.run(f"mesh {name}.npy -o {cells}.vtu --mesh voronoi --size {size} --connections {cells}.json")
        maker.run(f"sample {cells}.vtu --image v={name}.npy -o {cells}-v.vtu")
        (maker.folder / f"{cells}-foam/constant").mkdir(parents=True)
        maker.run(f"mesh {name}.npy -o {cells}-foam/constant/polyMesh --mesh voronoi --size {size}")
        table = np.genfromtxt(maker.folder / f"{cells}-cells.csv", delimiter=",", names=True)
        yield cells, len(table), float(table["volume"].sum())
