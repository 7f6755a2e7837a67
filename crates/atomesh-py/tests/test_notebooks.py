"""The notebooks run, and what they assert holds: as notebooks where jupytext and nbclient are installed, else as scripts."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = sorted(Path(__file__).resolve().parents[1].joinpath("notebooks").glob("*.py"))
AS_NOTEBOOKS = all(importlib.util.find_spec(name) for name in ("jupytext", "nbclient", "ipykernel"))


def run(path, folder):
    """Runs a notebook in a folder of its own."""
    if AS_NOTEBOOKS:
        import jupytext
        import nbclient

        notebook = jupytext.read(path)
        nbclient.NotebookClient(
            notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
        ).execute()
        return notebook
    environment = os.environ | {"MPLBACKEND": "Agg"}
    subprocess.run([sys.executable, str(path)], cwd=folder, env=environment, check=True, timeout=300)
    return None


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(path, tmp_path):
    for package in re.findall(r"^(?:import|from) (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE):
        pytest.importorskip(package)
    notebook = run(path, tmp_path)
    if notebook is not None:
        shown = [output for cell in notebook.cells for output in cell.get("outputs", []) if output.output_type == "execute_result"]
        assert any("image/png;base64" in output.data.get("text/html", "") for output in shown), "no mesh shows its picture"
    for picture in tmp_path.glob("*.png"):
        assert picture.read_bytes().startswith(b"\x89PNG")


def test_all_four_are_there():
    assert [path.stem for path in NOTEBOOKS] == [
        "coming_from", "fault_slice_to_flow", "micrograph_to_abaqus", "mri_to_conduction"
    ]


def test_a_stale_assertion_fails(tmp_path):
    stale = tmp_path / "stale.py"
    stale.write_text("# %%\nassert 1 + 1 == 3\n", encoding="utf-8")
    with pytest.raises(Exception, match="AssertionError|non-zero"):
        run(stale, tmp_path)
