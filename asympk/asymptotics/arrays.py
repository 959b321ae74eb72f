"""The asymptotic models of the Painlevé-Klein system for arrays of starts and parameters: final states and errors.

Starts with the same itineraries are expanded together. An itinerary depends on signs alone: ``_groups`` follows the
first remaining start and groups with it all starts for which every sign that decides its itinerary is the same.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from asympk.asymptotics import composite
from asympk.asymptotics.models import ARRAYS, itineraries_for, line_of, order_taken
from asympk.asymptotics.validity import validity_conditions
from asympk.errors import AsympkError, OutOfRange
from asympk.numbers import require_finite
from asympk.shown import Card, ShownAsTable
from asympk.systems.painleve_klein.arrays.inputs import ORDER, scene_columns

CHUNK = 1 << 15


@dataclass(frozen=True, repr=False, eq=False)
class FinalStates(ShownAsTable):
    """Final states and their predicted errors, relative to the largest of 1, |x|, |z|.

    ``final`` has the shape (3, ...), ``error`` and ``reason`` the broadcast shape (...). Where the model does not hold,
    ``final`` and ``error`` are inf and ``reason`` is an index into the messages ``reasons``; elsewhere it is -1.
    """

    model: str
    final: Any
    error: Any
    reason: Any
    reasons: tuple[str, ...]

    def _card(self):
        known = np.isfinite(self.error)
        rows = [("shape", str(self.error.shape)), ("predicted", f"{known.sum()} of {known.size}")]
        rows += [("largest error", f"{self.error[known].max():.1e}")] if known.any() else []
        return Card(f"Final states by {self.model!r}", (*rows, *(("refused", reason) for reason in self.reasons)))


def solve_many(
    sigma: Any, mu: Any, x: Any, y: Any, z: Any, until: Any, sigma0: Any = None, method: str = "jump", *,
    order: int | None = None,
) -> FinalStates:
    """Return the ``FinalStates`` of ``"jump"``, ``"slow"`` or ``"rigid"`` at ``until`` for arguments that broadcast.

    Raises ``InputError`` and ``OrderError``. For a start at which ``solve`` would raise, ``reason`` names the error.
    """
    order = order_taken(method, order)
    shape, arguments = scene_columns(sigma, mu, x, y, z, until, sigma0)
    for name in "xyz":
        require_finite(name, arguments[name].values)
    size = int(np.prod(shape))
    final, error = np.full((3, size), np.inf), np.full(size, np.inf)
    reason = np.full(size, -1)
    reasons: dict[str, int] = {}
    with np.errstate(all="ignore"):
        for start in range(0, size, CHUNK):
            flat = [arguments[name].array(slice(start, min(start + CHUNK, size))) for name in ORDER]
            for members, itineraries in _groups(method, *flat):
                results = (None, None, [(np.zeros(members.size, bool), itineraries)])
                if not isinstance(itineraries, str):
                    results = _follow(itineraries, order, method == "jump", *(v[members] for v in flat))
                _store(start + members, results, final, error, reason, reasons)
    return FinalStates(method, final.reshape(3, *shape), error.reshape(shape), reason.reshape(shape), tuple(reasons))


def _groups(method, sigma, sigma0, mu, x, y, z, until):
    """Yield (indices, itineraries) of the starts that share their itineraries, or (indices, message) where refused."""
    left = np.arange(sigma.size)
    while left.size:
        agree = np.ones(left.size, bool)

        def sign(values, agree=agree):
            signs = np.sign(np.broadcast_to(values, agree.shape))
            agree &= signs == signs[0]
            return int(signs[0])

        try:
            line = line_of(sigma[left], sigma0[left])
            itineraries = itineraries_for(method, line, (x + y)[left], z[left], sign, "")
        except AsympkError as refused:
            itineraries = f"{type(refused).__name__}: {str(refused).partition(' (')[0]}"
        yield left[agree], itineraries
        left = left[~agree]


def _follow(itineraries, order, layers, sigma, sigma0, mu, x, y, z, until):
    found = composite.composite_motions(itineraries, order, (sigma, sigma0, mu, x, x + y, z), ARRAYS)
    motion, error = composite.chosen(found, layers, until, ARRAYS)
    problems = validity_conditions(itineraries, found, error, line_of(sigma, sigma0), mu, until, ARRAYS)
    named = ((holds, f"{OutOfRange.__name__}: {words}") for holds, words in problems)
    return composite.states(motion, until, ARRAYS), error, named


def _store(at, results, final, error, reason, reasons):
    states, errors, problems = results
    good = np.ones(at.size, bool)
    for holds, words in problems:
        broken = good & ~np.broadcast_to(holds, good.shape)
        if broken.any():
            reason[at[broken]] = reasons.setdefault(words, len(reasons))
        good &= ~broken
    if good.any():
        final[:, at[good]] = [np.broadcast_to(v, good.shape)[good] for v in states]
        error[at[good]] = np.broadcast_to(errors, good.shape)[good]
