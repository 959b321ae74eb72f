"""Kvaerno5 of diffrax (ESDIRK of order 5): runs of many steps, compiled by JAX.

A system with one friction whose contact does not open has few modes, which are compiled together. A compiled run makes
steps until one is of interest: a guard is lost or may be lost within it, it passes the middle of a bump or comes to a
0/0, the time of a sample is reached, or the run has its number of steps. The limit on seconds is checked between runs.
``_compiled`` is the hard function.
"""

from collections.abc import Callable
from functools import cache, lru_cache
from math import inf

import numpy as np
import sympy as sp

from asympk.automaton.compiled import function
from asympk.automaton.loop import Segment
from asympk.automaton.modes import mode_of
from asympk.automaton.numericmode import NumericMode, on_hermite
from asympk.integrators.integrate import Settings, lacking, missing
from asympk.integrators.stepwise import IDLE, PARTS, follow_steps
from asympk.integrators.watch import GuardSample, near
from asympk.symbolic.branches import all_phases
from asympk.symbolic.lowering import NoFunction
from asympk.symbolic.removable import SMALL

AT_ONCE = 1000  # most steps of a compiled run


def advance(mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings) -> Segment:
    """Follow ``mode`` from (t, state) until a guard is lost or ``until``."""
    try:
        import diffrax  # noqa: F401
        import jax  # noqa: F401
    except ImportError as error:
        raise missing(settings.method) from error
    try:
        return follow_steps(KvaernoSteps(mode, t, state, until, settings), mode, t, state, settings)
    except (AttributeError, TypeError, NoFunction) as reason:
        raise lacking(settings.method, "JAX", reason) from None


class KvaernoSteps:
    """The steps of Kvaerno5 to ``until``, several in a call, as a solver of ``stepwise``."""

    nfev = njev = made = 0
    status, due = "running", inf

    def __init__(self, mode: NumericMode, t: float, state: tuple[float, ...], until: float, settings: Settings):
        import jax

        together = _together(mode.mode)
        template, self.run = _compiled(together, mode.coefficients)
        self.mode, self.limit, self.looks, self.until = mode, settings.steps, [*settings.times, until], until
        p, w = (np.array(v, dtype=float) for v in (mode.p, state))
        with jax.enable_x64(True):
            self.carry = np.array(t), np.array(t), w, *template(len(w), len(p))
        wide = {middle.side for middle in {*mode.mode.middles} - {*mode.middles}}
        narrow = np.array([side not in wide for side in _equally_many(together, _sides)(mode.mode)])
        self.fixed = p, together.index(mode.mode), narrow, settings.rtol, settings.atol
        self.longest = self.own = settings.longest
        self.t_old, self.t, self.y_old, self.y = t, t, w, w

    def step(self) -> str | None:
        """Make steps until one is of interest; return the reason if they fail, or None."""
        import jax

        if self.t >= self.due:
            self.longest, self.due = self.own, inf
        look, first = next(look for look in self.looks if look > self.t), self.y is self.y_old
        bounds = min(look, self.due), min(1 if first else AT_ONCE, self.limit), self.until, self.longest
        with jax.enable_x64(True):
            self.carry, found = self.run(first, self.carry, *bounds, *self.fixed)
            found = np.asarray(found)
        made, stalled, self.t_old, self.t = found[:4].tolist()
        self.y_old, self.y = found[4:].reshape(2, -1)
        self.made = int(made)
        self.limit -= self.made
        self.status = "failed" if stalled else "finished" if self.t >= self.until else "running"
        return "steps below the spacing of floats" if stalled else None

    def again(self) -> None:
        """Go back to before the last step, to make it in eight or more."""
        self.longest, self.due = (self.t - self.t_old) / PARTS, self.t
        self.t, self.y, self.status = self.t_old, self.y_old, "running"
        self.carry = np.array(self.t), np.array(self.t), self.y, *self.carry[3:]

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """Return the state as a function of the time within the last step: the Hermite cubic that diffrax uses."""
        h, ends = self.t - self.t_old, (self.y_old.tolist(), self.y.tolist())
        slopes = self.mode.rhs(self.t_old, ends[0]), self.mode.rhs(self.t, ends[1])
        return lambda t: np.array(on_hermite((t - self.t_old) / h, h, ends, slopes))


@lru_cache(maxsize=64)
def _together(mode):
    """Return the modes that are compiled together with a mode: all modes of its system, or this mode alone."""
    system = mode.system
    if mode.sides or len(system.frictions) != 1 or not system.frictions[0].permanent:
        return (mode,)
    return tuple(mode_of(system, (phase,)) for phase in all_phases(system, 0))


