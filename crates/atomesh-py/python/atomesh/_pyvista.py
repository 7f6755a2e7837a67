"""atomesh in pyvista: `ImageData.atomesh.mesh(size=6)`, and files that `pyvista.read` and `save` hand over.

pyvista finds what is here by entry points: `pyvista.accessors`, `pyvista.readers`, `pyvista.writers`. Extensions that
pyvista reads itself, .segy and .nhdr among them, stay its own: it refuses packages that take one over.
"""

from typing import Any, Unpack

import pyvista

from . import _atomesh, _interop
from .options import EnhanceOptions, Features, MeshOptions


@pyvista.register_dataset_accessor("atomesh", pyvista.ImageData)
class ImageAccessor:
    """What atomesh makes of the active scalars of an image."""

    def __init__(self, grid: pyvista.ImageData) -> None:
        self._grid = grid

    @property
    def image(self) -> _atomesh.Image:
        """The image as atomesh has it."""
        return _atomesh.Image.of(self._grid)

    def mesh(self, **options: Unpack[MeshOptions]) -> pyvista.UnstructuredGrid:
        """A `pyvista.UnstructuredGrid` that keeps to the image; options as of `atomesh.mesh`."""
        grid: pyvista.UnstructuredGrid = _atomesh.mesh(self.image, **options).to_pyvista()
        return grid

    def enhance(self, features: Features | None = None, **options: Unpack[EnhanceOptions]) -> pyvista.ImageData:
        """An image of the potential b(x), scalars "potential"; options as of `atomesh.enhance`."""
        made: pyvista.ImageData = _interop.image_to_pyvista(_atomesh.enhance(self.image, features, **options))
        made.rename_array("values", "potential")
        return made


def read_image(path: str, **options: Any) -> pyvista.ImageData:
    """A file that `atomesh.read` knows, for `pyvista.read`; samples are the scalars "values"."""
    grid: pyvista.ImageData = _interop.image_to_pyvista(_atomesh.read(path, **options))
    return grid


def read_mesh(path: str) -> pyvista.UnstructuredGrid:
    """A mesh that `atomesh.read_mesh` knows, for `pyvista.read`."""
    grid: pyvista.UnstructuredGrid = _atomesh.read_mesh(path).to_pyvista()
    return grid


def write_mesh(grid: pyvista.DataSet, path: str) -> None:
    """Triangles in a plane, or tetrahedra, for `save` of pyvista's grids."""
    _atomesh.Mesh.of(grid).write(path)
