"""The motion of a scene as the page draws it: samples, modes, events, and the reason where it ends early."""

from contextlib import suppress
from time import monotonic
from typing import Any

import numpy as np

from asympk.errors import AsympkError, InputError, Unfinished, UnknownName
from asympk.methods import solve
from asympk.path import Path
from asympk.pictures.paths import logarithmic_from, shade
from asympk.pictures.trace import sampled_modes
from asympk.scene import Scene
from asympk.scenes.turned import turned

SAMPLES, SAMPLES_OF_DRAFT = 800, 300
FINER, PART = 4, 0.01  # times the samples where the line over every second one misses others by this part of its range
QUICK, LONGEST = 2, 25  # seconds: samples that took longer are not refined, and steps end: to sample them takes as long
TOLERANCE_OF_DRAFT = 1e-6
NONDIMENSIONAL = " (these numbers are nondimensional)"  # of a physical rod, of which all others on the page are not
BEFORE = 1 - 2.0**-40  # a motion that stops is drawn up to this part of the time at which it stops


def motion(scene: Scene, draft: bool = False) -> dict[str, Any]:
    """Return samples by quantity, modes, events and model of the motion; ``stopped`` says why it ends early, or "".

    A ``draft``, made while the start is dragged, has fewer samples, and LSODA at 1e-6 where there is no closed form.
    Raises ``InputError`` for a scene that cannot be followed at all.
    """
    path, stopped = _followed(scene, draft)
    if path is None:
        return {"stopped": stopped, "modes": []}
    path = path.physical() if scene.rod is not None else path
    begin = monotonic()
    with np.errstate(all="ignore"):  # a quantity in its own unit may be beyond the doubles
        pieces = [piece for _, piece in sampled_modes(path, SAMPLES_OF_DRAFT if draft else SAMPLES)]
        if not draft and monotonic() - begin < QUICK and _is_coarse(pieces):
            pieces = [piece for _, piece in sampled_modes(path, FINER * SAMPLES)]
        return {**_drawn(path, pieces), "stopped": stopped}


def _followed(scene: Scene, draft: bool) -> tuple[Path | None, str]:
    """Return (path, ""), or where the motion stops early (the path so far, or None; the reason)."""
    try:
        return _solved(scene, draft), ""
    except (InputError, UnknownName):
        raise
    except AsympkError as error:
        complaint = f"{type(error).__name__}: {error}" + (NONDIMENSIONAL if scene.rod is not None else "")
        if isinstance(error, Unfinished):
            return error.path, complaint
        if error.t:
            before = float(error.t) * BEFORE
            until = before if scene.rod is None else float(scene.rod.units.moment(before))
            with suppress(AsympkError):
                return _solved(turned(scene, {}, {}, until), draft), complaint
        return None, complaint


def _solved(scene: Scene, draft: bool) -> Path:
    from asympk.affine.run import scene_obstacle

    if scene.system is None or scene_obstacle(scene) is None:
        return solve(scene)
    return solve(scene, "lsoda", rtol=TOLERANCE_OF_DRAFT) if draft else solve(scene, seconds=LONGEST)


def _is_coarse(pieces: list[np.ndarray]) -> bool:
    """Return whether the samples of ``sampled_modes`` are too few to be joined by straight lines."""
    values = np.concatenate(pieces, axis=1)[1:]
    ranges = np.ptp(values, axis=1)
    return any(np.abs(v[1::2] - np.interp(piece[0, 1::2], piece[0, ::2], v[::2])).max(initial=0) > PART * size
               for piece in pieces for v, size in zip(piece[1:], ranges, strict=True) if np.isfinite(size))


def _drawn(path: Path, pieces: list[np.ndarray]) -> dict[str, Any]:
    names = [*path.names, *(name for name, _ in path.scene.combinations)]
    t, *values = np.concatenate(pieces, axis=1)
    return {
        "model": path.model,
        "t": _listed(t),
        "states": {name: _listed(v) for name, v in zip(names, values, strict=True)},
        "stretch": {name: logarithmic_from(t, v) for name, v in zip(names, values, strict=True)},
        "modes": [{"name": mode, "from": begin, "to": end, "shade": [round(255 * part) for part in shade(mode)]}
                  for mode, begin, end in path.spans],
        "events": [{"kind": event.kind, "t": float(event.t), "state": _listed(_with(path, event.state))}
                   for event in path.events],
        "final": _listed(_with(path, path.final)),
    }


def _with(path: Path, state: tuple) -> np.ndarray:
    """Return a state followed by its combinations."""
    values = [*map(float, state)]
    return np.array([*values, *(np.dot(weights, values) for _, weights in path.scene.combinations)], dtype=float)


def _listed(values: np.ndarray) -> list[float | None]:
    """Return numbers as JSON can hold them, with None for each that is not finite."""
    return [v if finite else None for v, finite in zip(values.tolist(), np.isfinite(values).tolist(), strict=True)]
