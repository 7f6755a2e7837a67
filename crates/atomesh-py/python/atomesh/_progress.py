"""A line of progress: by tqdm where it is installed, which knows notebooks, else on standard error."""

import sys
import time
from collections.abc import Callable
from typing import Any, TextIO

from ._atomesh import Event


class Line:
    """Writes phase and share done, on a terminal over and over on one line, elsewhere once a phase."""

    def __init__(self, to: TextIO) -> None:
        self._to = to
        self._phase: str | None = None
        self._said = 0.0

    def __call__(self, event: Event) -> None:
        now = time.monotonic()
        is_new = event.phase != self._phase
        if not self._to.isatty():
            if is_new:
                print(f"atomesh: {event.phase}", file=self._to, flush=True)
        elif is_new or now - self._said > 0.1:
            energy = "" if event.energy is None else f"  energy {event.energy:.6e}"
            print(f"\r\x1b[2K{event.phase:>10} {100 * event.done:3.0f} %{energy}", end="", file=self._to, flush=True)
            self._said = now
        self._phase = event.phase

    def close(self) -> None:
        """Leaves the line empty."""
        if self._to.isatty():
            print("\r\x1b[2K", end="", file=self._to, flush=True)


class Bar:
    """A bar of tqdm's for each phase."""

    def __init__(self, tqdm: Callable[..., Any]) -> None:
        self._tqdm = tqdm
        self._bar: Any = None

    def __call__(self, event: Event) -> None:
        if self._bar is None or self._bar.desc != event.phase:
            self.close()
            self._bar = self._tqdm(total=100, desc=event.phase, leave=False, bar_format="{l_bar}{bar}")
        self._bar.n = 100 * event.done
        self._bar.refresh()

    def close(self) -> None:
        """Takes the bar away."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def line() -> Line | Bar:
    """What `progress=True` calls."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return Line(sys.stderr)
    return Bar(tqdm)
