"""Images that tests share, and the command beside the package."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

TESTS = Path(__file__).parent


def faults(height: int = 60, width: int = 80) -> np.ndarray:
    """A flat image with a dark, bent line and a straight one."""
    y, x = np.mgrid[:height, :width]
    bent = abs(y - height / 2 - height / 6 * np.sin(x / 12)) < 1.2
    straight = (abs(x - y / 4 - width / 2) < 1) & (y < height / 2)
    return np.where(bent | straight, 20, 200).astype(np.uint8)


def ball(side: int = 24, radius: float = 7.5) -> np.ndarray:
    """A bright ball in a box with three different sides, beside its middle."""
    z, y, x = np.mgrid[:side, : side + 4, : side + 8]
    inside = (x - side / 2) ** 2 + (y - side / 2 - 1) ** 2 + (z - side / 2 + 1) ** 2 < radius**2
    return np.where(inside, 180, 40).astype(np.uint8)


def labels(shape: tuple[int, ...]) -> np.ndarray:
    """Labels 1 and 2, left and right."""
    made = np.ones(shape, np.uint8)
    made[..., shape[-1] // 2 :] = 2
    return made


def python(code: str, *arguments: object, timeout: float = 60, **more: str) -> subprocess.CompletedProcess[str]:
    """Runs code in a process of its own."""
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout, env={**os.environ, **more})


def command(arguments: Sequence[object]) -> None:
    """Runs the command `atomesh`: the package's entry point."""
    made = subprocess.run(
        [sys.executable, "-m", "atomesh._command", *map(str, arguments)], capture_output=True, text=True, timeout=60
    )
    assert made.returncode == 0, made.stderr


@pytest.fixture
def in_tmp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of the test's own, which it is in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
