"""Writes python/atomesh/options.py: the keywords of `mesh` and its kin as TypedDicts.

Names come from the extension, help and possible values from the command's own `--help`, so that neither drifts. Types
follow from the placeholder of each value (`<COUNT>`, `<FILE>` ...); an unknown placeholder is an error here, not a guess.

    python tools/make_options.py            # writes the file
    python tools/make_options.py --check    # exit code 1 if the file is not what would be written
"""

import importlib.util
import re
import subprocess
import sys
import textwrap
from pathlib import Path
from types import ModuleType
from typing import NamedTuple


def extension() -> ModuleType:
    """The extension alone: the package cannot be imported while the file that is made here is not there."""
    spec = importlib.util.find_spec("atomesh")
    if spec is None or not spec.submodule_search_locations:
        raise SystemExit("atomesh is not installed")
    [path] = Path(spec.submodule_search_locations[0]).glob("_atomesh*[!i]")
    found = importlib.util.spec_from_file_location("_atomesh", path)
    assert found is not None and found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


_atomesh = extension()
PATH = Path(__file__).parents[1] / "python" / "atomesh" / "options.py"

# How the work is done, and images beside the one that is meshed: in the extension's lists of every section.
WORK = ("progress", "threads", "strict")
FIELDS = ("potential", "size_field", "beta_field", "mask", "labels")

TYPES = {  # by the placeholder of the value
    "BOOL": "bool",
    **dict.fromkeys(("SIGMA", "SHARE", "LENGTH", "DEGREES", "GAMMA", "HZ", "EPSILON", "VALUE", "B", "PHI"), "float"),
    **dict.fromkeys(("COUNT", "N", "SEED", "BYTES"), "int"),
    **dict.fromkeys(("SX,SY[,SZ]", "X,Y[,Z]"), "Numbers"),
    **dict.fromkeys(("NX,NY[,NZ]", "INLINE,XLINE", "X,Y"), "Sequence[int]"),
    **dict.fromkeys(("DIR", "JSON", "HTML", "PICTURE", "NAME.json", "FILE"), "PathLike"),
    **dict.fromkeys(("TYPE", "NAME", "SERIES", "NAME|N"), "str"),
}
ODD = {  # where the placeholder does not tell, or Python takes more than the command
    "size": "float | tuple[float, float] | ImageLike",
    "beta": "float | ImageLike",
    "fixed": "Sequence[Numbers] | npt.NDArray[Any]",
    "features": "Features",
    "direction": "npt.ArrayLike",
    "crop": "str | Sequence[tuple[float, float]]",
    "points_per_wavelength": "float",
    "order": "Literal[1, 2]",
    "threshold": "float | Sequence[float]",
    **dict.fromkeys(("void", "only"), "int | Sequence[int]"),
    "size_of": "Mapping[int, float]",
    "material": "Mapping[int, tuple[float, float]]",
    "msh": 'Literal["4.1", "2.2"]',
    **dict.fromkeys(FIELDS, "ImageLike"),
}
MORE = {  # what Python takes beside what the help says
    "size": "In Python: a number, a pair (least, greatest), or d(x) as an image.",
    "beta": "In Python: a number, or β(x) as an image.",
    "features": 'In Python also ["faults", "horizons"] and {"faults": 1, "horizons": 0.5}.',
    "crop": "In Python also ((x0, x1), (y0, y1)).",
    "size_of": "In Python {label: d}.",
    "material": "In Python {region: (E, nu)}.",
    **dict.fromkeys(FIELDS, "In Python: a file, or what `Image.of` takes."),
}
KEYWORDS = {"mesh": "kind", "seed-point": "fixed"}  # in help; what has other names is found out, not listed
WORDS = {
    "IMAGE": "the image",
    "starts there. May be given many times": "starts there. Any number of them, shape (n, D)",
    ". May be given many times": "",
    "SHARE is how much": "The value is how much",
    "; 0.4 if left out": "; 0.4 is usual",
    "0.000000000001": "1e-12",
    "as in 0.5,0.5,2": "as in (0.5, 0.5, 2)",
    "is NX,NY,NZ here": "is (nx, ny, nz) here",
    "as in 6..18": "as in (6, 18)",
    "`size` MIN..MAX": "`size` (min, max)",
    "false; true with": "False; True with",
    "false, ": "False, ",
    "`kind` voronoi": '`kind="voronoi"`',
    "`features` labels": '`features="labels"`',
    "Default: false": "Default: False",
}
FLOW = ["order", "porosity", "solver", "solver_tolerance"]  # keywords of `Mesh.flow` beside its arguments
FLOW_RENAMED = {  # arguments of `Mesh.flow`
    "source": "sources", "sink": "sinks", "side": "sides", "barrier": "barriers", "permeability": "k",
}


