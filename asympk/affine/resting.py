"""Parameters as states at rest: trajectories that differ in such a parameter p differ in their starts alone.

Its rate is p' = 0. A mode of x' = A x + b p + c is affine in (x, p), so that one decomposition serves for all numbers.
So is one with p cos(w t), the product of a state at rest and a wave, see ``forcing``.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import sympy as sp

from asympk.affine.run import affine
from asympk.numbers import LARGEST
from asympk.symbolic.branches import own_coupling
from asympk.symbolic.long import symbols_in
from asympk.symbolic.system import System
from asympk.symbolic.values import require_declared


def with_resting(
    system: System, columns: Mapping[sp.Symbol, np.ndarray], few: int
) -> tuple[System, dict[sp.Symbol, np.ndarray]]:
    """Return the system with parameters as states at rest, the last of its states, and the columns (rows,) of these.

    Such are those of more than ``few`` numbers, all of them doubles, in which the modes are affine and on which the
    system sets no condition. Raises ``InputError`` for a number against the declaration of its symbol.
    """
    resting = dict[sp.Symbol, np.ndarray]()
    for symbol, column in columns.items():
        varies = _are_doubles(column) and len(np.unique(column)) > few
        if varies and (wider := with_parameter_at_rest(system, symbol)):
            for number in np.unique(column).tolist():
                require_declared(symbol, number, "values: ")
            system, resting[symbol] = wider, column.astype(float)
    return system, resting


def with_parameter_at_rest(system: System, symbol: sp.Symbol) -> System | None:
    """Return the system with a parameter as a state at rest, or None where modes are not affine in it or it is bound.

    Bound are the small parameter and those on which the system sets a condition.
    """
    conditions = (system.assumptions, *(own_coupling(system, friction) for friction in system.frictions))
    if symbol in {system.small} | symbols_in(sp.Tuple(*conditions)):
        return None
    wider = replace(system, slow={**system.slow, symbol: 0}, states=(*system.states, symbol))
    return wider if affine(wider) else None


def _are_doubles(column):
    """Tell whether all numbers of a column are doubles, and no larger than numbers may be."""
    if column.dtype.kind not in "iuf":
        return False
    with np.errstate(all="ignore"):
        rounded = column.astype(float)
        return bool(((abs(rounded) <= LARGEST) & (rounded.astype(column.dtype) == column)).all())
