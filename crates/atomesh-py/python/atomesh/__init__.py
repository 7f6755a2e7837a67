"""Meshes that keep to images: triangles, tetrahedra and Voronoi cells from grey values, without segmentation.

    import atomesh as am

    mesh = am.mesh("scan.nii.gz", size=6, features="edges")
    mesh.write("scan.vtu")

The method is Dave Hale's *Atomic Images* (2001). `mesh` does it all; `enhance`, `size_field` and `lattice` do its parts;
`Image` says where samples are; a `Mesh` is arrays, and goes on to meshio, pyvista and scikit-fem. NumPy is all that is
needed; what else is used is imported when it is asked for.
"""

from ._atomesh import (
    Connected,
    Editor,
    Event,
    Flow,
    Image,
    Lattice,
    Mesh,
    Step,
    Steps,
    Streamline,
    Surface,
    __version__,
    enhance,
    lattice,
    mesh,
    read,
    read_mesh,
    size_field,
)
from ._errors import (
    AtomeshNote,
    AtomeshWarning,
    Cancelled,
    Error,
    FileError,
    InputError,
    MemoryForecastError,
)
from .options import (
    EnhanceOptions,
    FeatureOptions,
    FieldOptions,
    FlowOptions,
    FrameOptions,
    ImprovementOptions,
    LatticeOptions,
    MeshFeaturesOptions,
    MeshOptions,
    OptimizerOptions,
    OutputOptions,
    ReadOptions,
    RegionOptions,
    ReportOptions,
    SizeFieldOptions,
    Well,
    WorkOptions,
)

__all__ = [
    "AtomeshNote",
    "AtomeshWarning",
    "Cancelled",
    "Connected",
    "Editor",
    "EnhanceOptions",
    "Error",
    "Event",
    "FeatureOptions",
    "FieldOptions",
    "FileError",
    "Flow",
    "FlowOptions",
    "FrameOptions",
    "Image",
    "ImprovementOptions",
    "InputError",
    "Lattice",
    "LatticeOptions",
    "MemoryForecastError",
    "Mesh",
    "MeshFeaturesOptions",
    "MeshOptions",
    "OptimizerOptions",
    "OutputOptions",
    "ReadOptions",
    "RegionOptions",
    "ReportOptions",
    "SizeFieldOptions",
    "Step",
    "Steps",
    "Streamline",
    "Surface",
    "Well",
    "WorkOptions",
    "__version__",
    "enhance",
    "lattice",
    "mesh",
    "read",
    "read_mesh",
    "size_field",
]
