"""The least model that a scene needs: the ladder rigid < slow < jump order 0 < jump order 1 < exact.

Each rung predicts its own error at ``until``, from the first terms it omits; the least model is the lowest rung whose
prediction is below the tolerance. That the prediction bounds the true error is measured, against the exact flow.
"""

from dataclasses import asdict, dataclass, replace
from time import perf_counter

from asympk.errors import AsympkError, InputError
from asympk.methods import solve, solve_many
from asympk.shown import Card, ShownAsTable

LADDER = {
    "rigid": ("rigid", {}),
    "slow": ("slow", {"order": 1}),
    "jump-0": ("jump", {"order": 0}),
    "jump-1": ("jump", {"order": 1}),
    "exact": ("exact", {}),
}
REFERENCE_DIGITS = 30
DOUBLES = 2e-15  # what the exact flow is held to in doubles, relative to the largest of 1, |x|, |z| on the path
_REPEATS = 5


@dataclass(frozen=True)
class Rung:
    """One model on the ladder; errors are relative to the largest of 1, |x|, |z| at ``until``.

    ``cost`` is its time as a multiple of the exact flow's in the same run. Where the model does not apply,
    ``reason`` says why and the numbers are None.
    """

    model: str
    predicted: float | None
    measured: float | None = None
    cost: float | None = None
    reason: str = ""

    @property
    def told(self) -> str:
        """The rung in words: its errors and its cost, or why it does not apply."""
        if self.predicted is None:
            return self.reason
        numbers = {"predicted": self.predicted, "measured": self.measured}
        words = [f"{name} {value:.1e}" for name, value in numbers.items() if value is not None]
        return ", ".join([*words, f"cost {self.cost:.2g}"] if self.cost else words)


@dataclass(frozen=True, repr=False)
class Ladder(ShownAsTable):
    """The least model at a tolerance, the error it predicts, and every rung of the ladder, lowest first."""

    model: str
    predicted: float
    rtol: float
    rungs: tuple[Rung, ...]

    def _card(self) -> Card:
        return Card(f"Least model for an error below {self.rtol:g}: {self.model}",
                    tuple((rung.model, rung.told) for rung in self.rungs))  # fmt: skip

    def as_dict(self):
        """Return the ladder as plain dictionaries, for JSON."""
        return asdict(self)


def least_model(scene, rtol=1e-3):
    """Climb the ladder for ``scene``; return the ``Ladder`` with the lowest rung that predicts an error below ``rtol``.

    Raises ``InputError`` for an rtol that is not a positive number, or below what doubles hold.
    """
    rtol = _tolerance(rtol)
    reference = solve(scene, digits=REFERENCE_DIGITS).final
    rungs = [_measured(rung, scene, reference) for rung in predictions(scene)]
    unit = rungs[-1].cost
    rungs = tuple(replace(rung, cost=rung.cost and rung.cost / unit) for rung in rungs)
    chosen = lowest(rungs, rtol)
    return Ladder(chosen.model, chosen.predicted, rtol, rungs)


def predictions(scene):
    """Return every rung with its predicted error, or the reason why it does not apply; nothing is measured."""
    return tuple(_predicted(name, scene) for name in LADDER)


def lowest(rungs, rtol):
    """Return the lowest rung that predicts an error below ``rtol``."""
    return next(rung for rung in rungs if rung.predicted is not None and rung.predicted < rtol)


def atlas(sigma, mu, x, y, z, until, rtol=1e-3, sigma0=None, progress=None):
    """Map the least model over parameters and starts that broadcast: an array of rung numbers, 0 for ``"rigid"``.

    Plane by plane: give two of the arguments as ``a[:, None]`` and ``b[None, :]``. ``progress`` is called with the
    share of the ladder that is climbed. The names of the rungs are the keys of ``LADDER``, in order.
    """
    import numpy as np

    rtol = _tolerance(rtol)
    given = np.broadcast_arrays(sigma, mu, x, y, z, until, sigma if sigma0 is None else sigma0)
    flat = [np.asarray(v).ravel() for v in given]
    found = np.full(flat[0].size, len(LADDER) - 1, dtype=np.int8)
    left = np.arange(found.size)
    for rung, (method, options) in enumerate(list(LADDER.values())[:-1]):
        if progress:
            progress(rung / len(LADDER))
        enough = solve_many(*(v[left] for v in flat), method=method, **options).error < rtol
        found[left[enough]] = rung
        left = left[~enough]
    return found.reshape(given[0].shape)


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
    return replace(rung, measured=_distance(final, reference), cost=_seconds(scene, method, options))


def _distance(final, reference):
    x, _, z = (float(value) for value in reference)
    scale = max(1, abs(x), abs(z))
    return max(abs(float(value - exact)) for value, exact in zip(final[::2], reference[::2], strict=True)) / scale


def _seconds(scene, method, options):
    """Return the median time of a few runs, after one to warm up."""
    times = []
    for _ in range(_REPEATS + 1):
        began = perf_counter()
        solve(scene, method, **options)
        times.append(perf_counter() - began)
    return sorted(times[1:])[_REPEATS // 2]


def _tolerance(rtol):
    try:
        value = float(rtol)
    except (TypeError, ValueError):
        raise InputError(f"rtol = {rtol!r}: it must be a positive number") from None
    if not DOUBLES < value < float("inf"):
        raise InputError(f"rtol = {rtol!r}: it must lie above {DOUBLES}, what doubles hold; use solve(scene, digits=n)")
    return value
