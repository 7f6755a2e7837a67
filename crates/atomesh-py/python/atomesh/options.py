"""Keywords of `mesh` and its kin: the command's options, with underscores.

Made by tools/make_options.py from the command's own help; do not change it by hand. Each class is a `TypedDict` for
`**options: Unpack[...]`. What has another name than the command's option is in `RENAMED`.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Protocol, Required, TypeAlias, TypedDict

import numpy.typing as npt

from ._atomesh import Event, Image

PathLike: TypeAlias = str | os.PathLike[str]
Numbers: TypeAlias = Sequence[float] | npt.NDArray[Any]
Features: TypeAlias = str | Sequence[str] | dict[str, float]


class ItkImage(Protocol):
    """An image of SimpleITK or ITK."""

    def GetSpacing(self) -> Any: ...
    def GetOrigin(self) -> Any: ...
    def GetDirection(self) -> Any: ...


class NibabelImage(Protocol):
    """An image of nibabel."""

    @property
    def affine(self) -> Any: ...
    @property
    def dataobj(self) -> Any: ...


class PyvistaImage(Protocol):
    """A pyvista.ImageData."""

    @property
    def dimensions(self) -> Any: ...
    @property
    def spacing(self) -> Any: ...
    @property
    def point_data(self) -> Any: ...


class XarrayImage(Protocol):
    """An xarray.DataArray."""

    @property
    def dims(self) -> Any: ...
    @property
    def coords(self) -> Any: ...


ImageLike: TypeAlias = Image | npt.NDArray[Any] | PathLike | ItkImage | NibabelImage | PyvistaImage | XarrayImage


class Well(TypedDict, total=False):
    """A well of `Mesh.flow`.

    Keys
    ----
    at : sequence of float
        World coordinates, x first.
    rate : float
        Volume a unit of time. Default: 1 of sources; sinks share what the other wells bring.
    pressure : float
        Pressure at its wall.
    radius : float
        Radius of its wall, in world units, which `pressure` needs.
    """

    at: Required[Numbers]
    rate: float
    pressure: float
    radius: float


class WorkOptions(TypedDict, total=False):
    """How the work is done.

    Keys
    ----
    progress : bool or callable
        True shows a line; a callable is called with an `Event` at each step, and ends the work by returning False.
    threads : int
        Threads to use, 1 to 1024; the result is the same with any number. Default: one per core.
    strict : bool
        Whether warnings, and notes that something was changed, guessed, filled, left out or not met, are refusals.
    """

    progress: bool | Callable[[Event], bool | None] | None
    threads: int | None
    strict: bool


class FieldOptions(TypedDict, total=False):
    """Images beside the one that is meshed.

    Keys
    ----
    potential : ImageLike
        Image potential b(x) to use as it is, values from -1 (attracts) to 1 (repels), instead of the features of the
        image. With both, the image gives the frame and the picture. In Python: a file, or what `Image.of` takes.
    size_field : ImageLike
        Nominal distance d(x) in lattice units, an image over the image; replaces `size`. In Python: a file, or what
        `Image.of` takes.
    beta_field : ImageLike
        Weight β(x), 0 to 1, an image over the image; replaces `beta`. In Python: a file, or what `Image.of` takes.
    mask : ImageLike
        Mask, an image over the image: mesh only where it is not 0 (where it is at least 0.5, if its values are shares
        from 0 to 1), up to its smooth outline. Features end there. Or the word live: mesh only where the image has
        data (traces that are neither missing nor dead, samples that are not NaN). In Python: a file, or what
        `Image.of` takes.
    labels : ImageLike
        Labels, an image of integers over the image: each cell gets the label that covers most of it, and facets
        between two labels are tagged, as interface-2-5. Without the image, or with `features="labels"`, atoms are
        attracted to the boundaries between labels. In Python: a file, or what `Image.of` takes.
    """

    potential: ImageLike
    size_field: ImageLike
    beta_field: ImageLike
    mask: ImageLike
    labels: ImageLike


class LatticeOptions(TypedDict, total=False):
    """Cells and the lattice that they start from.

    Keys
    ----
    kind : Literal["delaunay", "voronoi"]
        Cells: triangles or tetrahedra between the atoms (delaunay), or Voronoi (PEBI) polygons or polyhedra around
        them, clipped to the image's box (voronoi). Default: delaunay. The command's --mesh.
    mirror : bool
        Place atoms in pairs, mirror images of each other across features that repel, so that faces of Voronoi cells
        fall on the features. Default: False; True with `kind="voronoi"`.
    grade_by : Literal["density", "curvature", "distance"]
        Where `size` (min, max) is least: where features are dense (density), where they are narrow or bent
        (curvature), or near them (distance). Default: density.
    frequency : float
        Greatest frequency f of waves in 1/s, where the image holds their velocity v: edges are v / f /
        `points_per_wavelength` long, within `size` (min, max) if that is given too. Where v is 0 (shear waves in
        water), MIN is taken.
    points_per_wavelength : float
        Edges in a wavelength, above 0; with `frequency`. Default: 5.
    beta : float | ImageLike
        Weight β of the image against regularity, 0 to 1. Default: 0.45. In Python: a number, or β(x) as an image.
    units : Literal["physical", "samples"]
        Lattice units: the frame's own (millimetres, metres ...), or samples, as in the paper. Default: physical.
    lattice : Literal["hexagonal", "bcc", "fcc", "random"]
        Lattice to start from: hexagonal (2-D); bcc, fcc (3-D); random (both). Default: hexagonal in 2-D, bcc in 3-D.
    spacing_factor : float
        Share γ of the edge length that an atom of the starting lattice keeps free of others, 0.1 to 1. Where the
        length varies, a small share makes edges shorter than it: less than a third of it is refused. Default: 0.8.
    fixed : Sequence[Numbers] | npt.NDArray[Any]
        Atom that stays where it is, such as a well, in world coordinates; growth starts there. Any number of them,
        shape (n, D). The command's --seed-point.
    """

    kind: Literal["delaunay", "voronoi"]
    mirror: bool
    grade_by: Literal["density", "curvature", "distance"]
    frequency: float
    points_per_wavelength: float
    beta: float | ImageLike
    units: Literal["physical", "samples"]
    lattice: Literal["hexagonal", "bcc", "fcc", "random"]
    spacing_factor: float
    fixed: Sequence[Numbers] | npt.NDArray[Any]


class FeatureOptions(TypedDict, total=False):
    """How features are found.

    Keys
    ----
    edge_operator : Literal["gaussian", "prewitt", "crest"]
        How edges are found: by derivatives of a Gaussian (gaussian), by the paper's Prewitt differences (prewitt), or
        thinned to where a Gaussian's gradient is greatest, then widened to valleys of one depth (crest). Default:
        gaussian.
    edge_scale : float
        Standard deviation of the Gaussian that finds edges and boundaries between labels, in units of the smallest
        sample spacing, 0.3 or more. Default: 1.5; with `edge_operator` crest, from the image's noise.
    denoise : float
        Remove noise before features are found, but keep edges (non-local means). The value is how much patches of the
        image may differ, relative to the noise, and still be averaged, 0.01 to 10; 0.4 is usual. Default: off.
    polarity : Literal["bright", "dark", "both"]
        Which ridges and horizons: bright ones (peaks), dark ones (troughs), or both. Default: bright.
    scale : float
        Standard deviation of the Gaussian whose derivatives find ridges and horizons, in units of the smallest sample
        spacing, 0.3 or more. Default: 1.5 for ridges, 1 for horizons.
    normal_scale : float
        Standard deviation of the Gaussian that averages the directions of ridges and horizons, in units of the
        smallest sample spacing; for ridges, 0 takes the direction at each sample. Default: 12 for ridges, 8 for
        horizons.
    low : float
        Least strength of features where connected to stronger parts (hysteresis), 0 to 1. Default: 0.3 for ridges,
        0.15 for horizons and faults, 0.2 for edge crests, 0.07 for edges that atoms are put on.
    high : float
        Strength that each feature must reach somewhere (hysteresis), 0 to 1. Default: 0.4 for horizons, 0.5 for
        ridges, faults and edge crests, 0.2 for edges that atoms are put on.
    least_length : float
        Least length of a feature in samples; in 3-D its square is the least area. Default: 10 for ridges and edge
        crests, 20 for horizons and faults.
    layer_reach : float
        Mean distance, along layers and in samples, of what is compared on the two sides of a fault, 1 to 1000: a
        larger value tolerates more noise but blurs faults close together. Default: 4.
    dip_reach : float
        Standard deviation of the average along a fault's dip, in samples, 0.5 to 1000: a larger value tolerates more
        noise but blurs curved faults. Default: 12.
    least_dip : float
        Least dip of a fault from the horizontal in degrees, in sample coordinates, 20 to 85. Default: 45.
    repel : bool
        Repel atoms from features, so that they line up alongside. Default: False; True with `kind="voronoi"`, whose
        faces then fall on the features.
    smooth : float
        Standard deviation of the Gaussian that smooths the potential, in lattice units; for ridges, faults, horizons
        and edge crests, the width of their valleys. Default: the smallest sample spacing; with `kind="voronoi"`, a
        quarter of the edge length for dark and bright features that repel; none for edges.
    """

    edge_operator: Literal["gaussian", "prewitt", "crest"]
    edge_scale: float
    denoise: float
    polarity: Literal["bright", "dark", "both"]
    scale: float
    normal_scale: float
    low: float
    high: float
    least_length: float
    layer_reach: float
    dip_reach: float
    least_dip: float
    repel: bool
    smooth: float


class RegionOptions(TypedDict, total=False):
    """Regions of cells.

    Keys
    ----
    least_island : int
        Connected groups of cells of one label, if of fewer cells than this, take the label of their neighbours.
        Default: 0.
    threshold : float | Sequence[float]
        Values of the image, ascending, that part it into phases, in place of `labels`: label 0 below the first, 1
        from it up to the next, and so on. With `denoise`, of the image without its noise. The phases' boundaries are
        the features, unless `features` says others.
    void : int | Sequence[int]
        Labels that are left out: the mesh ends at their smooth outline, as at that of a mask.
    only : int | Sequence[int]
        The labels that are meshed; all others are left out, as by `void`.
    size_of : Mapping[int, float]
        Edge length wanted where a label is, in lattice units; elsewhere it is `size`, and between them it grows by 1
        for each 4 units of way. In Python {label: d}.
    """

    least_island: int
    threshold: float | Sequence[float]
    void: int | Sequence[int]
    only: int | Sequence[int]
    size_of: Mapping[int, float]


class FrameOptions(TypedDict, total=False):
    """Where samples are, and how files are read.

    Keys
    ----
    spacing : Numbers
        World units from one sample to the next along x, y (and z), as in (0.5, 0.5, 2); replaces the image's own.
        Default: the image's, else 1.
    origin : Numbers
        World coordinates of the first sample; replaces the image's own. Default: the image's, else 0.
    direction : npt.ArrayLike
        World directions of the axes as a matrix, row by row: its columns are the axes x, y (and z). Default: the
        image's, else the world's axes.
    y_up : bool
        Let y grow upwards: the rows of the image run down from the greatest y, so that photographs (PNG, JPEG, TIFF)
        stand upright in programs whose y points up, such as Abaqus and Gmsh. The box stays. Default: False, rows run
        along y as they come.
    crop : str | Sequence[tuple[float, float]]
        Box of interest in world coordinates, rounded outward to whole samples. In Python also ((x0, x1), (y0, y1)).
    fill : float
        Value that NaN samples are written and drawn as; they count as places without data, which are no features.
        Default: NaN samples are an error.
    channel : int
        TIFF stacks of several channels: which one, from 1, as ImageJ counts. Default: several are an error.
    time : int
        TIFF stacks of several points of time: which one, from 1. Default: several are an error.
    volume : int
        NIfTI and FreeSurfer files of several volumes (4-D): which one, from 1. Default: several are an error.
    array : str
        NPZ, VTI and VTK files of several arrays: which one, by its name. Default: the only one that is an image; of
        VTI and VTK the file's scalars, or the first.
    series : str
        DICOM folders of several series: which one, by its UID, its number or its description. Default: several are an
        error.
    segment : str
        Segmentations (.seg.nrrd, DICOM): which segment, by its name or its number from 1; samples are 1 in it and 0
        elsewhere. Default: all as labels; segments that overlap are an error.
    labels_by_color : bool
        Colour images as labels: one for each colour, black 0, the others from 1 by ascending red, green, blue.
        Default: False, colours are an error; grey values and indices of palettes are labels as they are.
    shape : Sequence[int]
        Raw samples: how many along x, y (and z), x fastest in the file. A NumPy array of shape (nz, ny, nx) is (nx,
        ny, nz) here.
    dtype : str
        Raw samples: their type by NumPy's name: uint8, int16, float32 ...
    byte_order : Literal["little", "big"]
        Raw samples: byte order. Default: little.
    offset : int
        Raw samples: bytes before the first. Default: 0.
    trace_bytes : Sequence[int]
        SEG-Y: first bytes of the inline and the crossline number in a trace header; the same byte twice makes a line.
        Default: 189,193.
    coordinate_bytes : Sequence[int]
        SEG-Y: first bytes of X and Y in a trace header. Default: 181,185, or else 73,77 or 81,85, the first of these
        that vary.
    sample_format : Literal["ibm", "ieee", "float64", "int32", "int16", "int8", "uint32", "uint16", "uint8"]
        SEG-Y: how samples are written, whatever the header's format code says. Default: what that says.
    duplicates : Literal["first", "last"]
        SEG-Y: which of several traces with the same numbers counts, the first or the last in the file. Default: they
        are an error.
    truncated : bool
        SEG-Y: read the whole traces of a file that is cut short. Default: False, such a file is an error.
    data_root : PathLike
        Folder in which, and below which, the headers of NRRD, MetaImage and RSF may name the files of their samples.
        Default: the header's own folder.
    vertical : Literal["time", "depth"]
        SEG-Y: the axis along a trace, time (milliseconds) or depth (metres or feet). RSF: the first axis is vertical,
        whatever its label says.
    """

    spacing: Numbers
    origin: Numbers
    direction: npt.ArrayLike
    y_up: bool
    crop: str | Sequence[tuple[float, float]]
    fill: float
    channel: int
    time: int
    volume: int
    array: str
    series: str
    segment: str
    labels_by_color: bool
    shape: Sequence[int]
    dtype: str
    byte_order: Literal["little", "big"]
    offset: int
    trace_bytes: Sequence[int]
    coordinate_bytes: Sequence[int]
    sample_format: Literal["ibm", "ieee", "float64", "int32", "int16", "int8", "uint32", "uint16", "uint8"]
    duplicates: Literal["first", "last"]
    truncated: bool
    data_root: PathLike
    vertical: Literal["time", "depth"]


class OptimizerOptions(TypedDict, total=False):
    """How atoms are moved.

    Keys
    ----
    engine : Literal["pairs", "sampled"]
        How the energy is computed: from pairs of neighbours (pairs), or by the paper's sums over samples (sampled).
        Default: pairs.
    interpolation : Literal["nearest", "linear", "spline"]
        How the potential is interpolated between samples. Default: spline in 2-D, linear in 3-D.
    smoothing_steps : int
        Stages on a smoothed potential before the sharp one, 0 to 10. Default: 2 in 2-D, 0 in 3-D and with
        `kind="voronoi"`.
    tolerance : float
        Relative decrease ε of the energy at which the work ends, 0 or more, below 1. Default: 0.001.
    inner_limit : int
        Greatest number of iterations after each perturbation. Default: 200.
    outer_limit : int
        Greatest number of perturbations. Default: 2 in 2-D, 1 in 3-D.
    perturbation : float
        How far a perturbation moves an atom, relative to its edge length, 0 or more, below 0.5. Default: 0.1.
    seed : int
        Seed of all random numbers. Default: 0.
    """

    engine: Literal["pairs", "sampled"]
    interpolation: Literal["nearest", "linear", "spline"]
    smoothing_steps: int
    tolerance: float
    inner_limit: int
    outer_limit: int
    perturbation: float
    seed: int


class ImprovementOptions(TypedDict, total=False):
    """How the mesh is improved.

    Keys
    ----
    align : Literal["auto", "off", "swaps", "full", "conform"]
        Turn the edges (2-D) or faces (3-D) of the mesh onto features: not at all (off), by swaps alone, by swaps and
        moves of points (full), or by atoms that stand on features before all others, so that each feature is one line
        or sheet of them, tagged (conform); or conform where features are clean, full where they are ragged (auto).
        Default: auto.
    min_angle : float
        Least angle in degrees that swaps and moves keep or restore: interior angles, below 60, in 2-D; dihedral
        angles, below 70.5, in 3-D. Default: 20 in 2-D, 15 in 3-D.
    """

    align: Literal["auto", "off", "swaps", "full", "conform"]
    min_angle: float


class SizeFieldOptions(
    LatticeOptions,
    FeatureOptions,
    RegionOptions,
    FrameOptions,
    OptimizerOptions,
    ImprovementOptions,
    FieldOptions,
    WorkOptions, total=False):
    """Keywords of `size_field`: those of `mesh` but `size`.

    Keys
    ----
    features : Features
        What attracts atoms. In images that show features directly: dark or bright places, edges, boundaries between
        labels (labels), or none. In raw images: ridges (the middles of lines and sheets), and in seismic amplitudes
        faults and horizons. Several kinds may share a potential, each with its weight, as in faults,horizons:0.5.
        Default: dark. In Python also ["faults", "horizons"] and {"faults": 1, "horizons": 0.5}.
    """

    features: Features


class MeshOptions(SizeFieldOptions, total=False):
    """Keywords of `mesh`, `lattice`, `Lattice.of` and `Lattice.optimize`.

    Keys
    ----
    size : float | tuple[float, float] | ImageLike
        Edge length wanted, in lattice units: one, as in 8, or from features to elsewhere, as in (6, 18). Default:
        from the size of the image. In Python: a number, a pair (least, greatest), or d(x) as an image.
    """

    size: float | tuple[float, float] | ImageLike


class ReadOptions(FrameOptions, WorkOptions, total=False):
    """Keywords of `read`.

    Keys
    ----
    meaning : Literal["brightness", "labels", "mask"]
        What the values are, which decides what is read of colours and rounded. Default: brightness
    """

    meaning: Literal["brightness", "labels", "mask"]


class EnhanceOptions(FeatureOptions, FrameOptions, WorkOptions, total=False):
    """Keywords of `enhance`.

    Keys
    ----
    units : Literal["physical", "samples"]
        Lattice units: the frame's own (millimetres, metres ...), or samples, as in the paper. Default: physical.
    """

    units: Literal["physical", "samples"]


class MeshFeaturesOptions(FeatureOptions, FrameOptions, WorkOptions, total=False):
    """Keywords of `Mesh.features`.

    Keys
    ----
    features : Features
        What attracts atoms. In images that show features directly: dark or bright places, edges, boundaries between
        labels (labels), or none. In raw images: ridges (the middles of lines and sheets), and in seismic amplitudes
        faults and horizons. Several kinds may share a potential, each with its weight, as in faults,horizons:0.5.
        Default: dark. In Python also ["faults", "horizons"] and {"faults": 1, "horizons": 0.5}.
    """

    features: Features


class ReportOptions(MeshFeaturesOptions, total=False):
    """Keywords of `Mesh.report`.

    Keys
    ----
    size : float | tuple[float, float]
        Edge length wanted, in lattice units: one, as in 8, or from features to elsewhere, as in (6, 18). Default:
        from the size of the image.
    units : Literal["physical", "samples"]
        Lattice units: the frame's own (millimetres, metres ...), or samples, as in the paper. Default: physical.
    """

    size: float | tuple[float, float]
    units: Literal["physical", "samples"]


class OutputOptions(WorkOptions, total=False):
    """Keywords of `Mesh.write`.

    Keys
    ----
    msh : Literal["4.1", "2.2"]
        Version of Gmsh's format in a .msh file. Default: 4.1.
    msh_text : bool
        Write a .msh or .msh2 file as text, which Netgen and GetFEM need. Default: binary.
    order : Literal[1, 2]
        Order of the cells: 2 writes triangles of 6 and tetrahedra of 10 points, curved on a mask's outline. Default:
        1.
    section : Literal["solid", "plane-stress", "plane-strain", "axisymmetric"]
        Abaqus: write what the cells are, in sections of one material for each region, called as the region: solid
        (3-D), plane-stress or plane-strain of thickness 1, or axisymmetric about the y axis (2-D). Default: plane
        stress in 2-D, and no sections.
    material : Mapping[int, tuple[float, float]]
        Abaqus: write the elastic material of a region beside its section: Young's modulus E and Poisson's ratio NU.
        In Python {region: (E, nu)}.
    tag_features : float
        Tag facets along which the mean of b is at most this (-1 to 1, such as -0.2) as features, beside the sides of
        the box; `features` offers more choice. Not in .vtk and .npz.
    regions : bool
        Write the parts into which the tagged features cut the mesh as regions of cells, 1, 2 ...; parts smaller than
        `least_island` go to their neighbours.
    connections : PathLike
        List of the connections of Voronoi cells, for flow simulators: a head as JSON, and beside it NAME-cells.csv,
        NAME-connections.csv and NAME-boundary.csv.
    picture : PathLike
        Picture of the mesh over the image, .png or .svg; in 3-D, of the three slices through the middle.
    picture_of : Literal["image", "potential", "distance", "density"]
        What the picture shows behind the mesh: the image, the potential, the nominal distance, or the density of
        features, smoothed over the greatest nominal distance. Needs `picture` or `movie`. Default: image.
    view : Literal["slices", "3d", "cut-away"]
        What the picture of a volume shows: three slices; 3d, in space, slices and the surfaces of features, labels or
        the mask; or cut-away, in space, the cells, an eighth of them cut away. Needs `picture`. Default: slices.
    movie : PathLike
        Movie of the run, an animated .png: atoms on their way to the features over what `picture_of` names, at most
        100 steps, and at last the mesh; sides of up to 640 pixels. In 3-D, the atoms within half an edge length of
        the three slices through the middle, up to 900 pixels.
    report : PathLike
        Figures of the mesh (shape, alignment, fidelity) and of the run, as JSON; as a page if the name ends in .html.
    html : PathLike
        The same figures with a picture and histograms, as one self-contained HTML page.
    write_potential : PathLike
        Potential that the atoms felt: .npy (axes z, y, x), .nii, .nii.gz, .nrrd, .vti, .tif or .raw, float32. .nii,
        .nrrd and .vti keep the frame.
    """

    msh: Literal["4.1", "2.2"]
    msh_text: bool
    order: Literal[1, 2]
    section: Literal["solid", "plane-stress", "plane-strain", "axisymmetric"]
    material: Mapping[int, tuple[float, float]]
    tag_features: float
    regions: bool
    connections: PathLike
    picture: PathLike
    picture_of: Literal["image", "potential", "distance", "density"]
    view: Literal["slices", "3d", "cut-away"]
    movie: PathLike
    report: PathLike
    html: PathLike
    write_potential: PathLike


class FlowOptions(WorkOptions, total=False):
    """Keywords of `Mesh.flow`.

    Keys
    ----
    order : Literal[1, 2, 3]
        Degree of the pressure in a cell, 1 to 3. Default: 2.
    porosity : float
        Share of the volume that the fluid fills, above 0, at most 1; for times of flight. Default: 1.
    solver : Literal["auto", "direct", "iterative"]
        How the equations are solved. Default: auto.
    solver_tolerance : float
        Residual that iteration may leave, relative to the right-hand side, 1e-15 to 0.01. Default: 1e-12.
    """

    order: Literal[1, 2, 3]
    porosity: float
    solver: Literal["auto", "direct", "iterative"]
    solver_tolerance: float


#: Options of the command (with underscores) that have another name as keywords.
RENAMED: Mapping[str, str] = {
    "mesh": "kind",
    "seed_point": "fixed",
    "source": "sources",
    "sink": "sinks",
    "side": "sides",
    "barrier": "barriers",
    "permeability": "k",
}
