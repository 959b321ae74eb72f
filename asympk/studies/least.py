"""The least model that a scene needs: the ladder rigid < slow < jump order 0 < jump order 1 < exact.

Each rung predicts its own error at ``until`` from the first terms that it omits; the least model is the lowest rung
whose prediction is below the tolerance. The true error, against the exact flow, is measured beside each prediction.
``ladder`` makes the rungs; ``least_model`` finds the rung for one scene, and ``atlas`` for many.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, cast

import numpy as np

from asympk.errors import InputError
from asympk.integrators.stepped import UNBOUNDED
from asympk.methods import require_rod_or_system, solve_many
from asympk.numbers import number, require_callback, short
from asympk.scene import require_scene
from asympk.shown import Card, ShownAsTable
from asympk.studies import ladder
from asympk.systems.kernels import kernel_scene
from asympk.systems.painleve_klein.arrays.inputs import scene_columns

LADDER: dict[str, tuple[str, dict[str, Any]]] = {**ladder.ROD, "exact": ("exact", {})}


@dataclass(frozen=True, repr=False)
class Ladder(ShownAsTable):
    """The least model at a tolerance, the error it predicts, and every rung of the ladder, lowest first."""

    model: str
    predicted: float
    rtol: float
    rungs: tuple[ladder.Rung, ...]

    def _card(self) -> Card:
        return Card(f"Least model, the lowest for an error below {self.rtol:g}: {self.model}",
                    tuple((rung.model, rung.in_words) for rung in self.rungs))

    def as_dict(self) -> dict[str, Any]:
        """Return the ladder as plain dictionaries, for JSON."""
        return asdict(self)


def least_model(scene: Any, rtol: float = 1e-3, seconds: float | None = None) -> Ladder:
    """Climb the ladder for ``scene``; return the ``Ladder`` with the lowest rung that predicts an error below ``rtol``.

    The ladder of a system other than the rod is that of ``ladder.rungs``: rigid, slow, jump-0 .. jump-2, exact. For
    such a system no further rung is tried and no error measured after ``seconds``, and each rung says so. Raises
    ``InputError`` if rtol or seconds is not a positive number, or if no model reaches rtol, the exact motion in doubles
    included.
    """
    require_scene(scene, "least_model")
    rtol = _tolerance(rtol)
    allowed = UNBOUNDED if seconds is None else float(number("seconds", seconds, lambda v: v > 0, "positive"))
    inside = kernel_scene(scene)
    rungs = ladder.rungs(inside or scene, UNBOUNDED if inside else allowed)
    enough = [rung for rung in rungs if rung.predicted is not None and rung.predicted < rtol]
    if not enough:
        least = min((rung.predicted for rung in rungs if rung.predicted is not None), default=None)
        advice = "solve(scene, digits=n) may follow it" if least is None else f"give an rtol above {least:.2g}"
        raise InputError(f"rtol = {rtol}: no model is so accurate (exact: {rungs[-1].in_words}); {advice}")
    return Ladder(enough[0].model, cast(float, enough[0].predicted), rtol, rungs)


def atlas(
    sigma: Any = None, mu: Any = None, x: Any = None, y: Any = None, z: Any = None, until: Any = None,
    rtol: float = 1e-3, sigma0: Any = None, progress: Callable[[float], None] | None = None, *, system: Any = None,
    values: Mapping | None = None, start: Mapping | None = None,
) -> Any:
    """Return the least model for parameters and starts that broadcast, as an integer array of rung numbers from 0.

    The array has the shape to which the arguments broadcast. For a map over two of the arguments, give these as
    ``a[:, None]`` and ``b[None, :]``. ``progress`` is called with the finished share of the work. For the rod, the
    names of the rungs are the keys of ``LADDER``, in order. For a ``system`` with ``values`` and ``start``, mappings to
    numbers or arrays, they are the keys of ``ladder.models_below`` and then ``"exact"``. The rung ``"exact"`` means
    that no model suffices; ``solve_many`` shows whether the exact motion exists. Raises ``InputError`` for an rtol as
    ``least_model`` does, and for arguments that are not numbers or do not broadcast.
    """
    rtol = _tolerance(rtol)
    require_callback("progress", progress)
    require_rod_or_system((sigma, mu, x, y, z, sigma0), system, values, start)
    if system is not None:
        values, start = {} if values is None else values, {} if start is None else start
        return ladder.least_places(system, values, start, until, rtol, progress)
    return _least_places(*scene_columns(sigma, mu, x, y, z, until, sigma0), rtol, progress)


def _least_places(shape, columns, rtol, progress):
    """Return the index on ``LADDER`` of the least model of every rod, in the given shape."""
    left = np.arange(int(np.prod(shape)))
    flat: dict[str, Any] = {name: column.array(slice(0, left.size)) for name, column in columns.items()}
    found = np.full(left.size, len(LADDER) - 1, dtype=np.int8)
    for rung, (method, options) in enumerate(list(LADDER.values())[:-1]):
        if progress:
            progress(rung / len(LADDER))
        asked: dict[str, Any] = {"method": method, **options}
        enough = solve_many(**{name: v[left] for name, v in flat.items()}, **asked).error < rtol
        found[left[enough]] = rung
        left = left[~enough]
    return found.reshape(shape)


def _tolerance(rtol):
    value = float(number("rtol", rtol, lambda v: v > 0, "positive"))
    if value <= ladder.DOUBLES:
        raise InputError(f"rtol = {short(rtol)}: it must lie above {ladder.DOUBLES}, what doubles hold; "
                         "use solve(scene, digits=n)")
    return value
