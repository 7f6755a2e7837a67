"""What other programs make of the files: run.py ATOMESH makes meshes with that command and reads them with Gmsh,
meshio, VTK's readers and, where it is installed, OpenFOAM. The first difference ends it with exit code 1.

Needs numpy, gmsh, meshio and vtk. CalculiX has its own test, crates/atomesh-cli/tests/it/calculix.rs."""

import sys
import tempfile
import time
from pathlib import Path

import made
import readers


def check(binary, folder):
    maker = made.Maker(binary, folder)
    maker.images()
    for truths, quadratic in [(made.simplices(maker), False), (made.quadratic(maker), True)]:
        for name, truth in truths:
            files = lambda *endings: [folder / f"{name}{ending}" for ending in endings]
            # meshio 5 takes every block of MSH 2.2 for one of two values, and has no name for CPS6
            others = [".msh2"] * quadratic + [".inp"] * (quadratic and truth.dimension == 3)
            for reader, own in [
                (readers.gmsh, files(".msh", ".msh2")),
                (readers.meshio, files(".msh", ".vtu", *others)),
                (readers.vtk, files(".vtu") if quadratic else files(".vtu", ".vtk")),
            ]:
                reader(own, truth, quadratic)
                said(reader.__name__, [path.name for path in own])
    has_foam = readers.is_installed("checkMesh")
    for name, count, total in made.voronoi(maker):
        path = folder / f"{name}-v.vtu"
        readers.vtk_cells(path, count, total)
        readers.meshio_cells(path, count, total)
        said("vtk, meshio", [path.name])
        if has_foam:
            readers.openfoam(folder / f"{name}-foam", count)
            said("OpenFOAM", [f"{name}-foam"])


def said(reader, files):
    print(f"{reader}: {', '.join(files)} as written", flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("usage: run.py ATOMESH")
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        check(sys.argv[1], Path(folder))
    print(f"{time.monotonic() - start:.0f} s")
