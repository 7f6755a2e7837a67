"""Cleaver: tetrahedra from a labelled image.

usage: cleaver_image.py LABELS NX NY NZ SPACING SAMPLING_RATE MESH|-

SAMPLING_RATE scales Cleaver's background lattice: less makes larger cells.
"""

import sys

import itk
import numpy as np
from job import Stopwatch, finish, write_mesh

path, *shape, spacing, rate, mesh = sys.argv[1:]
labels = np.fromfile(path, "u1").reshape([int(n) for n in shape][::-1])
image = itk.image_from_array(labels)
image.SetSpacing([float(spacing)] * 3)
kind = type(image)
cleave = itk.CleaverImageToMeshFilter[kind, itk.Mesh[itk.D, 3]].New()
cleave.SetInput(image)
cleave.SetSamplingRate(float(rate))
cleave.SetNumberOfWorkUnits(1)
with Stopwatch() as clock:
    cleave.Update()
answer = cleave.GetOutput(0)
points = itk.array_from_vector_container(answer.GetPoints()).astype(float)
cells = itk.array_from_vector_container(answer.GetCellsArray()).reshape(-1, 6)[:, 2:]
write_mesh(mesh, points, cells)
finish(clock, points=len(points), cells=len(cells), version="1.3.1")