@lru_cache(maxsize=24)
def _compiled(modes, coefficients):
    """Return (template of the carried values, run of steps) for several modes, which are chosen by their index."""
    import diffrax
    import jax
    import jax.numpy as jnp

    watched, sided = (_equally_many(modes, of) for of in (lambda m: m.watched, _sides))
    field, guards, rates, sides = (_chosen(modes, coefficients, *which) for which in (
        (lambda m: m.rates,), (watched,), (watched, lambda m: (m.flow,)), (sided,)))
    term = diffrax.ODETerm(lambda t, w, args: field(t, w, *args))

    def look(t, w, args):
        return GuardSample(t, guards(t, w, *args), rates(t, w, *args)), sides(t, w, *args)

    @jax.jit
    def run(first, carry, due, most, until, longest, p, index, narrow, rtol, atol):
        control, solver = _method(rtol, atol)
        args = p, index
        carry = jax.lax.cond(first, lambda c: _begun(term, control, solver, *c[:3:2], until, args), lambda c: c, carry)

        def go_on(all_):
            (t, after, *_), _, _, made, of_interest, _, vain = all_
            return (made < most) & (t < due) & (after > t) & ~of_interest & (vain < IDLE)

        attempt = _attempt(term, control, solver, look, until, longest, narrow, args)
        t, _, w, *_ = carry
        carry, t_old, w_old, made, _, _, vain = jax.lax.while_loop(
            go_on, attempt, (carry, t, w, 0, jnp.asarray(False), look(t, w, args), 0))
        t, after, w, *_ = carry
        counts = jnp.stack([made, (vain == IDLE) | (after <= t) & (t < until), t_old, t])
        return jax.tree_util.tree_map(lambda v: jnp.asarray(v, v.dtype), carry), jnp.concatenate([counts, w_old, w])

    @cache
    def template(size, parameters):
        given = 0.0, np.zeros(size), 1.0, (np.zeros(parameters), 0)
        shapes = jax.eval_shape(lambda *given: _begun(term, *_method(0.1, 0.1), *given), *given)
        return jax.tree_util.tree_map(lambda leaf: np.zeros(leaf.shape, leaf.dtype), shapes)[3:]

    return template, run


def _sides(mode):
    """Return the sides of the middles of bumps in a mode, and of the range beside 0/0 in which rounding is large."""
    beside = (sp.sign(sp.Abs(power) - sp.Rational(SMALL)) for power in mode.removable)
    return *(middle.side for middle in mode.middles), *beside


def _equally_many(modes, of):
    """Return a function of a mode: its expressions ``of(mode)``, padded with the constant 1 to the largest number."""
    most = max(1, *(len(of(m)) for m in modes))
    return lambda m: (*of(m), *[sp.S.One] * (most - len(of(m))))


def _chosen(modes, coefficients, outputs, directions=lambda m: ()):
    """Return the ``outputs`` of a mode, or their derivatives, as a function of (t, w, p, index of the mode)."""
    import jax.numpy as jnp

    lowered = [function(m.system, outputs(m), "numpy", jnp, directions(m), coefficients=coefficients) for m in modes]
    return lambda t, w, p, k: jnp.stack([jnp.stack(jnp.broadcast_arrays(*f(t, *w, *p))) for f in lowered])[k] * 1.0


def _method(rtol, atol):
    """Return (step size controller, Kvaerno5) for the given tolerances."""
    import diffrax

    control = diffrax.PIDController(rtol=rtol, atol=atol)
    return control, diffrax.Kvaerno5(root_finder=diffrax.VeryChord(rtol=rtol, atol=atol, norm=control.norm))


def _begun(term, control, solver, t, w, until, args):
    """Return the initial values carried from step to step: (t, end of the next step, w, states of the method)."""
    import jax.numpy as jnp

    after, state = control.init(term, t, until, w, None, args, solver.func, solver.error_order(term))
    after = jnp.minimum(after, until)
    return t, after, w, solver.init(term, t, after, w, args), state, jnp.asarray(False)


def _attempt(term, control, solver, look, until, longest, narrow, args):
    """Return the function that tries one step, which is accepted or tried again with a smaller step size."""
    import jax
    import jax.numpy as jnp

    def attempt(all_):
        (t, after, w, inner, state, jumped), t_old, w_old, made, _, before, vain = all_
        after = jnp.minimum(after, t + longest)
        new, error, _, inner_new, _ = solver.step(term, t, after, w, args, inner, jumped)
        finite = jnp.isfinite(new) & jnp.isfinite(error)  # to the controller, an infinite state has no error
        new, error = jnp.where(finite, new, w), jnp.where(finite, error, jnp.inf)
        kept, begin, end, jumped, state, _ = control.adapt_step_size(
            t, after, w, new, args, error, solver.error_order(term), state)
        seen = now, sides = look(after, new, args)
        lost = jnp.any((now.values <= 0) | jnp.stack([near(before[0], now, k) for k in range(len(now.values))]))
        lost |= jnp.any((sides != before[1]) & narrow)
        keep = lambda a, b: jax.tree_util.tree_map(lambda one, other: jnp.where(kept, one, other), a, b)  # noqa: E731
        following = begin, jnp.minimum(end, until), keep(new, w), keep(inner_new, inner), state, jumped
        return (following, *keep((t, w, made + 1, lost, seen, 0), (t_old, w_old, made, False, before, vain + 1)))

    return attempt
