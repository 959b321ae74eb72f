"""Progress on a terminal or in a log: how much is done, at which rate, and how long the rest will take."""

import time


class Meter:
    """Tell ``stream`` how far a job of ``total`` units is.

    On a terminal one line is rewritten, elsewhere a line is added now and then. The clock is monotonic, so that
    setting the time of day changes nothing.
    """

    def __init__(self, total, stream, clock=time.monotonic):
        self._total, self._known, self._done = total, 0, 0
        self._stream, self._clock = stream, clock
        self._live = stream.isatty()
        self._begin = self._last = clock()

    def add(self, units, fresh=True):
        """Count ``units`` more as done; those that are not ``fresh`` were there before and tell nothing of the rate."""
        self._done += units
        now = self._clock()
        if not fresh:
            self._known, self._begin = self._done, now
        if now - self._last >= (0.2 if self._live else 30):
            self._last = now
            self._write(now)

    def close(self):
        """End the line on a terminal."""
        if self._live and self._last > self._begin:
            self._stream.write("\r\033[K")
            self._stream.flush()

    def _write(self, now):
        self._stream.write(f"\r\033[K{self.line(now)}" if self._live else f"{self.line(now)}\n")
        self._stream.flush()

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
