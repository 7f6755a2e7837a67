"""Gmsh's HXT: tetrahedra of one size in a box, from its surface mesh on.

usage: gmsh_hxt.py SIZE THREADS MESH|-

SIZE is the edge length asked for in the unit cube. The surface mesh is made before the clock starts; the
volume mesh, optimised as by default, is what is measured. Gmsh is under the GPL: it is run here and never
linked.
"""

import sys

import gmsh
import numpy as np
from job import Stopwatch, finish, write_mesh

size, threads, mesh = float(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
gmsh.initialize(["gmsh", "-nopopup", "-v", "2"])
options = {"General.NumThreads": threads, "Mesh.Algorithm3D": 10, "Mesh.MeshSizeMin": size, "Mesh.MeshSizeMax": size}
for name, value in options.items():
    gmsh.option.setNumber(name, value)
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.mesh.generate(2)
with Stopwatch() as clock:
    gmsh.model.mesh.generate(3)
tags, points, _ = gmsh.model.mesh.getNodes()
place = np.zeros(int(tags.max()) + 1, int)
place[tags] = np.arange(len(tags))
cells = place[gmsh.model.mesh.getElementsByType(4)[1]].reshape(-1, 4)
write_mesh(mesh, points.reshape(-1, 3), cells)
finish(clock, points=len(tags), cells=len(cells), version=gmsh.__version__)
