"""Progress on a terminal or in a log: how much is done, at which rate, and how long the rest will take."""

import time
from contextlib import suppress

PAUSE = 30  # seconds between two lines of a log


class Steps:
    """Tell ``stream`` in words what a job is at.

    On a terminal one line is rewritten, elsewhere a line is added now and then. The clock is monotonic, so that
    setting the time of day changes nothing.
    """

    def __init__(self, stream, clock=time.monotonic, pause=0.0):
        self._stream, self._clock = stream, clock
        self._live = stream.isatty()
        self._pause = pause if self._live else PAUSE
        self._last, self._written = clock(), False

    def tell(self, line):
        """Write ``line``, unless the last one is too recent."""
        now = self._clock()
        if now - self._last >= self._pause:
            self._last, self._written = now, True
            self._write(f"\r\033[K{line}" if self._live else f"{line}\n")

    def close(self):
        """Clear the line on a terminal."""
        if self._live and self._written:
            self._write("\r\033[K")

    def _write(self, text):
        with suppress(OSError):  # a full disk under the log stops no work
            self._stream.write(text)
            self._stream.flush()


class Meter:
    """Tell ``stream`` how far a job of ``total`` units is, as ``Steps`` does."""

    def __init__(self, total, stream, clock=time.monotonic):
        self._total, self._known, self._done = total, 0, 0
        self._clock = clock
        self._begin = clock()
        self._steps = Steps(stream, clock, pause=0.2)

    def add(self, units, fresh=True):
        """Count ``units`` more as done; those that are not ``fresh`` were there before and tell nothing of the rate."""
        self._done += units
        now = self._clock()
        if not fresh:
            self._known, self._begin = self._done, now
        self._steps.tell(self.line(now))

    def close(self):
        """Clear the line on a terminal."""
        self._steps.close()

    def line(self, now):
        """Return what there is to tell at the time ``now``."""
        fresh = self._done - self._known
        rate = fresh / max(now - self._begin, 1e-9)
        left = duration((self._total - self._done) / rate) if rate else "unknown"
        return f"{self._done:,} of {self._total:,} trajectories, {rate:,.0f} per second, {left} left"


def duration(seconds):
    """Return a time in words: 7 s, 2 min 5 s, 3 h 20 min."""
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60} min"
