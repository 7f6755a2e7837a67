"""What is measured: sections of jobs that do the same work.

A job is a command whose last line may be JSON (child.py); its mesh, if it makes one, is judged by shape.py.
Edge lengths that a peer does not take as such were set so that its mean edge comes out near the others'.
"""

import json
import os
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from .install import BENCH, PEERS, ROOT, Missing

INPUTS, MESHES = PEERS / "inputs", PEERS / "meshes"
RELEASE = ROOT / "target" / "release"
ATOMESH, DRIVER = RELEASE / "atomesh", RELEASE / "bench-driver"
LIMIT = 300  # seconds that a program may take

# Frequency times points per wavelength, 1/s: edges of 75 to 225 m for 1500 to 4500 m/s.
RATE = 20
BP_RATE = 10  # edges of 143 to 479 m for 1429 to 4790 m/s
BP2004 = os.environ.get("ATOMESH_BP2004")  # the model's SEG-Y file
EDGE = 6


@dataclass
class Job:
    work: str
    program: str
    threads: int
    command: list
    environment: dict = field(default_factory=dict)
    dimension: int = 0  # of the mesh it makes; 0 for none
    mesh: str = "-"
    error: str = ""  # why it cannot be run


class Maker:
    """Makes the jobs of one section; a peer that is missing becomes a job that says why."""

    def __init__(self, installer, section):
        self.installer, self.section, self.jobs = installer, section, []

    def mesh(self, ending=""):
        return str(MESHES / f"{self.section}-{len(self.jobs)}{ending}")

    def ours(self, work, program, threads, command, **more):
        self.jobs.append(Job(work, program, threads, command, **more))

    def driver(self, work, program, threads, *arguments, dimension=0):
        path = self.mesh()
        end = ["--mesh", path] if dimension else []
        self.ours(work, program, threads, [DRIVER, *arguments, "--threads", threads, *end], dimension=dimension,
                  mesh=path if dimension else "-")

    def peer(self, work, program, threads, name, *arguments, script=None, dimension=0):
        """`arguments` may hold "MESH" where the mesh's path goes."""
        path = self.mesh()
        job = Job(work, program, threads, [], dimension=dimension, mesh=path if dimension else "-")
        try:
            start = self.installer.command(name)
            scripts = [BENCH / "peers" / f"{script}.py"] if script else []
            job.command = [*start, *scripts, *(path if a == "MESH" else a for a in arguments)]
            job.environment = self.installer.libraries(name)
        except Missing as why:
            job.error = f"missing: {why}"
        self.jobs.append(job)


def energy(make):
    work = "energy and gradient, FCC, d = 8, 256³ samples"
    make.driver(work, "atomesh, lists in hand", 1, "energy", "image", "in-hand", "--evaluations", 40)
    make.driver(work, "atomesh, lists rebuilt", 1, "energy", "image", "rebuilt", "--evaluations", 20)
    make.driver(work, "Algorithm 1 (atomesh, sampled)", 1, "energy", "image", "sampled", "--evaluations", 5)
    return make.jobs


def lammps(make):
    for lists, words, count in (("in-hand", "lists in hand", 10), ("rebuilt", "lists rebuilt", 5)):
        work = f"pair energies and forces, FCC, 10⁶ atoms, {words}"
        make.driver(work, "atomesh", 1, "energy", "crystal", lists, "--evaluations", count)
        for style, skin in (("lj/cut/opt", 0.3), ("lj/cut/opt", 0.5), ("lj/cut", 0.3)):
            make.peer(work, f"LAMMPS {style}, skin {skin} d", 1, "lammps", style, lists, skin, 63, count,
                      script="lammps_pairs")
    return make.jobs


