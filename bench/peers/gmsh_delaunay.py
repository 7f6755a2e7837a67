"""Gmsh: Delaunay meshes of given points, 2-D and 3-D.

usage: gmsh_delaunay.py POINTS 2|3 MESH|-

Gmsh is under the GPL: it is run here and never linked.
"""

import sys

import gmsh
from job import Stopwatch, finish, read_points, write_mesh

path, dimension, mesh = sys.argv[1], int(sys.argv[2]), sys.argv[3]
points = read_points(path, dimension)
flat = points.ravel()
gmsh.initialize(["gmsh", "-nopopup", "-v", "2"])
gmsh.option.setNumber("General.NumThreads", 1)
with Stopwatch() as clock:
    if dimension == 2:
        cells = gmsh.algorithm.triangulate(flat)
    else:
        cells, _ = gmsh.algorithm.tetrahedralize(flat)
cells = cells.reshape(-1, dimension + 1) - 1
write_mesh(mesh, points, cells)
finish(clock, points=len(points), cells=len(cells), version=gmsh.__version__)