class Option(NamedTuple):
    """An option as the command's help has it."""

    name: str
    placeholder: str
    help: str
    values: tuple[str, ...]


def options_of(command: str) -> dict[str, list[Option]]:
    """The options of a command by the headings of its help."""
    made = subprocess.run(
        [sys.executable, __file__, "--help-of", command], capture_output=True, text=True, check=True
    )
    found: dict[str, list[Option]] = {}
    heading = ""
    blocks = re.split(r"\n(?=\S|  -|      --)", made.stdout)
    for block in blocks:
        if title := re.match(r"(\w+):", block):
            heading = title[1]
        option = re.match(r" +(?:-\w, )?--([\w-]+)(?:\[?[ =]<(.+?)>\]?)?\n", block)
        if option is None:
            continue
        text = " ".join(block[option.end() :].split())
        values = re.search(r" ?\[possible values: (.*?)\]", text)
        text = re.sub(r" ?\[(possible values|alias): .*?\]", "", text)
        names = tuple(values[1].split(", ")) if values else ()
        found.setdefault(heading, []).append(Option(option[1].replace("-", "_"), option[2] or "", text, names))
    return found


def type_of(keyword: str, option: Option) -> str:
    """The type of a keyword's value."""
    if keyword in ODD:
        return ODD[keyword]
    if option.placeholder in ("BOOL", "") and set(option.values) <= {"true", "false"}:
        return "bool"
    if option.values:
        return f"Literal[{', '.join(f'{value!r}'.replace(chr(39), chr(34)) for value in option.values)}]"
    # "<SHARE>" and "[=<BOOL>]" alike
    found = TYPES.get(option.placeholder)
    if found is None:
        raise SystemExit(f"--{option.name} <{option.placeholder}>: no type is known for this placeholder")
    return found


def key(keyword: str, kind: str, text: str) -> str:
    """A keyword in a docstring of NumPy's style."""
    text = textwrap.fill(text, 118, initial_indent=" " * 8, subsequent_indent=" " * 8, break_on_hyphens=False)
    return f"    {keyword} : {kind}\n{text}".replace("\\", "\\\\")


def typed_dict(name: str, bases: str, story: str, keys: list[tuple[str, str, str]]) -> str:
    """A class; keys are keyword, type and help."""
    if not keys:
        return f'class {name}({bases}, total=False):\n    """{story}"""\n'
    docs = "\n".join(key(*one) for one in keys)
    fields = "\n".join(f"    {keyword}: {kind}" for keyword, kind, _ in keys)
    return f'class {name}({bases}, total=False):\n    """{story}\n\n    Keys\n    ----\n{docs}\n    """\n\n{fields}\n'


def section(keywords: list[str], options: list[Option], renamed: dict[str, str]) -> list[tuple[str, str, str]]:
    """Keywords with types and help. They come in the order of the options; what is spelt otherwise goes to `renamed`."""
    if len(keywords) != len(options):
        raise SystemExit(f"keywords {keywords} beside options {[option.name for option in options]}")
    keys = []
    for keyword, option in zip(keywords, options, strict=True):
        text = in_python(option.help) + (f" {MORE[keyword]}" if keyword in MORE else "")
        if keyword != option.name:
            renamed[option.name] = keyword
            text += f" The command's --{option.name.replace('_', '-')}."
        keys.append((keyword, type_of(keyword, option), text))
    return keys


def in_python(text: str) -> str:
    """Help with options spelt as keywords, and as sentences."""
    text = re.sub(r"--([a-z][a-z-]*)", lambda found: f"`{KEYWORDS.get(found[1], found[1].replace('-', '_'))}`", text)
    text = re.sub(r" ?\[default: (.*)\]", r". Default: \1", text)
    for command, python in WORDS.items():
        text = text.replace(command, python)
    return text if text.endswith((".", "...")) else text + "."


HEAD = '''"""Keywords of `mesh` and its kin: the command's options, with underscores.

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
        {threads}
    strict : bool
        Whether warnings, and notes that something was changed, guessed, filled, left out or not met, are refusals.
    """

    progress: bool | Callable[[Event], bool | None] | None
    threads: int | None
    strict: bool


'''


