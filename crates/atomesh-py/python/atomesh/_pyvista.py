"""atomesh in pyvista: `ImageData.atomesh.mesh(size=6)`, and files that `pyvista.read` hands over.

pyvista finds this module by the entry point `pyvista.accessors`.
"""

import pyvista

from ._atomesh import Image, enhance, mesh


@pyvista.register_dataset_accessor("atomesh", pyvista.ImageData)
class ImageAccessor:
    """What atomesh makes of the active scalars of an image."""

    def __init__(self, grid):
        self._grid = grid

    @property
    def image(self):
        """The image as atomesh has it."""
        return Image.of(self._grid)

    def mesh(self, **options):
        """A `pyvista.UnstructuredGrid` that keeps to the image; options as of `atomesh.mesh`."""
        return mesh(self.image, **options).to_pyvista()

    def enhance(self, features=None, **options):
        """The image with the potential b(x) as scalars "potential"; options as of `atomesh.enhance`."""
        potential = enhance(self.image, features, **options)
        made = self._grid.copy()
        made.clear_data()
        made.point_data["potential"] = potential.array.ravel()
        return made
