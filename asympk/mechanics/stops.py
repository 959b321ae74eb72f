r"""Whether friction that depends on the sliding velocity lasts until the contact stops within a jump (Lemma 18).

Let m = |G_NT|, and let B be the bound of friction at the speed w. As gamma falls in the jump, the contact is pressed in
at the rate u = -g', which is 0 at the start,

    du/dw = -(B m - G_NN) / (B G_TT - m).

The contact stops if B G_TT > m and u > 0 at all speeds below that of the start. It slides on where u returns to 0.
The integral is computed at many places at once, by Gauss's rule on panels that are halved until u is known on each.
"""

from collections.abc import Callable, Mapping
from typing import Any

import sympy as sp

from asympk.errors import NotDerivable
from asympk.symbolic.truth import Evaluated, array_function

RTOL = 1e-10  # the error of u on a panel, relative to m |gamma| / G_TT, beyond which u never grows
POINTS = 6  # on a panel
PANELS = 64  # of equal length at first: a dip of B that is narrower than gamma/1000 may lie between their points
NEAREST = 1e-12  # the least speed, and the shortest panel, relative to gamma: at rest B may have another value
BATCH = 128  # places at once
MOST_PANELS = 2**18  # of a batch, not known yet


class Stops(Evaluated):
    """The condition that a contact stops, of B as a Lambda of gamma, and of gamma, G_NN, |G_NT| and G_TT."""

    def at(self, numbers: Mapping[sp.Symbol, Any]) -> Any:
        """Tell whether the contact stops at numbers or arrays; arrays give an array of booleans.

        Raises ``NotDerivable`` where B changes too often on the way to rest.
        """
        import numpy as np

        law, *rest = self.args
        used = tuple(sorted(self.free_symbols, key=str))
        bound = array_function(law.expr, (*law.variables, *used))
        places = [np.asarray(numbers[s], dtype=float) for s in used]
        values = np.array(np.broadcast_arrays(*array_function(sp.Tuple(*rest), used)(*places), *places))
        columns = values.reshape(len(values), -1)
        parts = (columns[:, k: k + BATCH] for k in range(0, columns.shape[1], BATCH))
        return np.array([stop for part in parts for stop in _stop(bound, part)], bool).reshape(values.shape[1:])


def _stop(bound: Callable[..., Any], columns: Any) -> list[bool]:
    """Tell for columns (gamma, G_NN, |G_NT|, G_TT, parameters of B) whether u stays positive down to rest."""
    import numpy as np

    falls = (columns[0] != 0) & (columns[2] > 0)
    shares = np.array([*np.arange(PANELS, 1, -1) / PANELS, *np.geomspace(1 / PANELS, NEAREST, 12)])  # B may be steep
    k = np.repeat(np.flatnonzero(falls), len(shares) - 1)
    ends = np.tile([shares[:-1], shares[1:]], falls.sum())
    gains, _ = _gains(bound, columns, falls, k, ends)
    known = [(k[:0], gains[:0], gains[:0])]
    while k.size:
        if k.size > MOST_PANELS:
            raise NotDerivable("friction changes too often as the contact slows down, and so it is not known whether "
                               "it stops; follow the elastic contact")
        middle = ends.mean(axis=0)
        twice, halves = np.tile(k, 2), np.hstack([[ends[0], middle], [middle, ends[1]]])
        parts, least = _gains(bound, columns, falls, twice, halves)
        error = np.abs(parts.reshape(2, -1).sum(axis=0) - gains) + least.reshape(2, -1).sum(axis=0)
        again = np.tile(falls[k] & (error > RTOL) & (ends[0] - ends[1] > NEAREST), 2)
        known.append((twice[~again], -halves[1, ~again], parts[~again]))
        k, ends, gains = twice[again], halves[:, again], parts[again]
    k, left, gains = map(np.concatenate, zip(*known, strict=True))
    order = np.lexsort((left, k))
    paths = np.split(gains[order], np.searchsorted(k[order], np.arange(1, falls.size)))
    return [bool(fell and path.cumsum().min() > 0) for fell, path in zip(falls, paths, strict=True)]


def _gains(bound: Callable[..., Any], columns: Any, falls: Any, k: Any, ends: Any) -> tuple[Any, Any]:
    """Return the gain of u over m |gamma| / G_TT on panels of the places ``k``, and its size beside a least u, else 0.

    ``ends`` are the shares of gamma that are left where the panels begin and end. ``falls`` is unset where gamma does
    not fall further.
    """
    import numpy as np

    slip, normal, mixed, tangential, *parameters = columns[:, k]
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    length = (ends[0] - ends[1]) / 2
    speeds = slip * (ends[0] - length * (1 + points[:, np.newaxis]))
    B = bound(speeds, *(np.broadcast_to(value, speeds.shape) for value in parameters))
    fall = B * tangential / mixed - 1
    falls[k[(fall <= 0).any(axis=0)]] = False
    rates = (B - normal / mixed) * tangential / mixed / np.where(fall > 0, fall, np.inf)
    least = ((rates[:-1] <= 0) & (rates[1:] > 0)).any(axis=0)
    return length * (weights @ rates), length * (weights @ np.abs(rates)) * least
