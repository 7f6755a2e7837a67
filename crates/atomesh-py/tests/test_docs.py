"""What the documents show runs: the blocks of each in order, in one interpreter's names, in a folder of its own."""

import importlib.util
import re
import warnings
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1]
ROOT = PACKAGE.parents[1]
MANUAL = sorted(page for page in (ROOT / "docs").rglob("*.md") if "```python" in page.read_text(encoding="utf-8"))
DOCUMENTS = [*MANUAL, ROOT / "README.md", PACKAGE / "README.md"]
BLOCK = re.compile(r"^```python[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(document):
    """The Python blocks of a document, each with the line that it begins in."""
    text = document.read_text(encoding="utf-8")
    return [(text.count("\n", 0, found.start(1)), found[1]) for found in BLOCK.finditer(text)]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_blocks_run(document, tmp_path, monkeypatch):
    if not document.exists():
        pytest.skip("not in the source tree")
    monkeypatch.chdir(tmp_path)
    found = blocks(document)
    assert found, "no block"
    names = {"__name__": "document"}
    for line, code in found:
        if not all(importlib.util.find_spec(package) for package in re.findall(r"to_(meshio|skfem|pyvista)\(\)", code)):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # empty lines before it, so that errors name the document's line
            exec(compile("\n" * line + code, str(document), "exec"), names)


def test_the_first_picture_is_that_of_the_readme(tmp_path, monkeypatch):
    committed = ROOT / "docs" / "images" / "python-mesh.png"
    if not committed.exists():
        pytest.skip("not in the source tree")
    monkeypatch.chdir(tmp_path)
    (_, code), = blocks(ROOT / "README.md")
    exec(code, {})
    imread = pytest.importorskip("matplotlib.pyplot").imread
    made, shown = imread("mesh.png"), imread(committed)
    assert made.shape == shown.shape
    assert abs(made - shown).mean() < 0.02  # other machines round otherwise


def test_a_false_block_fails(tmp_path):
    document = tmp_path / "false.md"
    document.write_text("text\n\n```python\nassert 1 + 1 == 3\n```\n", encoding="utf-8")
    ((line, code),) = blocks(document)
    assert line == 3
    with pytest.raises(AssertionError):
        exec(code, {})
