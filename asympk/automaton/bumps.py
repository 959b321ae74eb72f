"""Which bumps in waves are narrow, in numbers: steps follow those as wide as a wave as they follow the wave.

A bump, a function b of the angles of waves, is narrow if b changes by more than half of its range in 15 degrees of one.
"""

from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from asympk.symbolic.long import atoms, replaced, symbols_in
from asympk.symbolic.lowering import NoFunction, lower

QUARTER = 12  # looks in a quarter turn
NARROW = 2  # looks within which a narrow bump has more than half of its change: 15 degrees
MOST = 3  # angles on which a bump may depend to be looked at


@lru_cache(maxsize=512)
def is_narrow(bump: sp.Expr, angle: sp.Expr, parameters: tuple[sp.Symbol, ...], values: tuple[Any, ...]) -> bool:
    """Tell whether a bump may vary along an ``angle`` of its waves much faster than these do.

    It may, too, if it depends on what is no angle of a wave, or on more than ``MOST`` angles, or if NumPy has no
    finite value of it somewhere.
    """
    found = _over_turns(bump, angle, parameters)
    if found is None:
        return True
    size, compiled = found
    turn = np.arange(4 * QUARTER) * (np.pi / 2 / QUARTER)
    with np.errstate(all="ignore"):
        seen = compiled(*np.ix_(*[turn] * size), *map(float, values))[0]
        change = abs(seen - np.roll(seen, NARROW, axis=0)).max()
        return not 2 * change <= np.ptp(seen)


@lru_cache(maxsize=512)
def _over_turns(bump, angle, parameters):
    """Return (number of angles, the bump as a function of the angles, ``angle`` first, and the parameters), or None."""
    waves = [wave for wave in atoms(bump, sp.sin, sp.cos) if not symbols_in(wave) <= {*parameters}]
    angles = [angle, *sorted({wave.args[0] for wave in waves} - {angle}, key=str)]
    given = sp.symbols(f"given:{len(angles) + len(parameters)}", cls=sp.Dummy, real=True)  # two may have one name
    known = dict(zip((*angles, *parameters), given, strict=True))
    turned = replaced(bump, {wave: wave.func(known[wave.args[0]]) for wave in waves})
    alone = replaced(turned, {parameter: known[parameter] for parameter in parameters})
    if len(angles) > MOST or not symbols_in(alone) <= {*given}:
        return None
    with suppress(NoFunction):
        return len(angles), lower(given, (alone,), target="numpy", branching=True).compiled
    return None
