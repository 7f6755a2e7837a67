"""Runs one program in its own process, with a time limit, and says what it took."""

import json
import os
import signal
import subprocess
import tempfile
import threading
import time

# One thread unless a program is told otherwise on its command line.
SINGLE = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
TIDY = {"PYTHONDONTWRITEBYTECODE": "1"}


def run(command, limit, environment=None):
    """Runs `command` for at most `limit` seconds.

    Returns its wall and CPU seconds and its peak memory in bytes, of the whole process and the programs that
    it ran (wait4), and what it said last as JSON, which goes before; or {"error": why}.
    """
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.perf_counter()
        process = subprocess.Popen(
            [str(part) for part in command], stdin=subprocess.DEVNULL, stdout=out, stderr=err,
            env={**os.environ, **SINGLE, **TIDY, **(environment or {})},
            start_new_session=True,  # so that the limit ends what it has started, too
        )
        late = threading.Event()

        def end():
            late.set()
            os.killpg(process.pid, signal.SIGKILL)

        timer = threading.Timer(limit, end)
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        timer.cancel()
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if late.is_set():
            return {"error": f"not done in {limit} s"}
        if process.returncode != 0:
            return {"error": reason(process.returncode, last_line(err))}
        figures = {"wall": wall, "cpu": usage.ru_utime + usage.ru_stime, "peak": usage.ru_maxrss * 1024}
        answer = last_line(out)
        if answer.startswith("{"):
            figures.update(json.loads(answer))
        return figures


def reason(code, line):
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    return f"failed: {line[:120]}" if line else f"failed with exit code {code}"


def last_line(file):
    file.seek(0)
    lines = file.read().decode(errors="replace").strip().splitlines()
    return lines[-1].strip() if lines else ""
