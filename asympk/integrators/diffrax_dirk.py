"""Kvaerno5 of diffrax (ESDIRK of order 5): stepping and root finding are compiled once per problem.

A compiled run cannot be interrupted: the time limit is looked at between pieces, and the limit on steps is
the next power of ten, since another one would have to be compiled.
"""

from functools import lru_cache
from time import monotonic

from asympk.integrators.integrate import Leg, Work, missing


def advance(method, piece, t, state, until, rtol, atol, limits, times):
    """Follow ``piece`` from (t, state) until a guard is lost or ``until``, looking in at ``times``."""
    if limits.steps <= 0 or monotonic() > limits.deadline:
        return Leg(t, state, None, Work(), f"{'step' if limits.steps <= 0 else 'time'} limit reached")
    try:
        import diffrax  # noqa: F401
        import jax
    except ImportError as error:
        raise missing(method) from error
    import numpy as np

    problem = piece.problem
    solve = _compiled(problem.rhs, problem.load, problem.drive, 10 ** len(str(limits.steps - 1)))
    early = [v for v in times if v < until]
    padded = np.full(1 << len(early).bit_length(), t)
    padded[len(padded) - len(early):] = early
    with jax.enable_x64(True):
        p, guards, state = (np.array(v, dtype=float) for v in (piece.p, piece.guards, state))
        end, last, seen, accepted, made, hits, ok = (
            np.asarray(v) for v in solve(t, until, state, rtol, atol, (p, guards), padded))
    hit = int(np.flatnonzero(hits)[0]) if hits.any() else None
    last = tuple(last.tolist())
    samples = [tuple(w) for v, w in zip(padded.tolist(), seen.tolist(), strict=True) if t < v <= end]
    samples += [last] * (times[-1:] == [until] and hit is None)
    short = "" if ok or hit is not None else _reason(int(made), limits)
    return Leg(float(end), last, hit, Work(0, int(accepted), 0), short, tuple(samples))


def _reason(made, limits):
    return "step limit reached" if made >= limits.steps else "stalled (steps below the spacing of floats)"


@lru_cache(maxsize=8)
def _compiled(rhs, load, drive, max_steps):
    """Return ``solve(t, until, state, rtol, atol, (p, guards), ts)`` for a traced field."""
    import diffrax
    import jax
    import jax.numpy as jnp
    import optimistix

    def field(t, w, args):
        return jnp.stack([jnp.asarray(v, float) for v in rhs(*w, args[0])])

    def guard(k):
        def value(t, y, args, **_):
            p, rows = args
            return jnp.dot(rows[k], jnp.stack([load(*y, p), drive(*y, p), y[2]]))

        return value

    event = diffrax.Event((guard(0), guard(1)), optimistix.Newton(rtol=1e-14, atol=1e-14), (False, False))

    @jax.jit
    def solve(t, until, state, rtol, atol, args, ts):
        saved = diffrax.SaveAt(subs=[diffrax.SubSaveAt(t1=True), diffrax.SubSaveAt(ts=ts)])
        control = diffrax.PIDController(rtol=rtol, atol=atol)
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(field), diffrax.Kvaerno5(), t, until, None, state, args, saveat=saved,
            stepsize_controller=control, event=event, max_steps=max_steps, throw=False)
        made, accepted = found.stats["num_steps"], found.stats["num_accepted_steps"]
        ok = found.result == diffrax.RESULTS.successful
        return found.ts[0][0], found.ys[0][0], found.ys[1], accepted, made, jnp.stack(found.event_mask), ok

    return solve
