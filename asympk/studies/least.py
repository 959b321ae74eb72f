"""The least model that a scene needs: the ladder rigid < slow < jump order 0 < jump order 1 < exact.

Each rung predicts its own error at ``until``, from the first terms it omits; the least model is the lowest rung whose
prediction is below the tolerance. That the prediction bounds the true error is measured, against the exact flow.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Any, cast

from asympk.errors import AsympkError, InputError
from asympk.methods import solve, solve_many
from asympk.numbers import number, short
from asympk.scene import require_scene
from asympk.shown import Card, ShownAsTable
from asympk.studies import ladder
from asympk.studies.ladder import Rung
from asympk.systems.kernels import kernel_scene
from asympk.systems.painleve_klein.arrays.inputs import scene_columns

LADDER: dict[str, tuple[str, dict[str, Any]]] = {
    "rigid": ("rigid", {}),
    "slow": ("slow", {"order": 1}),
    "jump-0": ("jump", {"order": 0}),
    "jump-1": ("jump", {"order": 1}),
    "exact": ("exact", {}),
}
REFERENCE_DIGITS = 30
DOUBLES = 2e-15  # what the exact flow is held to in doubles, relative to the largest of 1, |x|, |z| on the path


@dataclass(frozen=True, repr=False)
class Ladder(ShownAsTable):
    """The least model at a tolerance, the error it predicts, and every rung of the ladder, lowest first."""

    model: str
    predicted: float
    rtol: float
    rungs: tuple[Rung, ...]

    def _card(self) -> Card:
        return Card(f"Least model for an error below {self.rtol:g}: {self.model}",
                    tuple((rung.model, rung.in_words) for rung in self.rungs))  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """Return the ladder as plain dictionaries, for JSON."""
        return asdict(self)


def least_model(scene: Any, rtol: float = 1e-3, seconds: float | None = None) -> Ladder:
    """Climb the ladder for ``scene``; return the ``Ladder`` with the lowest rung that predicts an error below ``rtol``.

    The scene of a system that is not the rod has the ladder of ``ladder.rungs``: rigid, slow, jump-0 .. jump-2, exact.
    After so many ``seconds`` its further rungs are not tried, and its errors not measured; each rung says so. Raises
    ``InputError`` for an rtol or seconds that are no positive number, and for an rtol below what doubles hold.
    """
    require_scene(scene, "least_model")
    rtol = _tolerance(rtol)
    allowed = inf if seconds is None else float(number("seconds", seconds, lambda v: v > 0, "positive"))
    if scene.system is not None:
        inside = kernel_scene(scene)
        return least_model(inside, rtol) if inside else _general(scene, rtol, allowed)
    reference = solve(scene, digits=REFERENCE_DIGITS).final
    measured = [_measured(rung, scene, reference) for rung in predictions(scene)]
    unit = measured[-1].cost
    rungs = tuple(replace(rung, cost=rung.cost and rung.cost / unit) for rung in measured)
    return _ladder(rungs, rtol)


def _ladder(rungs: tuple[Rung, ...], rtol: float) -> Ladder:
    chosen = lowest(rungs, rtol)
    return Ladder(chosen.model, cast(float, chosen.predicted), rtol, rungs)


def _general(scene, rtol, allowed):
    rungs = ladder.rungs(scene, allowed)
    if rungs[-1].predicted >= rtol and all(r.predicted is None or r.predicted >= rtol for r in rungs):
        raise InputError(f"rtol = {rtol}: the exact motion predicts {rungs[-1].predicted:.2g}; ask for more")
    return _ladder(rungs, rtol)


def predictions(scene: Any) -> tuple[Rung, ...]:
    """Return every rung with its predicted error, or the reason why it does not apply; nothing is measured."""
    return tuple(_predicted(name, scene) for name in LADDER)


def lowest(rungs: Iterable[Rung], rtol: float) -> Rung:
    """Return the lowest rung that predicts an error below ``rtol``."""
    return next(rung for rung in rungs if rung.predicted is not None and rung.predicted < rtol)


def atlas(
    sigma: Any = None,
    mu: Any = None,
    x: Any = None,
    y: Any = None,
    z: Any = None,
    until: Any = None,
    rtol: float = 1e-3,
    sigma0: Any = None,
    progress: Callable[[float], None] | None = None,
    *,
    system: Any = None,
    values: Mapping | None = None,
    start: Mapping | None = None,
) -> Any:
    """Map the least model over parameters and starts that broadcast: an array of rung numbers, 0 for ``"rigid"``.

    Plane by plane: give two of the arguments as ``a[:, None]`` and ``b[None, :]``. ``progress`` is called with the
    share of the work that is done. The names of the rungs are the keys of ``LADDER``, in order; those of a ``system``
    with ``values`` and ``start``, mappings to numbers or arrays, are the keys of ``ladder.models_below``, and
    ``"exact"``. The array is of whole numbers, of the shape to which the arguments broadcast. Raises ``InputError`` for
    an rtol as ``least_model`` does, and for arguments that are no numbers or do not broadcast.
    """
    rtol = _tolerance(rtol)
    if system is not None:
        return ladder.least_places(system, values or {}, start or {}, until, rtol, progress)
    return _least_places(*scene_columns(sigma, mu, x, y, z, until, sigma0), rtol, progress)


def _least_places(shape, columns, rtol, progress):
    """Return the place on ``LADDER`` of the least model of every rod, in the given shape."""
    import numpy as np

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


def _predicted(name, scene):
    method, options = LADDER[name]
    if method == "exact":
        return Rung(name, DOUBLES)
    try:
        return Rung(name, float(solve(scene, method, **options).error))
    except AsympkError as error:
        return Rung(name, None, reason=f"{type(error).__name__}: {error}")


def _measured(rung, scene, reference):
    """Add the measured error, and the cost in seconds."""
    if rung.predicted is None:
        return rung
    method, options = LADDER[rung.model]
    final = solve(scene, method, **options).final
    return replace(rung, measured=_distance(final, reference), cost=ladder.seconds(scene, method, options))


def _distance(final, reference):
    x, _, z = (float(value) for value in reference)
    scale = max(1, abs(x), abs(z))
    return max(abs(float(value - exact)) for value, exact in zip(final[::2], reference[::2], strict=True)) / scale


def _tolerance(rtol):
    value = float(number("rtol", rtol, lambda v: v > 0, "positive"))
    if value <= DOUBLES:
        raise InputError(f"rtol = {short(rtol)}: it must lie above {DOUBLES}, what doubles hold; "
                         "use solve(scene, digits=n)")  # fmt: skip
    return value
