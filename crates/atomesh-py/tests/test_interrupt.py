"""Ctrl-C and callbacks end the work soon, in any phase, and leave the interpreter as it was."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

import atomesh as am
from conftest import ball, faults

FLAT = faults()

# Runs a job in a process of its own; a thread waits until the phase begins, then sends SIGINT to the process. Prints how
# long it took to come back as KeyboardInterrupt, and whether the process can mesh afterwards.
INTERRUPTED = """
import os, signal, sys, threading, time, warnings
import numpy as np
import atomesh as am
warnings.simplefilter("ignore")
phase, folder = sys.argv[1:]
sent = None
entered = threading.Event()

def kill():
    global sent
    entered.wait()
    time.sleep(0.005)  # into the phase
    sent = time.perf_counter()
    os.kill(os.getpid(), signal.SIGINT)

def watch(event):
    if event.phase == phase:
        entered.set()

def once():
    entered.set()

z, y, x = np.indices((84, 84, 84), np.float32)
large = (128 + 100 * np.sin(x / 9) * np.sin(y / 11) * np.sin(z / 13)).astype(np.float32)
options = dict(features="edges", size=3, progress=watch)
killer = threading.Thread(target=kill, daemon=True)
if phase == "read":
    path = os.path.join(folder, "large.nii.gz")
    def job():
        once()
        am.read(path)
elif phase in ("assemble", "solve"):
    mesh = am.mesh(large[:34, :34, :34], size=3, features="none", align="off")
    def job():
        mesh.flow(sides={"xmin": 1.0, "xmax": 0.0}, order=3, progress=watch)
elif phase == "write":
    mesh = am.mesh(large[:48, :48, :48], size=2, features="none", align="off")
    def job():
        for _ in range(200):
            mesh.write(os.path.join(folder, "m.msh"), order=2, msh_text=True, progress=watch)
elif phase == "measure":
    mesh = am.mesh(large[:48, :48, :48], size=2, features="none", align="off")
    def job():
        for _ in range(200):
            once()
            mesh.report()
elif phase == "steps":
    lat = am.lattice(large, size=3)
    def job():
        for step in lat.optimize():
            once()
elif phase in ("lattice.connect", "connected.improve"):
    lat = am.lattice(large[:70], size=2.2)
    made = lat.connect() if phase != "lattice.connect" else None
    def job():
        once()
        for _ in range(200):
            made.improve() if made else lat.connect()
else:
    def job():
        am.mesh(large, **options)
killer.start()
try:
    job()
except KeyboardInterrupt:
    late = time.perf_counter() - sent
    alive = am.mesh(np.eye(40), size=8).cell_count > 0
    for _ in range(100):  # the job ends by itself, and takes its files away
        left = [name for name in os.listdir(folder) if name.startswith(".atomesh")]
        if not left:
            break
        time.sleep(0.05)
    print("interrupted", late, alive, left)
else:
    print("ended by itself", entered.is_set())
"""

PHASES = [
    "read", "potential", "distance", "grow", "optimize", "connect", "improve", "measure", "assemble", "solve", "write", "steps",
    "lattice.connect", "connected.improve",
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A folder with a file that takes time to read."""
    import gzip

    made = tmp_path_factory.mktemp("interrupted")
    head = bytearray(352)
    head[:4] = (348).to_bytes(4, "little")
    head[40:48] = np.array([3, 300, 300, 300], "<i2").tobytes()
    head[70:74] = np.array([16, 32], "<i2").tobytes()
    head[76:92] = np.ones(4, "<f4").tobytes()
    head[108:112] = np.array([352], "<f4").tobytes()
    head[344:348] = b"n+1\0"
    noise = np.random.default_rng(0).normal(size=(30, 300, 300)).astype("<f4").tobytes()
    with gzip.open(made / "large.nii.gz", "wb", compresslevel=0) as file:
        file.write(head)
        for _ in range(10):
            file.write(noise)
    return str(made)


@pytest.mark.skipif(os.name == "nt", reason="SIGINT is sent otherwise on Windows")
@pytest.mark.parametrize("phase", PHASES)
def test_ctrl_c_ends_each_phase_within_a_fifth_of_a_second(phase: str, folder: str) -> None:
    made = subprocess.run([sys.executable, "-c", INTERRUPTED, phase, folder], capture_output=True, text=True, timeout=120)
    words = made.stdout.split()
    assert words[:1] == ["interrupted"], made.stdout + made.stderr
    assert made.returncode == 0 and words[2] == "True", made.stdout + made.stderr
    assert float(words[1]) < 0.2 * load()
    assert words[3] == "[]", made.stdout


