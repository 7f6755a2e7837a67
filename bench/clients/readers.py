"""What each program makes of the files."""

import os
import shutil
import subprocess

import numpy as np

from made import compare, near, simplex_measures

CORNERS = {2: 3, 3: 4}


def gmsh(files, truth, quadratic):
    """Gmsh through its Python module."""
    import gmsh as program

    for path in files:
        program.initialize()
        program.option.setNumber("General.Terminal", 0)
        program.open(str(path))
        tags, places, _ = program.model.mesh.getNodes()
        points = np.zeros((int(tags.max()) + 1, 3))
        points[tags] = places.reshape(-1, 3)
        kind = {(2, False): 2, (3, False): 4, (2, True): 9, (3, True): 11}[truth.dimension, quadratic]
        numbers, nodes = program.model.mesh.getElementsByType(kind)
        cells = nodes.reshape(len(numbers), -1)
        corners = cells[:, : CORNERS[truth.dimension]].astype(int)
        groups = program.model.getPhysicalGroups()
        names = {program.model.getPhysicalName(*group) for group in groups}
        compare(path.name, "groups with one number", len(groups), len({number for _, number in groups}))
        values = None
        for view in program.view.getTags():
            if program.view.option.getString(view, "Name") == "v":
                _, own, data, _, _ = program.view.getModelData(view, 0)
                by_number = dict(zip(own, (value[0] for value in data)))
                values = np.array([by_number[number] for number in numbers])
        program.finalize()
        measures = simplex_measures(points, corners)
        truth.check(f"Gmsh, {path.name}", points[corners].mean(axis=1), measures, values, names)


def meshio(files, truth, quadratic):
    """meshio, all of whose formats are in Python."""
    import meshio as program

    kind = {(2, False): "triangle", (3, False): "tetra", (2, True): "triangle6", (3, True): "tetra10"}
    kind = kind[truth.dimension, quadratic]
    for path in files:
        mesh = program.read(path, file_format="gmsh" if path.suffix == ".msh2" else None)
        blocks = [at for at, block in enumerate(mesh.cells) if block.type == kind]
        corners = np.concatenate([mesh.cells[at].data for at in blocks])[:, : CORNERS[truth.dimension]]
        values = None
        if "v" in mesh.cell_data:
            values = np.concatenate([mesh.cell_data["v"][at] for at in blocks])
        names = None
        if path.suffix in (".msh", ".msh2"):
            names = set(mesh.field_data)
            numbers = {int(number) for number, _ in mesh.field_data.values()}
            compare(path.name, "groups with one number", len(names), len(numbers))
        points = mesh.points
        measures = simplex_measures(points, corners)
        truth.check(f"meshio, {path.name}", points[corners].mean(axis=1), measures, values, names)


def vtk_grid(path):
    """A file as VTK reads it, with the size of each cell as VTK measures it."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridReader
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkUnstructuredGridReader() if path.suffix == ".vtk" else vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    sizes = vtkCellSizeFilter()
    sizes.SetInputConnection(reader.GetOutputPort())
    sizes.Update()
    grid = sizes.GetOutput()
    arrays = grid.GetCellData()
    named = {arrays.GetArrayName(n): vtk_to_numpy(arrays.GetArray(n)) for n in range(arrays.GetNumberOfArrays())}
    return grid, named


def vtk(files, truth, quadratic):
    """VTK's readers, which are ParaView's."""
    for path in files:
        grid, arrays = vtk_grid(path)
        corners = CORNERS[truth.dimension]
        places = [
            [grid.GetPoint(grid.GetCell(n).GetPointId(k)) for k in range(corners)]
            for n in range(grid.GetNumberOfCells())
        ]
        sizes = arrays["Area" if truth.dimension == 2 else "Volume"]
        values = arrays.get("v") if truth.values is not None else None
        truth.check(f"VTK, {path.name}", np.array(places).mean(axis=1), np.abs(sizes), values)


def vtk_cells(path, count, total):
    """Polygons and polyhedra in VTK."""
    grid, arrays = vtk_grid(path)
    compare(path.name, "cells", count, grid.GetNumberOfCells())
    sizes = np.abs(arrays["Volume" if "Volume" in arrays and arrays["Volume"].any() else "Area"])
    near(f"VTK, {path.name}", "volumes", arrays["volume"], sizes, sizes.max())
    near(f"VTK, {path.name}", "the sum of volumes", total, sizes.sum(), total)


def meshio_cells(path, count, total):
    """Polygons and polyhedra in meshio."""
    import meshio as program

    mesh = program.read(path)
    compare(path.name, "cells", count, sum(len(block.data) for block in mesh.cells))
    volumes = np.concatenate(mesh.cell_data["volume"])
    near(f"meshio, {path.name}", "the sum of volumes", total, volumes.sum(), total)
    compare(path.name, "values", count, len(np.concatenate(mesh.cell_data["v"])))


def openfoam(folder, count):
    """OpenFOAM's checkMesh."""
    system = folder / "system"
    system.mkdir(exist_ok=True)
    schemes = "gradSchemes { default none; } divSchemes { default none; } laplacianSchemes { default none; }\n"
    times = "startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1; writeInterval 1;\n"
    for name, text in [("controlDict", times), ("fvSchemes", schemes), ("fvSolution", "")]:
        head = f"FoamFile {{ version 2.0; format ascii; class dictionary; object {name}; }}\n"
        (system / name).write_text(head + text)
    # Debian's package sets nothing up
    settings = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}
    command = ["checkMesh", "-case", folder]
    done = subprocess.run(command, capture_output=True, text=True, env=settings)
    words = done.stdout.split()
    found = int(words[words.index("cells:") + 1]) if "cells:" in words else 0
    compare(folder.name, "cells", count, found)
    if done.returncode or "Mesh OK." not in done.stdout:
        raise SystemExit(f"OpenFOAM, {folder.name}:\n{done.stdout[-3000:]}{done.stderr[-1000:]}")


def is_installed(program):
    """Whether a program is there, said if not."""
    found = shutil.which(program) is not None
    if not found:
        print(f"not checked: {program} is not installed", flush=True)
    return found
