"""A line of progress, on a terminal or in a log: how much of a job is done, and how long the rest will take."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Self, TextIO

DELAY = 2  # seconds before anything is shown
REFRESH = 0.2  # seconds between two updates of a line on a terminal
PAUSE = 60  # seconds between two lines of a log


class Meter:
    """Write to ``stream`` which step a job is at, or how many of ``total`` units it has done.

    On a terminal one line is rewritten, from ``DELAY`` seconds on. Elsewhere a line is added every ``PAUSE`` seconds if
    ``log`` is true, else nothing is written. As a context the meter updates itself, in a thread. The clock is
    monotonic, so that setting the time of day has no effect.
    """

    def __init__(
        self, stream: TextIO, total: int | None = None, log: bool = False, clock: Callable[[], float] = time.monotonic
    ):
        self._stream, self._total, self._clock = stream, total, clock
        self._live = stream.isatty()
        self._silent = not (self._live or log)
        self._start = self._begin = self._last = clock()
        self._words = self._shown = ""
        self._known = self._done = 0
        self._lock, self._over = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        if not self._silent:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self._thread.is_alive():
            self._thread.join()
        self.tell("")

    def tell(self, words: str) -> None:
        """Set the words that describe the present step; empty words clear the line."""
        with self._lock:
            self._words = words
            if not words and self._shown:
                self._show("")

    def add(self, units: int, fresh: bool = True) -> None:
        """Count ``units`` more as done; units of an earlier run are not ``fresh`` and do not count for the rate."""
        with self._lock:
            self._done += units
            if not fresh:
                self._known, self._begin = self._done, self._clock()
            self._words = "trajectories"

    def tick(self) -> None:
        """Write the line, if an update is due."""
        with self._lock:
            now = self._clock()
            due = now - self._start >= DELAY if self._live else now - self._last >= PAUSE
            if due and self._words and not self._silent:
                self._last = now
                self._show(self.line(now))

    def line(self, now: float) -> str:
        """Return the progress at the time ``now`` in one line."""
        if self._total is None:
            return f"{self._words}, {duration(now - self._start)}"
        fresh = self._done - self._known
        rate = fresh / max(now - self._begin, 1e-9)
        left = duration((self._total - self._done) / rate) if rate else "unknown"
        return f"{self._done:,} of {self._total:,} {self._words}, {rate:,.0f} per second, {left} left"

    def _run(self):
        while not self._over.wait(REFRESH if self._live else 1):
            self.tick()

    def _show(self, line):
        if line == self._shown:
            return
        self._shown = line
        with suppress(OSError, ValueError):  # a full disk must not stop the job
            self._stream.write(f"\r\033[K{line}" if self._live else f"{line}\n" if line else "")
            self._stream.flush()


def duration(seconds: float) -> str:
    """Return a time in words: 7 s, 2 min 5 s, 3 h 20 min."""
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60} min"
