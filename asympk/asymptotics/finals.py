"""The asymptotic models for arrays of starts and parameters: states at the end, and the error to expect of them.

Starts with the same course are expanded together. ``course_of`` asks only for signs, so a group is found by following
its first member and setting aside those that answer otherwise.
"""

from dataclasses import dataclass
from typing import Any

from asympk.asymptotics import composite
from asympk.asymptotics.models import arrays, checked_order, course_for, line_of
from asympk.errors import AsympkError, InputError

CHUNK = 1 << 15


@dataclass(frozen=True)
class Finals:
    """``final`` (3, ...) and its expected ``error``; inf where ``reason``, an index of ``reasons``, is not -1."""

    final: Any
    error: Any
    reason: Any
    reasons: tuple[str, ...]


def finals(sigma, mu, x, y, z, until, method="jump", order=None, sigma0=None):
    """Return the states at ``until`` for arrays that broadcast, by ``"jump"``, ``"slow"`` or ``"rigid"``."""
    import numpy as np

    order = checked_order(method, order)
    given = [np.asarray(v, dtype=float) for v in (sigma, sigma if sigma0 is None else sigma0, mu, x, y, z, until)]
    if not all(np.isfinite(v).all() for v in given):
        raise InputError("sigma, sigma0, mu, x, y, z, until: they must be finite")
    given = np.broadcast_arrays(*given)
    shape, flat = given[0].shape, [v.ravel() for v in given]
    final, error = np.full((3, flat[0].size), np.inf), np.full(flat[0].size, np.inf)
    reason, reasons = np.full(flat[0].size, -1), {}
    with np.errstate(all="ignore"):
        for start in range(0, flat[0].size, CHUNK):
            part = slice(start, start + CHUNK)
            for members, course in _groups(method, *(v[part] for v in flat)):
                at = start + members
                results = (None, None, [(np.zeros(at.size, bool), course)])
                if not isinstance(course, str):
                    results = _follow(course, order, method == "jump", *(v[at] for v in flat))
                _store(at, results, final, error, reason, reasons)
    return Finals(final.reshape(3, *shape), error.reshape(shape), reason.reshape(shape), tuple(reasons))


def _groups(method, sigma, sigma0, mu, x, y, z, until):
    """Yield (indices, course, or the words that refuse it) for the starts that share a course."""
    import numpy as np

    left = np.arange(sigma.size)
    while left.size:
        agree = np.ones(left.size, bool)

        def sign(values, agree=agree):
            signs = np.sign(np.broadcast_to(values, agree.shape))
            agree &= signs == signs[0]
            return int(signs[0])

        try:
            line = line_of(sigma[left], sigma0[left])
            course = course_for(method, line, (x + y)[left], z[left], sign, "")
        except AsympkError as refused:
            course = f"{type(refused).__name__}: {str(refused).partition(' (')[0]}"
        yield left[agree], course
        left = left[~agree]


def _follow(course, order, layers, sigma, sigma0, mu, x, y, z, until):
    m = arrays()
    found = composite.motions(course, order, 2, (sigma, sigma0, mu, x, x + y, z), m)
    motion, error = composite.chosen(found, layers, until, m)
    return m.pick(motion, until, m), error, composite.checks(course, found, error, until, m)


def _store(at, results, final, error, reason, reasons):
    import numpy as np

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
