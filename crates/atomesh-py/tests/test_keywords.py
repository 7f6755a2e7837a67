"""Keywords: unknown ones, renamed ones, values out of range; errors and warnings."""

import errno
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import atomesh as am
from atomesh import _atomesh
from atomesh.options import RENAMED
from conftest import TESTS, faults, python

FLAT = faults()


@pytest.fixture(scope="module")
def mesh() -> am.Mesh:
    return am.mesh(FLAT, size=8)


@pytest.mark.parametrize(
    ("wrong", "right"), [("min_angel", "min_angle"), ("sizes", "size"), ("betta", "beta"), ("tolerence", "tolerance"), ("thread", "threads")]
)
def test_an_unknown_keyword_names_the_nearest(wrong: str, right: str) -> None:
    for function in (am.mesh, am.lattice, am.size_field):
        with pytest.raises(TypeError, match=rf"no keyword \"{wrong}\"; did you mean \"{right}\"\?"):
            function(FLAT, **{wrong: 1})


def test_a_keyword_far_from_all_is_named_alone() -> None:
    with pytest.raises(TypeError, match=r'mesh\(\) has no keyword "xyzzy"$'):
        am.mesh(FLAT, xyzzy=1)


def test_each_name_of_the_command_that_python_spells_otherwise_names_its_keyword(mesh: am.Mesh) -> None:
    assert {"kind", "fixed", "sides", "sources", "sinks"} <= set(RENAMED.values())
    for name, keyword in RENAMED.items():
        function = mesh.flow if name not in ("mesh", "seed_point") else lambda **options: am.mesh(FLAT, **options)
        with pytest.raises(TypeError, match=f'no keyword "{name}"; did you mean "{keyword}"'):
            function(**{name: 1})


def test_functions_take_keywords_of_their_own_alone(mesh: am.Mesh, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="read"):
        am.read(tmp_path / "x.npy", size=3)
    with pytest.raises(TypeError, match="enhance"):
        am.enhance(FLAT, size=3)
    with pytest.raises(TypeError, match="write"):
        mesh.write(tmp_path / "x.vtu", beta=1)
    with pytest.raises(TypeError, match="report"):
        mesh.report(seed=1)
    with pytest.raises(TypeError, match="flow"):
        mesh.flow(sides={"xmin": 1, "xmax": 0}, beta=1)


def test_none_is_as_if_not_given(mesh: am.Mesh) -> None:
    nothing = {name: None for name in _atomesh.option_names() if name not in ("size", "strict")}
    np.testing.assert_array_equal(am.mesh(FLAT, size=8, **nothing).points, mesh.points)


@pytest.mark.parametrize(
    "keywords",
    [
        {"size": -1}, {"size": "huge"}, {"size": (6, 3)}, {"size": (1, 2, 3)}, {"beta": 2}, {"kind": "cubes"}, {"seed": -1},
        {"features": "nonsense"}, {"features": {"dark": "much"}}, {"fixed": [(1, 2, 3, 4)]}, {"fixed": [(1e9, 0)]},
        {"threads": 0}, {"min_angle": 80}, {"lattice": "bcc"}, {"labels": FLAT[:-1]}, {"mask": np.zeros((3, 4, 5))},
        {"potential": np.full(FLAT.shape, 7.0)}, {"crop": ((5, 5), (0, 3))},
    ],
    ids=str,
)
def test_values_out_of_range_are_input_errors_in_keywords(keywords: dict) -> None:
    with pytest.raises(am.InputError) as refusal:
        am.mesh(FLAT, **{"size": 8, **keywords})
    assert str(refusal.value) and "--" not in str(refusal.value)


def test_values_of_other_types_are_type_errors_or_input_errors() -> None:
    for keywords in ({"size": object()}, {"seed": "x"}, {"fixed": 3}, {"progress": 3}, {"strict": "yes"}):
        with pytest.raises((TypeError, am.InputError)):
            am.mesh(FLAT, **keywords)