def delaunay(make, dimension):
    kinds = {"random": "random", "jittered": "jittered crystal", "perfect": "perfect crystal"}
    for kind, words in kinds.items():
        work = f"Delaunay {dimension}-D, 10⁶ points, {words}"
        points = INPUTS / f"{kind}-{dimension}.f64"
        for threads in (1, 2):
            make.driver(work, "atomesh", threads, "delaunay", points, "--dimension", dimension, dimension=dimension)
        make.peer(work, "CGAL", 1, "cgal_delaunay", points, dimension, 1, "MESH", dimension=dimension)
        if dimension == 2:
            make.driver(work, "spade", 1, "delaunay", points, "--dimension", 2, "--connector", "spade", dimension=2)
        else:
            make.peer(work, "CGAL with TBB", 2, "cgal_delaunay", points, 3, 2, "MESH", dimension=3)
            make.peer(work, "TetGen", 1, "tetgen_delaunay", points, "MESH", dimension=3)
        if kind == "jittered":
            make.peer(work, "Gmsh", 1, "gmsh", points, dimension, "MESH", script="gmsh_delaunay", dimension=dimension)
    if dimension == 3:
        for threads in (1, 2):
            make.peer("one size in a cube, from its surface", "Gmsh, HXT", threads, "gmsh", 0.015, threads, "MESH",
                      script="gmsh_hxt", dimension=3)
    return make.jobs


def graded(make):
    shape, spacing = (5395, 1911), (12.5, 6.25)
    models = [(f"graded triangles, velocities of {shape[1]} × {shape[0]} samples", INPUTS / "velocity.f32", RATE)]
    if BP2004:
        models.append(("BP 2004 at 5 points a wavelength of 2 Hz", INPUTS / "bp2004.f32", BP_RATE))
    for work, path, rate in models:
        for threads in (1, 2):
            make.driver(work, "atomesh", threads, "graded", path, "--shape", *shape, "--spacing", *spacing, "--rate",
                        rate, dimension=2)
        for algorithm, name in ((6, "frontal Delaunay"), (5, "Delaunay")):
            make.peer(work, f"Gmsh, {name}", 1, "gmsh", path, *shape, *spacing, rate, algorithm, "MESH",
                      script="gmsh_graded", dimension=2)
        make.peer(work, "SeismicMesh", 1, "seismicmesh", path, *shape, *spacing, rate, "MESH",
                  script="seismicmesh_graded", dimension=2)
    return make.jobs


def image(make):
    data = os.environ.get("ATOMESH_DATA")
    scan = scanned_image()
    work = f"{'MNI T1' if data else 'synthetic grains'} at d = {EDGE}"
    for threads in (1, 2):
        path = make.mesh(".vtu")
        command = [ATOMESH, "mesh", scan, "-o", path, "--features", "edges", "--size", EDGE, "--threads", threads,
                   "--quiet"]
        make.ours(work, "atomesh, file to VTU", threads, command, dimension=3, mesh=path)
    about = json.loads((INPUTS / "labels.json").read_text())
    labels = [INPUTS / "labels.u8", *about["shape"], about["spacing"][0]]
    peer = partial(make.peer, work, dimension=3)
    peer("nanomesh, every 3rd label", 1, "nanomesh", *labels, 3, "MESH", script="nanomesh_image")
    peer("nanomesh, every label", 1, "nanomesh", *labels, 1, "MESH", script="nanomesh_image")
    for threads in (1, 2):
        peer("CGAL Mesh_3", threads, "cgal_image", *labels, 4.5, "no-slivers", threads, "MESH")
        peer("CGAL Mesh_3, slivers left", threads, "cgal_image", *labels, 4.5, "slivers", threads, "MESH")
    peer("pygalmesh", 1, "pygalmesh", *labels, 4.5, "MESH", script="pygalmesh_image")
    peer("Cleaver", 1, "cleaver", *labels, 0.2, "MESH", script="cleaver_image")
    if data:
        for threads in (1, 2):
            path = make.mesh(".vtu")
            figure = Path(data) / "hale2001-fig1-faults.png"
            command = [ATOMESH, "mesh", figure, "-o", path, "--size", 8, "--threads", threads, "--quiet"]
            make.ours("Fig. 1 of Hale (2001) at d = 8", "atomesh, file to VTU", threads, command, dimension=2,
                      mesh=path)
    return make.jobs


def scanned_image():
    """The image to mesh: a brain where ATOMESH_DATA has one, else grains that `atomesh synth` draws."""
    data = os.environ.get("ATOMESH_DATA")
    return Path(data) / "mni152-t1.nii.gz" if data else INPUTS / "grains.nii.gz"


SECTIONS = {
    "energy": energy,
    "lammps": lammps,
    "delaunay3": partial(delaunay, dimension=3),
    "delaunay2": partial(delaunay, dimension=2),
    "graded": graded,
    "image": image,
}
