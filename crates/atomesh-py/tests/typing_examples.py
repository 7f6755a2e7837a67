"""The API on one page, for type checkers: `mypy --strict` reads this file, and the tests run it."""

from pathlib import Path
from typing import assert_type

import numpy as np
import numpy.typing as npt

import atomesh as am


def options() -> None:
    """Keywords kept in a dictionary of its own are checked too."""
    chosen: am.MeshOptions = {"size": (6, 18), "features": {"edges": 1.0}, "beta": 0.5, "kind": "delaunay", "seed": 3}
    image = np.zeros((30, 40), np.uint8)
    image[:, 20:] = 200
    mesh = am.mesh(image, **chosen)
    assert_type(mesh, am.Mesh)


def stop(event: am.Event) -> bool | None:
    """Goes on."""
    return event.done <= 2


def page(folder: Path) -> None:
    """All of it, in the order of the manual."""
    array: npt.NDArray[np.uint8] = np.full((40, 60), 200, np.uint8)
    array[20] = 10
    path = folder / "image.npy"
    np.save(path, array)
    read = am.read(path, spacing=(1, 1), meaning="brightness")
    img = am.Image(array, spacing=(1, 1), origin=(0, 0), direction=np.eye(2), units=["mm", "mm"])
    assert_type(read.notes, list[str])
    assert_type(img.spacing, tuple[float, ...])
    am.Image.of(img)

    mesh = am.mesh(img, size=6)
    mesh = am.mesh(
        img, size=(6, 12), features="dark", beta=0.5, kind="delaunay", fixed=[(30.0, 10.0)], min_angle=15, seed=0, threads=1,
        progress=stop, labels=(array > 100).astype(np.uint8),
    )
    assert_type(mesh.points, npt.NDArray[np.float64])
    assert_type(mesh.cells, npt.NDArray[np.uint32])
    assert_type(mesh.facets, dict[str, npt.NDArray[np.uint32]])
    assert_type(mesh.point_data["potential"], npt.NDArray[np.float32])
    mesh.cell_data["k"] = np.ones(mesh.cell_count)
    if mesh.regions is not None:
        assert_type(mesh.regions, npt.NDArray[np.int32])
    print(mesh.region_names, mesh.meta["seed"], mesh.quality()["inverted"], mesh.report()["shape"], mesh.kind, mesh.dim)
    mesh.cell_data["part"] = mesh.clusters(parts=4, features="dark")
    for surface in mesh.features():
        assert_type(surface.points, npt.NDArray[np.float64])
    mesh.surface("xmin").write(folder / "xmin.vtp")
    mesh.sample(img, "mean", name="k")
    flow = mesh.flow(
        sources=[{"at": (30.0, 10.0), "rate": 1.0}], sinks=[(0.0, 0.0)], sides=None, k="k", multiplier=1.0, order=1, solver="direct"
    )
    flow = mesh.flow(sides={"xmin": 1.0, "xmax": ("flux", -1.0)}, k=[1.0, 2.0], barriers={"feature-1": 0.1})
    assert_type(flow.pressure, npt.NDArray[np.float64])
    assert_type(flow.facets["cells"], npt.NDArray[np.int64])
    for line in flow.streamlines(4):
        assert_type(line.source, int | None)
    flow.write(folder / "flow.vtu", report=folder / "flow.json")
    mesh.write(folder / "m.vtu")
    mesh.write(folder / "m.msh", msh="2.2", order=2)
    again = am.read_mesh(folder / "m.vtu")
    assert_type(again, am.Mesh)
    assert_type(mesh.picture(max_side=100), bytes)

    b = am.enhance(img, "dark", smooth=1.0)
    d = am.size_field(img, (6, 12), grade_by="distance")
    assert_type(b, am.Image)
    lat = am.lattice(img, distance=d, crystal="hexagonal", seed=0)
    for step in lat.optimize(potential=b, beta=0.5):
        assert_type(step.energy, float)
        assert_type(step.atoms, npt.NDArray[np.float64])
        break
    own = am.Lattice.of(lat.atoms, img, size=8)
    assert_type(own.settle(progress=False).connect().improve(), am.Mesh)

    ed = mesh.edit()
    atom = ed.add((20.5, 30.25))
    ed.move(atom, (21, 30))
    ed.relax(atom, reach=5)
    ed.pin(atom)
    ed.unpin(atom)
    ed.remove(atom)
    assert_type(ed.mesh(), am.Mesh)

    try:
        am.mesh(img, size=-1)
    except am.InputError as error:
        assert isinstance(error, am.Error)


if __name__ == "__main__":
    import tempfile

    options()
    with tempfile.TemporaryDirectory() as made:
        page(Path(made))
