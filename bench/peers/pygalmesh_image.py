"""pygalmesh: CGAL's Mesh_3 from Python, on a labelled image.

usage: pygalmesh_image.py LABELS NX NY NZ SPACING SIZE MESH|-

The same criteria as cgal_image.cpp; both labels are meshed, so that the box is filled. pygalmesh and CGAL are
under the GPL: they are run here and never linked.
"""

import sys

import numpy as np
import pygalmesh
from job import Stopwatch, finish, write_mesh

path, *shape, spacing, size, mesh = sys.argv[1:]
size = float(size)
labels = np.fromfile(path, "u1").reshape([int(n) for n in shape][::-1]).transpose(2, 1, 0) + np.uint8(1)
with Stopwatch() as clock:
    answer = pygalmesh.generate_from_array(
        np.asfortranarray(labels), [float(spacing)] * 3, min_facet_angle=30.0, max_radius_surface_delaunay_ball=size,
        max_facet_distance=0.25 * size, max_circumradius_edge_ratio=3.0, max_cell_circumradius=size, verbose=False)
points, cells = answer.points, answer.cells_dict["tetra"]
write_mesh(mesh, points, cells)
finish(clock, points=len(points), cells=len(cells), version=pygalmesh.__version__)
