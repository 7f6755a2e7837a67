"""nanomesh: tetrahedra from a labelled image, by marching cubes and TetGen.

usage: nanomesh_image.py LABELS NX NY NZ SPACING STRIDE MESH|-

nanomesh has no edge length: its surface has the samples' size and its cells grow inward. STRIDE takes every
so many samples, so that sizes can be compared. TetGen, which it runs, is under the AGPL: run here, never
linked.
"""

import sys

import nanomesh
import numpy as np
from job import Stopwatch, finish, write_mesh

path, *shape, spacing, stride, mesh = sys.argv[1:]
shape, stride = [int(n) for n in shape], int(stride)
labels = np.fromfile(path, "u1").reshape(shape[::-1])[::stride, ::stride, ::stride].copy()
with Stopwatch() as clock:
    answer = nanomesh.volume2mesh(nanomesh.Volume(labels))
points, cells = answer.points * (float(spacing) * stride), answer.cells_dict["tetra"]
write_mesh(mesh, points, cells)
finish(clock, points=len(points), cells=len(cells), version=nanomesh.__version__)
