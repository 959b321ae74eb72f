"""Kvaerno5 of diffrax (ESDIRK of order 5): stepping and root finding are compiled once per mode.

A compiled run cannot be interrupted: the time limit is looked at between modes, and the limit on steps is
the next power of ten, since another one would have to be compiled.
"""

from functools import cache, lru_cache
from time import monotonic

from asympk.automaton.loop import Segment
from asympk.automaton.modes import function, library
from asympk.integrators.integrate import Work, missing


def advance(method, mode, t, state, until, rtol, atol, limits, times):
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``, looking in at ``times``."""
    if limits.steps <= 0 or monotonic() > limits.deadline:
        return Segment(t, state, None, Work(), f"{'step' if limits.steps <= 0 else 'time'} limit reached")
    try:
        import diffrax  # noqa: F401
        import jax
    except ImportError as error:
        raise missing(method) from error
    import numpy as np

    solve = _compiled(mode.mode, 10 ** len(str(limits.steps - 1)))
    early = [v for v in times if v < until]
    padded = np.full(1 << len(early).bit_length(), t)
    padded[len(padded) - len(early):] = early
    with jax.enable_x64(True):
        p, state = (np.array(v, dtype=float) for v in (mode.p, state))
        end, last, seen, accepted, made, hits, ok = (
            np.asarray(v) for v in solve(t, until, state, rtol, atol, p, padded))
    hit = int(np.flatnonzero(hits)[0]) if hits.any() else None
    last = tuple(last.tolist())
    samples = [tuple(w) for v, w in zip(padded.tolist(), seen.tolist(), strict=True) if t < v <= end]
    samples += [last] * (times[-1:] == [until] and hit is None)
    short = "" if ok or hit is not None else _reason(int(made), limits)
    return Segment(float(end), last, hit, Work(0, int(accepted), 0), short, tuple(samples))


def _reason(made, limits):
    return "step limit reached" if made >= limits.steps else "stalled (steps below the spacing of floats)"


@lru_cache(maxsize=24)
def _compiled(mode, max_steps):
    """Return ``solve(t, until, state, rtol, atol, p, ts)`` for a traced mode."""
    import diffrax
    import jax
    import jax.numpy as jnp
    import optimistix

    rates = function(mode.system, mode.rates, "math", _functions())
    guards = function(mode.system, mode.guard_values, "math", _functions())
    count = len(mode.guards)

    def field(t, w, p):
        return jnp.stack([jnp.asarray(v, float) for v in rates(t, *w, *p)])

    def guard(k):
        return lambda t, y, args, **_: guards(t, *y, *args)[k]

    root = optimistix.Newton(rtol=1e-14, atol=1e-14)
    event = diffrax.Event(tuple(map(guard, range(count))), root, (False,) * count) if count else None

    @jax.jit
    def solve(t, until, state, rtol, atol, p, ts):
        saved = diffrax.SaveAt(subs=[diffrax.SubSaveAt(t1=True), diffrax.SubSaveAt(ts=ts)])
        control = diffrax.PIDController(rtol=rtol, atol=atol)
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(field), diffrax.Kvaerno5(), t, until, None, state, p, saveat=saved,
            stepsize_controller=control, event=event, max_steps=max_steps, throw=False)
        made, accepted = found.stats["num_steps"], found.stats["num_accepted_steps"]
        ok = found.result == diffrax.RESULTS.successful
        hits = jnp.stack(found.event_mask) if count else jnp.zeros(0, bool)
        return found.ts[0][0], found.ys[0][0], found.ys[1], accepted, made, hits, ok

    return solve


@cache
def _functions():
    import jax.numpy as jnp

    names = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}
    plain = ("pi", "e", "sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh")
    return library(**{name: getattr(jnp, name) for name in plain}, **{k: getattr(jnp, v) for k, v in names.items()})
