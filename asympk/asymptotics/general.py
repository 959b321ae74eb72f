"""``method="slow"`` and ``"jump"`` for the scene of any system: smooth, or with friction.

``run`` is the entry. A smooth system whose motion crosses no switching surface goes to ``smooth``. A motion that
crosses one, where the state or the time switches the rates, is followed like a motion with friction, by ``frictional``.

Tolerances are relative to the largest of 1 and the states. Where some states stay small beside 1, as in units that are
too large, the hard function ``_in_units_that_fit`` follows the system again in units of their size. The small parameter
has a unit, too, as a compliance has. By an error of y the slow states change by mu |f_y| / |g_y| times the error, as a
layer lasts mu / |g_y|, and this factor is mu only where |g_y| is near |f_y| with every state in units of its size.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache, partial
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
import sympy as sp

from asympk.asymptotics import matched
from asympk.asymptotics.frictional import follow_stretches
from asympk.asymptotics.smooth import EXTRA, crosses_switch, follow_smooth
from asympk.automaton.automaton import ROUNDED, Automaton
from asympk.automaton.exact import exact_values
from asympk.errors import AsympkError, NotDerivable, OutOfRange
from asympk.formulas import NOT_FINITE
from asympk.numbers import known_order, listed, reason_of, short
from asympk.path import Path, RecomputedMotion
from asympk.symbolic.expansion import is_singular, regular
from asympk.symbolic.long import atoms, replaced
from asympk.symbolic.placing import with_numbers_inside
from asympk.symbolic.reading import rational, unused_symbol
from asympk.symbolic.sides import SWITCHING
from asympk.symbolic.system import System
from asympk.symbolic.taylor import FUNCTIONS, with_removables

HIGHEST_ORDER = 4
SMALL = 1e-4  # the size of a state, in its unit, below which the unit is made smaller
LARGEST = 1e6  # the size of a state in its layer, in its unit, above which rounding hides its slow motion
PACE = 3  # the largest power of ten of |g_y| / |f_y| at which IN_FAST of ``matched`` keeps errors below ROUNDING
DIGITS = 20  # digits of the rest of a Taylor polynomial
LOOKS = 32  # the number of times at which sizes are measured, each time half of the one before


def run(scene: Any, method: str = "jump", *, order: int | None = None) -> Path:
    """Follow ``scene`` by ``"jump"`` or ``"slow"`` to ``order``: by default 1 for a smooth system, 0 with friction.

    Raises ``OrderError``, ``NotDerivable`` for a system without small parameter, ``OutOfRange`` where a value is not
    finite, and the errors of ``follow_smooth`` and ``follow_stretches``.
    """
    smooth = not scene.system.frictions
    order = known_order(int(smooth) if order is None else order, HIGHEST_ORDER, f"method {method!r} takes whole orders")
    if scene.system.small is None:
        raise NotDerivable(f"method {method!r} needs a slow-fast system; this one has no small parameter")
    try:
        with np.errstate(all="ignore"):
            system, values = with_numbers_inside(scene.system, scene.values)
            known = scene if system is scene.system else replace(scene, system=system, values=values)
            inside = _with_low_powers(known, order + EXTRA)
            follow = follow_smooth if smooth and not crosses_switch(inside, order) else follow_stretches
            path = _in_units_that_fit(partial(follow, method=method, order=order), inside)
    except AsympkError:
        raise
    except (ArithmeticError, ValueError) as reason:
        raise OutOfRange(f"the layer or the slow motion from {listed(scene.names, scene.start)} has no finite value "
                         f"({_without_series(scene) or reason_of(reason)}); use method 'exact'") from None
    return replace(path, scene=scene, at=RecomputedMotion(path.at, run, scene, {"method": method, "order": order}))


def _with_low_powers(scene: Any, highest: int) -> Any:
    """Return a scene in whose rates what depends on mu alone is a polynomial in mu of the degree ``highest``.

    It is the Taylor polynomial and mu^``highest`` times a parameter, which has the value of the rest. A term like
    100 mu^3 is thus among those that predict the error, whatever the order. A function of the other parameters that
    has no series here, as gamma(k), becomes a parameter, too.
    """
    system, small = scene.system, scene.system.small
    if not (found := _lowered(system, small, highest)):
        return scene
    lowered, rests = found
    known = exact_values(system, (*rests.values(),), scene.values, DIGITS)
    values = dict(zip(system.parameters, scene.values, strict=True)) | {s: known[rest] for s, rest in rests.items()}
    return replace(scene, system=lowered, values={s: values[s] for s in lowered.parameters})


@lru_cache(maxsize=64)
def _lowered(system: System, small: sp.Symbol, highest: int) -> tuple[System, dict[sp.Symbol, sp.Expr]] | None:
    rates = sp.Tuple(*system.slow.values(), *system.fast.values())
    expanded, rests = dict[sp.Basic, sp.Expr](), dict[sp.Symbol, sp.Expr]()
    for part in _of_parameters(rates, small, {*system.parameters}):
        fixed, moving = part.as_independent(*system.states, as_Add=False)
        plain = regular(fixed, small, highest)
        terms = [plain.diff(small, k).subs(small, 0) * small**k / math.factorial(k) for k in range(highest + 1)]
        if fixed.diff(small, highest + 1) == 0 or sp.Tuple(*terms).has(*NOT_FINITE, sp.Subs):
            continue
        name = unused_symbol(small.name, (*system.states, *system.parameters, *rests))
        expanded[part] = sp.Add(*terms, small**highest * name) * moving
        rests[name] = (fixed - sp.Add(*terms)) / small**highest
    known = {}
    constants = (part for part in atoms(replaced(rates, expanded), sp.Function) if not isinstance(part, SWITCHING)
                 and type(part).__name__ not in FUNCTIONS and part.free_symbols <= {*system.parameters} - {small})
    for part in sorted(constants, key=str):
        known[part] = unused_symbol(small.name, (*system.states, *system.parameters, *rests))
        rests[known[part]] = part
    slow, fast = (sp.Dict({s: replaced(replaced(rate, expanded), known) for s, rate in of.items()})
                  for of in (system.slow, system.fast))
    return (replace(system, slow=slow, fast=fast), rests) if rests else None


def _of_parameters(expr: sp.Basic, small: sp.Symbol, parameters: set) -> list[sp.Expr]:
    """Return the largest smooth parts of an expression that contain mu, and otherwise parameters alone, in order.

    Such a factor that is singular by its form where mu = 0 is given with the factors without mu beside it.
    """
    found, left, seen = list[Any](), [expr], set[Any]()
    while left:
        if (part := left.pop()) in seen or not part.has(small):
            continue
        seen.add(part)
        smooth = isinstance(part, sp.Expr) and not atoms(part, sp.Piecewise, *SWITCHING)
        apart = smooth and part.is_Mul and is_singular(part, small)
        beside = part.as_independent(*part.free_symbols - parameters)[1] if apart else part
        if smooth and (part.free_symbols <= parameters or not beside.has(small)):
            found.append(part)
        else:
            left += part.args
    return sorted(found, key=str)


def _in_units_that_fit(follow: Callable, scene: Any) -> Path:
    """Follow a scene in its own units, or in units in which no state stays small and |g_y| is near |f_y|.

    A state that is small in the slow motion but large in the layer, as the speed of a fast oscillation, has a unit in
    which its layer is at most of the size 1 / ``SMALL``.
    """
    units = (0,) * (len(scene.start) + 1)
    try:
        path = follow(scene)
    except OutOfRange as refused:
        if (small := _units_at_start(scene)) == units:
            raise
        try:
            path, units = _followed(follow, scene, small), small
        except OutOfRange:
            raise refused from None
    sizes, tried = _sizes(path, units), {units}
    while (sizes[-1] != units[-1] or any(_smaller(sizes, units))) and sizes not in tried:
        tried.add(sizes)
        try:
            finer = _followed(follow, scene, sizes)
        except OutOfRange:
            if not SMALL < _reach(path, sizes, units) < LARGEST:
                raise
            break
        path, units = finer, sizes
        sizes = _sizes(path, units)
    return _out_of(units, scene, path) if any(units) else path


def _followed(follow: Callable, scene: Any, units: tuple[int, ...]) -> Path:
    return follow(_in(units, scene), units=10.0 ** np.array(units[:-1]))


def _smaller(sizes: tuple[int, ...], units: tuple[int, ...]) -> list[bool]:
    """Return which states are small beside their units."""
    return [size - unit < math.log10(SMALL) for size, unit in zip(sizes[:-1], units[:-1], strict=True)]


def _reach(path: Any, sizes: tuple[int, ...], units: tuple[int, ...]) -> float:
    """Return the largest modulus of the layer of a path in those states whose ``sizes`` are small in their units."""
    return float(path.at.sizes(_looks(path), slow=False)[_smaller(sizes, units)].max(initial=0))


def _units_at_start(scene: Any) -> tuple[int, ...]:
    begun = matched.begun(Automaton(scene.system, scene.values), scene.start)
    powers = _powers([abs(w) for w in begun.state])
    return (*map(_unit, powers), _unit_of_small(scene, powers, [(begun.mode, 0.0, begun.state)], 0))


def _sizes(path: Any, units: tuple[int, ...]) -> tuple[int, ...]:
    """Return the units that fit a path in ``units``: of its states, and of the small parameter.

    The size of a state is the largest at the start and in slow motion, and ``SMALL`` times that in layers and that by
    the terms of its rate, whose rounding is an error of the state. A power of ten is given by its exponent.
    """
    sizes = [max(abs(float(begun)), abs(w)) for begun, w in zip(path.scene.start, path.final, strict=True)]
    if min(sizes) < SMALL:
        looks = _looks(path)
        hidden = np.maximum(path.at.sizes(looks, slow=False), _by_terms(path))
        sizes = np.maximum.reduce([sizes, path.at.sizes(looks, slow=True), SMALL * hidden]).tolist()
    inside = _powers(sizes)
    powers = _powers([size * 10.0**unit for size, unit in zip(sizes, units[:-1], strict=True)])
    layers = path.at.places(np.array([]), slow=False)
    return (*map(_unit, powers), _unit_of_small(path.scene, inside, layers, units[-1]))


def _unit_of_small(scene: Any, powers: tuple[int, ...], layers: list, unit: int) -> int:
    """Return the unit of the small parameter, for which ``unit`` stands, in which |g_y| is near |f_y| in layers.

    For these derivatives the states are in units of ``powers`` of ten.
    """
    if not layers:
        return unit
    system, mu = scene.system, matched.small_number(scene)
    fast = np.array([s in system.fast for s in system.states])
    sizes, most = 10.0 ** np.array(powers), np.zeros(2)
    for mode, t, state in layers:
        slopes = np.abs(mode.jac(t, state))[:, fast] * sizes[fast] / sizes[:, None]
        most = np.maximum(most, (mu * slopes[fast].max(), slopes[~fast].max(initial=0)))
    pace = most[0] / (most[1] or 1.0)
    power = round(math.log10(pace)) if 0 < pace < math.inf else 0
    return unit + power if abs(power) > PACE else unit


def _by_terms(path: Any) -> np.ndarray:
    """Return the size of every state by the terms of its rate in slow motion, also where they cancel.

    It is ``NumericMode.terms``, times the time in which the state forgets an error, at most that of the run.
    """
    made, until = np.zeros(len(path.final)), float(path.scene.until)
    for mode, group in groupby(path.at.places(_looks(path), slow=True), key=itemgetter(0)):
        _, times, states = zip(*group, strict=True)
        t, w = np.array(times), np.array(states).T
        own = mode.on_arrays(lambda mode: mode.jacobian, t, (*w, *mode.p))[:: len(w) + 1]
        spans = until / np.fmax(until * np.abs(own), 1)
        made = np.fmax(made, np.fmax.reduce(mode.terms(t, w, ROUNDED) * spans, axis=1))
    return made


def _looks(path):
    return float(path.scene.until) / 2.0 ** np.arange(LOOKS)


def _powers(sizes: list[float]) -> tuple[int, ...]:
    """Return the power of ten nearest to every size; a state that is 0 gets that of the largest."""
    largest = max(sizes)
    return tuple(round(math.log10(size or largest or 1.0)) for size in sizes)


def _unit(power: int) -> int:
    return power if power < -1 else 0


def _in(units: tuple[int, ...], scene: Any) -> Any:
    """Return a scene with its states and its small parameter in ``units``, which are written into their names."""
    system, small = scene.system, scene.system.small
    powers = dict(zip((*system.states, small), units, strict=True))
    sizes = {s: sp.Integer(10) ** u for s, u in powers.items()}
    names = {s: sp.Symbol(f"{s.name}/{10.0**u:.0e}", real=True) if u else s for s, u in powers.items()}
    meant = {s: sizes[s] * name for s, name in names.items()}
    slow, fast = ({names[s]: rate.xreplace(meant) / (sizes[s] * unit) for s, rate in rates.items()}
                  for rates, unit in ((system.slow, 1), (system.fast, sizes[small])))
    frictions = tuple(f.mapped(lambda part: part.xreplace(meant)) for f in system.frictions)
    dependent = {names[s]: value.xreplace(meant) / sizes[s] for s, value in system.dependent.items()}
    *states, least = names.values()
    inside = replace(system, slow=sp.Dict(slow), fast=sp.Dict(fast), states=(*states,), small=least,
                     frictions=frictions, dependent=sp.Dict(dependent))
    values, start = ({names.get(s, s): _divided(v, sizes.get(s, 1)) for s, v in zip(of, at, strict=True)}
                     for of, at in ((system.parameters, scene.values), (system.states, scene.start)))
    return replace(scene, system=inside, values=values, start=start)


def _divided(value, unit):
    return Fraction(value) / Fraction(int(unit.p), int(unit.q)) if unit != 1 else value


def _out_of(units: tuple[int, ...], scene: Any, path: Any) -> Path:
    """Return the path of ``scene`` from ``path``, whose states are in ``units``."""
    numbers = 10.0 ** np.array(units[:-1])

    def out(values):
        return tuple((np.array(values) * numbers).tolist())

    def at(t):
        states = path.at(t)
        return states * numbers.reshape(-1, *[1] * (states.ndim - 1))

    events = tuple(event._replace(state=out(event.state)) for event in path.events)
    info = {name: out(terms) for name, terms in path.info.items()}
    return replace(path, scene=scene, final=out(path.final), events=events, at=at, info=info)


def _without_series(scene: Any) -> str:
    """Return words on a power or logarithm without Taylor series, of what is 0 at the start for mu = 0, or "".

    Quotients of more than one argument that have a limit there, as (exp(x) - exp(x y))/x, are among them.
    """
    system = scene.system
    given = zip((*system.states, *system.parameters), (*scene.start, *scene.values), strict=True)
    place = {s: rational(s.name, value) for s, value in given} | {system.small: sp.S.Zero}
    rates = (with_removables(rate, system.states) for rate in (*system.slow.values(), *system.fast.values()))
    parts = sorted(atoms(sp.Tuple(*rates), sp.Pow, sp.log), key=str)
    found = ((p, p.args[0].subs(system.small, 0)) for p in parts if p.args[0].xreplace(place) == 0
             and not (p.is_Pow and (power := p.exp.xreplace(place)).is_integer and power.is_nonnegative))
    return next((f"{short(p)} has no Taylor series where {short(base)} = 0" for p, base in found), "")