def load() -> float:
    """How many processes share a core: with a busy machine all takes longer."""
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def jobs() -> list[tuple[str, Callable[..., object]]]:
    mesh = am.mesh(FLAT, size=5)
    return [
        ("mesh", lambda **how: am.mesh(FLAT, size=5, **how)),
        ("space", lambda **how: am.mesh(ball(), size=4, features="edges", **how)),
        ("voronoi", lambda **how: am.mesh(FLAT, size=5, kind="voronoi", **how)),
        ("enhance", lambda **how: am.enhance(FLAT, "ridges", **how)),
        ("size_field", lambda **how: am.size_field(FLAT, (4, 12), **how)),
        ("lattice", lambda **how: am.lattice(FLAT, 5, **how)),
        ("settle", lambda **how: am.lattice(FLAT, 5).settle(**how)),
        ("flow", lambda **how: mesh.flow(sides={"xmin": 1, "xmax": 0}, **how)),
        ("report", lambda **how: mesh.report(**how)),
        ("write", lambda **how: mesh.write(os.devnull + ".vtu" if os.name == "nt" else "m.vtu", **how)),
    ]


@pytest.mark.parametrize(("name", "job"), jobs(), ids=lambda value: value if isinstance(value, str) else "")
@pytest.mark.filterwarnings("ignore::atomesh.AtomeshWarning")
def test_a_callback_that_says_false_is_asked_no_more(name: str, job: Callable[..., object], in_tmp: object) -> None:
    events: list[am.Event] = []
    job(progress=events.append)
    if not events:
        pytest.skip(f"{name} of this size is one step")
    assert all(0 <= event.done <= 1 and event.phase for event in events)
    for stop_at in {1, len(events) // 2, len(events)} - {0}:
        seen = []

        def stop(event: am.Event) -> bool | None:
            seen.append(event)
            return False if len(seen) == stop_at else None

        with pytest.raises(am.Cancelled):
            job(progress=stop)
        assert len(seen) == stop_at


@pytest.mark.filterwarnings("ignore::atomesh.AtomeshWarning")
def test_what_a_callback_raises_comes_out_as_it_is() -> None:
    class Mine(Exception):
        pass

    def fail(event: am.Event) -> None:
        if event.phase == "optimize":
            raise Mine(event.phase)

    for _ in range(3):
        with pytest.raises(Mine, match="optimize") as caught:
            am.mesh(FLAT, size=5, progress=fail)
        assert caught.traceback[-1].name == "fail"
    assert am.mesh(FLAT, size=5).cell_count > 0


def test_energies_come_with_the_phase_that_lowers_them() -> None:
    events: list[am.Event] = []
    am.mesh(FLAT, size=5, progress=events.append)
    assert {event.phase for event in events} >= {"optimize"}
    assert all((event.energy is not None) == (event.phase == "optimize") for event in events if event.energy is not None)
    assert any(event.energy is not None for event in events)
    assert "Event(phase=" in repr(events[0])


def test_a_callback_may_use_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    made: list[int] = []

    def nested(event: am.Event) -> None:
        if not made:
            made.append(am.mesh(FLAT, size=12, threads=1).cell_count)

    am.mesh(FLAT, size=6, progress=nested, threads=1)
    assert made and made[0] > 0
    am.mesh(FLAT, size=6, progress=True)
    assert "Traceback" not in capsys.readouterr().err


def test_a_callback_may_look_at_the_lattice_that_it_is_called_for() -> None:
    lat = am.lattice(FLAT, 6)
    seen = []
    lat.settle(potential=am.enhance(FLAT), progress=lambda event: seen.append(len(lat)))
    assert seen and min(seen) > 0


def test_steps_of_several_lattices_may_be_taken_in_turn() -> None:
    one, two = am.lattice(FLAT, 8), am.lattice(FLAT, 9)
    pairs = 0
    for _ in zip(one.optimize(threads=1), two.optimize(threads=1), strict=False):
        am.mesh(FLAT, size=14, threads=1)
        pairs += 1
    assert pairs > 1


def test_a_handler_of_signals_runs_while_meshing() -> None:
    """Not only SIGINT: timers of signals too, and what a handler raises ends the work."""
    if not hasattr(signal, "setitimer"):
        pytest.skip("no timers of signals here")

    def ring(*_: object) -> None:
        raise TimeoutError("rang")

    before = signal.signal(signal.SIGALRM, ring)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        started = time.perf_counter()
        with pytest.raises(TimeoutError, match="rang"):
            while time.perf_counter() - started < 20:
                am.mesh(FLAT, size=2)
        assert time.perf_counter() - started < 0.05 + 0.2 * load()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_other_threads_run_while_meshing() -> None:
    ticks, stop = 0, threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not stop.wait(0.001):
            ticks += 1

    thread = threading.Thread(target=tick)
    thread.start()
    started = time.perf_counter()
    am.mesh(FLAT, size=2, threads=1)
    took = time.perf_counter() - started
    stop.set()
    thread.join()
    assert ticks > 10 * took
