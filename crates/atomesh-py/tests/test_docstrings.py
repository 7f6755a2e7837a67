"""Docstrings: each public name has one, and their examples run. What importing costs."""

import doctest
import inspect
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import atomesh as am
from conftest import python


def documented() -> Iterator[tuple[str, object]]:
    """All public names, members of classes too."""
    yield "atomesh", am
    for name in am.__all__:
        thing = getattr(am, name)
        yield name, thing
        if inspect.isclass(thing) and thing.__module__ == "atomesh" and not issubclass(thing, BaseException):
            for member, value in vars(thing).items():
                if not member.startswith("_"):
                    yield f"{name}.{member}", value


NAMES = dict(documented())


def test_every_public_name_is_documented() -> None:
    bare = [name for name, thing in NAMES.items() if name != "__version__" and not (inspect.getdoc(thing) or "").strip()]
    assert bare == []


def test_everything_is_exported_and_sorted() -> None:
    assert am.__all__ == sorted(am.__all__)
    assert all(hasattr(am, name) for name in am.__all__)
    assert am.Mesh.__module__ == "atomesh"


def examples() -> list[tuple[str, doctest.DocTest]]:
    found = []
    for name, thing in NAMES.items():
        text = getattr(thing, "__doc__", None)
        if name != "__version__" and isinstance(text, str) and ">>>" in text:
            found.append((name, doctest.DocTestParser().get_doctest(text, {}, name, name, 0)))
    return found


@pytest.mark.filterwarnings("ignore::atomesh.AtomeshWarning")
@pytest.mark.parametrize(("name", "example"), examples(), ids=lambda value: value if isinstance(value, str) else "")
def test_examples_of_docstrings_run(name: str, example: doctest.DocTest, in_tmp: Path) -> None:
    said: list[str] = []
    failures = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(example, out=said.append)
    assert failures.failed == 0, "".join(said)


def test_main_functions_have_examples() -> None:
    with_examples = {name for name, _ in examples()}
    assert with_examples >= {
        "Image", "Mesh", "Mesh.quality", "Mesh.report", "Mesh.features", "Mesh.clusters", "Mesh.surface", "Mesh.sample", "Mesh.flow", "Mesh.write",
        "Mesh.picture", "Editor", "Lattice", "Surface", "enhance", "lattice", "mesh", "read", "size_field",
    }


def test_importing_takes_fifty_milliseconds_beyond_numpy() -> None:
    code = """
import time, numpy
started = time.perf_counter()
import atomesh
print(1e3 * (time.perf_counter() - started))
"""
    # the least of some: others may be at work
    taken = min(float(python(code).stdout) for _ in range(4))
    assert taken < 50


def test_importing_needs_numpy_alone() -> None:
    code = """
import sys, numpy
before = set(sys.modules)
import atomesh
names = {name.partition(".")[0] for name in set(sys.modules) - before}
print(sorted(names - sys.stdlib_module_names - {"numpy", "atomesh"}))
"""
    made = python(code)
    assert made.stdout.strip() == "[]", made.stdout + made.stderr


@pytest.mark.filterwarnings("ignore::atomesh.AtomeshWarning")
def test_the_line_of_progress_ends_and_is_told_apart_by_phases(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    import numpy as np

    from atomesh import _progress

    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    started = time.perf_counter()
    am.mesh(np.eye(60), size=6, progress=True)
    assert time.perf_counter() - started < 30
    err = capsys.readouterr().err
    assert "atomesh: optimize" in err
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    am.mesh(np.eye(60), size=6, progress=True)
    assert "optimize" in capsys.readouterr().err
    assert isinstance(_progress.line(), _progress.Line)