def test_errors_are_what_python_has_too(tmp_path: Path) -> None:
    for error, base in [
        (am.InputError, ValueError), (am.FileError, OSError), (am.MemoryForecastError, MemoryError), (am.Cancelled, Exception),
    ]:
        assert issubclass(error, am.Error) and issubclass(error, base) and error.__module__ == "atomesh"
    with pytest.raises(am.FileError, match="missing.npy: cannot be read") as caught:
        am.read(tmp_path / "missing.npy")
    assert caught.value.errno == errno.ENOENT and caught.value.filename == str(tmp_path / "missing.npy")
    assert str(caught.value).startswith(str(tmp_path))
    with pytest.raises(am.FileError, match="missing.npy"):
        am.mesh(tmp_path / "missing.npy")
    with pytest.raises(am.FileError):
        am.read_mesh(tmp_path / "missing.vtu")
    (tmp_path / "broken.npy").write_bytes(b"\x93NUMPY nonsense")
    with pytest.raises(am.InputError, match="broken.npy"):
        am.read(tmp_path / "broken.npy")
    with pytest.raises(am.MemoryForecastError):
        am.mesh(np.zeros((600, 600, 600), np.uint8), size=1)
    with pytest.raises(am.FileError) as caught:
        am.mesh(FLAT, size=8).write(tmp_path / "no folder" / "m.vtu")
    assert caught.value.errno == errno.ENOENT
    with pytest.raises(am.InputError, match="extension|format"):
        am.mesh(FLAT, size=8).write(tmp_path / "m.nonsense")
    assert [path.name for path in tmp_path.iterdir()] == ["broken.npy"]


