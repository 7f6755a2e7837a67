"""SeismicMesh: graded triangles from a velocity model.

usage: seismicmesh_graded.py VELOCITY NX NZ DX DZ RATE MESH|-

Sizes are velocity / RATE, read between samples as SeismicMesh does itself. One process; all else is left at
its defaults. SeismicMesh is under the GPL: it is run here and never linked.
"""

import sys

import numpy as np
import SeismicMesh
from job import Stopwatch, finish, write_mesh
from scipy.interpolate import RegularGridInterpolator

path, nx, nz, dx, dz, rate, mesh = sys.argv[1:]
nx, nz, dx, dz = int(nx), int(nz), float(dx), float(dz)
velocity = np.fromfile(path, "<f4").reshape(nz, nx)

with Stopwatch() as clock:
    sizes = velocity.astype(float) / float(rate)
    z, x = np.arange(nz) * dz, np.arange(nx) * dx
    at = RegularGridInterpolator((z, x), sizes, bounds_error=False, fill_value=None)
    box = (0.0, z[-1], 0.0, x[-1])
    edge_length = SeismicMesh.SizeFunction(box, at, sizes.min())
    points, cells = SeismicMesh.generate_mesh(SeismicMesh.Rectangle(box), edge_length, verbose=0)

write_mesh(mesh, points[:, ::-1], cells)
finish(clock, points=len(points), cells=len(cells), version=SeismicMesh.__version__)
