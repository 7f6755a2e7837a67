"""Gmsh: graded triangles from a velocity model, by a field of sizes on its grid.

usage: gmsh_graded.py VELOCITY NX NZ DX DZ RATE ALGORITHM MESH|-

Sizes are velocity / RATE. ALGORITHM is Mesh.Algorithm: 5 Delaunay, 6 frontal Delaunay. Gmsh takes a gridded
field from a file only; writing it is not in the figures. Gmsh is under the GPL: it is run here and never
linked.
"""

import os
import struct
import sys
import tempfile

import gmsh
import numpy as np
from job import Stopwatch, finish, write_mesh

path, nx, nz, dx, dz, rate, algorithm, mesh = sys.argv[1:]
nx, nz, dx, dz = int(nx), int(nz), float(dx), float(dz)
sizes = np.fromfile(path, "<f4").reshape(nz, nx) / float(rate)

gmsh.initialize(["gmsh", "-nopopup", "-v", "2"])
options = {"General.NumThreads": 1, "Mesh.Algorithm": int(algorithm), "Mesh.MeshSizeExtendFromBoundary": 0,
           "Mesh.MeshSizeFromPoints": 0, "Mesh.MeshSizeFromCurvature": 0}
for name, value in options.items():
    gmsh.option.setNumber(name, value)
with tempfile.NamedTemporaryFile(suffix=".grid", delete=False) as file:
    # x slowest, then y, then z, as Gmsh's field "Structured" reads it
    file.write(struct.pack("<6d3i", 0, 0, 0, dx, dz, 1, nx, nz, 1))
    file.write(np.ascontiguousarray(sizes.T, "<f8").tobytes())

with Stopwatch() as clock:
    gmsh.model.occ.addRectangle(0, 0, 0, (nx - 1) * dx, (nz - 1) * dz)
    gmsh.model.occ.synchronize()
    field = gmsh.model.mesh.field.add("Structured")
    gmsh.model.mesh.field.setString(field, "FileName", file.name)
    gmsh.model.mesh.field.setNumber(field, "TextFormat", 0)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    gmsh.model.mesh.generate(2)

os.unlink(file.name)
tags, points, _ = gmsh.model.mesh.getNodes()
place = np.zeros(int(tags.max()) + 1, int)
place[tags] = np.arange(len(tags))
cells = place[gmsh.model.mesh.getElementsByType(2)[1]].reshape(-1, 3)
write_mesh(mesh, points.reshape(-1, 3)[:, :2], cells)
finish(clock, points=len(tags), cells=len(cells), version=gmsh.__version__)