def test_warnings_have_categories_and_strict_makes_them_errors() -> None:
    assert issubclass(am.AtomeshNote, am.AtomeshWarning) and issubclass(am.AtomeshWarning, UserWarning)
    plain = np.zeros((30, 30))
    with pytest.warns(am.AtomeshWarning, match="no features") as caught:
        mesh = am.mesh(plain, size=8)
    assert caught[0].filename == __file__
    assert any("no features" in note for note in mesh.notes)
    with pytest.raises(am.Error, match="no features"):
        am.mesh(plain, size=8, strict=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(am.AtomeshWarning):
            am.mesh(plain, size=8)
    line = np.full((40, 60), 200, np.uint8)
    line[20] = 10
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        am.mesh(line, size=8, strict=True)


def segy() -> bytes:
    """Five traces of 20 samples, 4 ms apart, without coordinates."""
    head = bytearray(3600)
    head[3216:3218], head[3220:3222], head[3224:3226] = (n.to_bytes(2, "big") for n in (4000, 20, 5))
    for number in range(1, 6):
        trace = bytearray(240)
        trace[114:116], trace[116:118] = (n.to_bytes(2, "big") for n in (20, 4000))
        trace[188:192], trace[192:196] = (n.to_bytes(4, "big") for n in (1, number))
        head += trace + np.arange(20, dtype=">f4").tobytes()
    return bytes(head)


def test_read_says_what_it_took_for_granted(tmp_path: Path) -> None:
    np.arange(600, dtype="<f4").tofile(tmp_path / "x.raw")
    img = am.read(tmp_path / "x.raw", shape=(30, 20), dtype="float32", spacing=(0.5, 2), byte_order="little")
    assert img.shape == (30, 20) and img.spacing == (0.5, 2.0)
    np.testing.assert_array_equal(img.array, np.arange(600, dtype="f4").reshape(20, 30))
    assert isinstance(img.notes, list)
    (tmp_path / "x.segy").write_bytes(segy())
    with pytest.warns(am.AtomeshNote, match="sample interval"):
        img = am.read(tmp_path / "x.segy")
    assert img.shape == (5, 20) and img.spacing == (1.0, 4.0)
    assert any("sample interval" in note for note in img.notes) and any("crosslines 1 to 5" in note for note in img.notes)
    colour = np.zeros((4, 5, 3), np.uint8)
    colour[..., 0] = 200
    (tmp_path / "x.ppm").write_bytes(b"P6 5 4 255\n" + colour.tobytes())
    assert set(np.unique(am.read(tmp_path / "x.ppm", meaning="labels", labels_by_color=True).array)) == {1}
    with pytest.raises(am.InputError, match="meaning"):
        am.read(tmp_path / "x.ppm", meaning="colour")


def dicom(series: int, height: int) -> bytes:
    """A slice of 2 × 1 samples, its elements alone."""
    elements = [
        (8, 0x60, b"CS", b"CT"),
        (0x20, 0x0E, b"UI", b"1.%d\0" % series),
        (0x20, 0x32, b"DS", b"0\\0\\%d " % height),
        (0x20, 0x37, b"DS", b"1\\0\\0\\0\\1\\0 "),
        (0x28, 0x10, b"US", b"\1\0"),
        (0x28, 0x11, b"US", b"\2\0"),
        (0x28, 0x30, b"DS", b"1\\1 "),
        (0x28, 0x100, b"US", b"\x10\0"),
    ]
    data = b"".join(
        group.to_bytes(2, "little") + element.to_bytes(2, "little") + kind + len(value).to_bytes(2, "little") + value
        for group, element, kind, value in elements
    )
    return data + b"\xe0\x7f\x10\0OW\0\0\4\0\0\0" + bytes([series, 0, height, 0])


def test_one_of_several_dicom_series_is_read(tmp_path: Path) -> None:
    for series in (1, 2):
        for height in (0, 3):
            (tmp_path / f"s{series}-{height}").write_bytes(dicom(series, height))
    with pytest.raises(am.InputError, match="several series"):
        am.read(tmp_path)
    with pytest.warns(am.AtomeshNote, match="preamble"):
        img = am.read(tmp_path, series="1.2")
    assert img.shape == (2, 1, 2) and img.spacing == (1.0, 1.0, 3.0)
    np.testing.assert_array_equal(img.array.ravel(), [2, 0, 2, 3])
    assert any("series 1.2" in note for note in img.notes)


def test_options_are_generated_from_the_command() -> None:
    made = subprocess.run([sys.executable, TESTS.parent / "tools" / "make_options.py", "--check"], capture_output=True, text=True)
    assert made.returncode == 0, f"run tools/make_options.py again: {made.stderr}"


def test_every_keyword_has_a_type_and_no_other_has() -> None:
    keys = set(am.MeshOptions.__annotations__)
    for base in am.MeshOptions.__mro__ if hasattr(am.MeshOptions, "__mro__") else ():
        keys |= set(getattr(base, "__annotations__", {}))
    assert keys == set(_atomesh.option_names())
    assert set(am.OutputOptions.__annotations__) | {"output"} == set(_atomesh.option_names(["output"]))
    assert set(am.FeatureOptions.__annotations__) < set(_atomesh.option_names(["features"]))


def test_typed_examples_run() -> None:
    made = subprocess.run([sys.executable, "-W", "ignore", TESTS / "typing_examples.py"], capture_output=True, text=True, timeout=60)
    assert made.returncode == 0, made.stderr


@pytest.mark.parametrize(
    "arguments",
    [["mypy", "--strict", "tests/typing_examples.py"], ["mypy", "--strict", "-p", "atomesh"], ["mypy.stubtest", "atomesh._atomesh"]],
    ids=["examples", "package", "stubs"],
)
def test_types_are_right(arguments: list[str]) -> None:
    pytest.importorskip("mypy", reason="mypy is not installed: pip install mypy")
    config = "--mypy-config-file" if arguments[0] == "mypy.stubtest" else "--config-file"
    command = [sys.executable, "-m", *arguments, config, "pyproject.toml"]
    made = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=TESTS.parent)
    assert made.returncode == 0, made.stdout + made.stderr


def test_python_m_runs_the_command() -> None:
    made = python("import sys; sys.argv[1:] = ['--version']; from atomesh._command import main; main()")
    assert made.returncode == 0 and made.stdout.split() == ["atomesh", am.__version__]
