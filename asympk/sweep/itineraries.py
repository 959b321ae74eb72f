"""Itineraries as numbers: the phase of every friction at the start, then the events, in letters of a few bits each.

The letter of a phase is its index in ``PHASES`` plus 1; the letter of an event encodes its kind and its friction. No
letter is 0. Of an itinerary that is too long for 62 bits, only the first events are encoded.
"""

from dataclasses import dataclass

import numpy as np

from asympk import path
from asympk.errors import InputError
from asympk.many import PHASES

KINDS = (*path.KINDS, "lift_off", "touch_down")
_BITS = 62


@dataclass(frozen=True)
class Alphabet:
    """The letters for a number of ``frictions``; ``open`` tells whether one may be open, or ``closed``."""

    frictions: int = 1
    open: bool = False

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of events that occur."""
        return KINDS if self.open else path.KINDS

    @property
    def bits(self) -> int:
        """The bits of a letter."""
        return max(1, len(self.kinds) * self.frictions).bit_length()

    @property
    def longest(self) -> int:
        """The largest number of encoded events; raises ``InputError`` where so many frictions leave room for none."""
        left = _BITS // self.bits - self.frictions
        if left < 1:
            raise InputError(f"the itineraries of {self.frictions} frictions do not fit; set itineraries = false")
        return left

    def codes(self, first: np.ndarray, count: np.ndarray, kind: np.ndarray, friction: np.ndarray) -> np.ndarray:
        """Return the itineraries of trajectories as numbers.

        ``first`` (frictions, n) are indices in ``PHASES``, and ``count`` (n,) the numbers of events. ``kind`` and
        ``friction`` list the events of all trajectories, one trajectory after the other.
        """
        found, width = np.zeros(count.size, "<u8"), np.uint64(self.bits)
        for phase in first:
            found = found << width | (phase + np.uint64(1))
        letters, begin = self._letters(kind, friction), np.cumsum(count) - count
        for n in range(min(self.longest, int(count.max(initial=0)))):
            rows = np.flatnonzero(count > n)
            found[rows] = found[rows] << width | letters[begin[rows] + n]
        return found

    def _letters(self, kind, friction):
        """Return the letters of events; kinds are distinguished by their initials, as comparing whole words is slow."""
        if not kind.size:
            return np.zeros(0, dtype=np.uint64)
        initials = np.ascontiguousarray(kind).view(np.uint32).reshape(kind.size, -1)[:, 0]
        place = sum((initials == ord(word[0])) * np.uint64(k) for k, word in enumerate(self.kinds, start=1))
        return place + np.uint64(len(self.kinds)) * np.asarray(friction, dtype=np.uint64)

    def words(self, code: int) -> str:
        """Return an itinerary in words; raises ``ValueError`` or ``IndexError`` for a number that encodes none.

        Three dots follow as many events as can be encoded, as there may be more.
        """
        code, mask = int(code), (1 << self.bits) - 1
        letters = [(code >> place & mask) - 1 for place in reversed(range(0, code.bit_length(), self.bits))]
        if len(letters) < self.frictions or -1 in letters:
            raise ValueError("an itinerary does not begin with what every friction does")
        phases = "+".join(PHASES[k] for k in letters[:self.frictions]) or "smooth"
        events = [*map(self._event, letters[self.frictions:])]
        if len(events) == self.longest:
            events.append("...")
        return f"{phases}: {', '.join(events)}" if events else phases

    def _event(self, letter):
        friction, kind = divmod(letter, len(self.kinds))
        if friction >= self.frictions:
            raise ValueError("an event of a friction that does not exist")
        return f"{self.kinds[kind]} {friction}" if self.frictions > 1 else self.kinds[kind]