def made() -> str:
    """The text of options.py."""
    mesh, flow = options_of("mesh"), options_of("flow")
    renamed: dict[str, str] = {}

    def keys(name: str, heading: str, without: tuple[str, ...] = ()) -> list[tuple[str, str, str]]:
        names = [n for n in _atomesh.option_names([name]) if n not in (*WORK, *without)]
        names = [n for n in names if name == "input" or n not in FIELDS]
        return section(names, [o for o in mesh[heading] if o.name not in without], renamed)

    lattice, features = keys("lattice", "Lattice"), keys("features", "Features")
    [size] = [one for one in lattice if one[0] == "size"]
    [kinds] = [one for one in features if one[0] == "features"]
    [units] = [one for one in lattice if one[0] == "units"]
    flow_keys = section(FLOW, [o for name in FLOW for o in flow["Flow"] if o.name == name], renamed)
    flow_keys[0] = ("order", "Literal[1, 2, 3]", flow_keys[0][2])
    meaning = (
        "meaning", 'Literal["brightness", "labels", "mask"]',
        "What the values are, which decides what is read of colours and rounded. Default: brightness",
    )
    classes = [
        typed_dict("FieldOptions", "TypedDict", "Images beside the one that is meshed.", keys("input", "Input", ("image",))),
        typed_dict("LatticeOptions", "TypedDict", "Cells and the lattice that they start from.", [k for k in lattice if k != size]),
        typed_dict("FeatureOptions", "TypedDict", "How features are found.", [k for k in features if k != kinds]),
        typed_dict("RegionOptions", "TypedDict", "Regions of cells.", keys("regions", "Regions")),
        typed_dict("FrameOptions", "TypedDict", "Where samples are, and how files are read.", keys("frame", "Frame")),
        typed_dict("OptimizerOptions", "TypedDict", "How atoms are moved.", keys("optimize", "Optimisation")),
        typed_dict("ImprovementOptions", "TypedDict", "How the mesh is improved.", keys("improve", "Improvement")),
        typed_dict(
            "SizeFieldOptions",
            "\n    LatticeOptions,\n    FeatureOptions,\n    RegionOptions,\n    FrameOptions,\n    OptimizerOptions,\n"
            "    ImprovementOptions,\n    FieldOptions,\n    WorkOptions",
            "Keywords of `size_field`: those of `mesh` but `size`.",
            [kinds],
        ),
        typed_dict("MeshOptions", "SizeFieldOptions", "Keywords of `mesh`, `lattice`, `Lattice.of` and `Lattice.optimize`.", [size]),
        typed_dict("ReadOptions", "FrameOptions, WorkOptions", "Keywords of `read`.", [meaning]),
        typed_dict("EnhanceOptions", "FeatureOptions, FrameOptions, WorkOptions", "Keywords of `enhance`.", [units]),
        typed_dict(
            "MeshFeaturesOptions", "FeatureOptions, FrameOptions, WorkOptions", "Keywords of `Mesh.features`.", [kinds]
        ),
        typed_dict(
            "ReportOptions", "MeshFeaturesOptions", "Keywords of `Mesh.report`.",
            [("size", "float | tuple[float, float]", size[2].partition(" In Python")[0]), units],
        ),
        typed_dict("OutputOptions", "WorkOptions", "Keywords of `Mesh.write`.", keys("output", "Output", ("output", "format"))),
        typed_dict("FlowOptions", "WorkOptions", "Keywords of `Mesh.flow`.", flow_keys),
    ]
    for option in flow["Flow"]:
        if option.name in FLOW_RENAMED:
            renamed[option.name] = FLOW_RENAMED[option.name]
    if missing := FLOW_RENAMED.keys() - renamed.keys():
        raise SystemExit(f"the command has no --{missing}")
    table = "".join(f'    "{name}": "{keyword}",\n' for name, keyword in renamed.items())
    [threads] = [option.help + "." for option in mesh["Run"] if option.name == "threads"]
    return (
        HEAD.replace("{threads}", threads)
        + "\n\n".join(classes)
        + "\n\n#: Options of the command (with underscores) that have another name as keywords.\n"
        + f"RENAMED: Mapping[str, str] = {{\n{table}}}\n"
    )


def main() -> None:
    """Writes the file, or compares it."""
    if "--help-of" in sys.argv[1:]:
        sys.exit(_atomesh.run_command(["atomesh", sys.argv[2], "--help"]))
    text = made()
    if "--check" in sys.argv[1:]:
        sys.exit(PATH.read_text(encoding="utf-8") != text)
    PATH.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
