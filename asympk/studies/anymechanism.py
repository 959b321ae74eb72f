r"""The jump law of any mechanism in numbers: its values for the catalogue, its errors, and the rebound.

The law is that of ``mechanics.jump_law``. For decreasing compliance c, with L = log(1/c), the error of the law is
c (A L + B + ..), so that error / (c L) tends to the constant A, linearly in 1/L. The rebound of a contact that only
pushes is followed through the jump of a stiff contact with the damping time h = b sqrt(c). It is compared with the
formula of the law and with two limits: sqrt(p (p - p_s)) / q without damping, |G_NT| / (D b^2) for strong damping.
"""

from functools import cache
from importlib import import_module
from math import cos, log, sin
from typing import Any

import sympy as sp

from asympk.mechanics import paradox
from asympk.mechanics.kinetics import Kinetics
from asympk.methods import solve
from asympk.scene import Scene
from asympk.storage.rows import KEPT, StoredRows, in_kept_digits
from asympk.systems import MECHANISMS, painleve_rod
from asympk.systems.catalogue import c, described_mechanism, eps, example_scene, h

CHECKED = ("bead_rod", "arm", "crank_slider")  # nonlinear; bilateral and unilateral; two and three coordinates
COMPLIANCES = ("1e-3", "1e-4", "1e-5", "1e-6", "1e-7")
LAYER = 8  # the time in c log(1/c) after which the law is checked
REBOUNDS = ((1.1, "2"), (0.9, "3"), (1.2, "9/5"))  # theta, friction
RATIOS = tuple(10 ** (k / 8) for k in range(-16, 17))
FOLLOWED = RATIOS[:25:4]  # for larger ratios the rebound is not large against the effect of a_N on the gap
STIFF = 1e-4  # eps of the contact whose rebound is followed
BETA = sp.Symbol("beta", positive=True)  # b = h / sqrt(c) of the ground
LONG = 130  # letters in LaTeX from which on a critical friction is shown in a shorter form


def _formulas(name):
    described = described_mechanism(name)
    rod, kinetics = described.mechanism, described.mechanism.plain
    normal, tangential = impulses(kinetics)
    critical = paradox.critical_friction(kinetics)
    parts = {"critical": critical, "friction": rod.contact.friction, "normal": normal, "tangential": tangential}
    top, bottom = sp.fraction(shortened(tangential / normal, kinetics))
    short = sp.factor_terms(sp.Abs(top)) / sp.Abs(bottom) / kinetics.load
    shown = critical if len(sp.latex(critical)) < LONG else short
    formulas = {"critical": shown, "normal": normal, "tangential": tangential}
    return {
        "mechanism": name, "coordinates": len(kinetics.coordinates), "unilateral": kinetics.unilateral,
        **{f"{of}_latex": sp.latex(part, fold_func_brackets=True) for of, part in formulas.items()},
        **in_kept_digits({of: rod.evaluate(part, described.numbers) for of, part in parts.items()}),
    }


def impulses(kinetics: Kinetics) -> tuple[sp.Expr, sp.Expr]:
    """Return P_N / gamma and P_T / gamma in short form."""
    normal, tangential = kinetics.slip_impact[-2:]
    return shortened(normal, kinetics), shortened(tangential, kinetics)


def shortened(expr: sp.Expr, kinetics: Kinetics) -> sp.Expr:
    """Return a fraction whose parts are collected by the parameters, with trigonometric coefficients in short form."""
    top, bottom = (_collected(part, kinetics) for part in sp.fraction(sp.factor(sp.together(expr))))
    return sp.factor_terms(sp.cancel(top / bottom))


def _collected(expr, kinetics):
    angles = {s for part in expr.atoms(sp.sin, sp.cos) for s in part.free_symbols}
    parameters = [s for s in kinetics.parameters if expr.has(s) and s not in angles]
    if not parameters:
        return sp.trigsimp(sp.factor(expr))
    terms = sp.Poly(sp.expand(expr), *parameters).terms()
    powers = [sp.Mul(*(s**n for s, n in zip(parameters, power, strict=True))) for power, _ in terms]
    return sp.Add(*(sp.trigsimp(sp.factor(term)) * power for power, (_, term) in zip(powers, terms, strict=True)))


def error_rows() -> StoredRows:
    """Return the errors of the law for the ``CHECKED`` mechanisms, for decreasing compliance.

    A row has the largest error among the states, in the state ``worst``; ``ratio`` is the error / (c log(1/c)).
    """
    found = (_error(name, small) for name in CHECKED for small in COMPLIANCES)
    return StoredRows(found, {"kept": KEPT, "layer": LAYER, "reference": "exact motion of the elastic contact"})


def _error(name, small):
    module, described = import_module(f"asympk.systems.{name}"), described_mechanism(name)
    number = float(small)
    layer = number * log(1 / number)
    values = {**module.VALUES, c.name: small}
    scene = example_scene(described.mechanism, module.system(), values, module.STATE, repr(LAYER * layer), name)
    found = dict(zip(scene.names, map(float, solve(scene).final), strict=True))
    found["y"] *= number  # -g' = c y
    after = _after(described, scene)
    worst = max(after, key=lambda state: abs(found[state] - after[state]))
    error = found[worst] - after[worst]
    return {"mechanism": name, "compliance": number, "worst": worst,
            **in_kept_digits({"error": error, "ratio": error / layer})}


def _after(described: Any, scene: Scene) -> dict[str, float]:
    """Return {state: value} after the jump by the law, where the value of y is that of c y."""
    rod = described.mechanism
    law = rod.jump_law(damping=sp.Rational(described.values[h.name]))
    rates = {plain.name: rod.evaluate(law.velocities[own], described.numbers)
             for own, plain in zip(rod.velocities, rod.plain.velocities, strict=True)}
    gain = rod.evaluate(law.reaction, described.numbers)
    known = {**described.numbers, **rates, "x": gain, "y": 0, "z": 0}
    return {name: float(known[name]) for name in scene.names}


def _rebound(theta, friction, ratio):
    rod, numbers = painleve_rod.mechanism(), _sliding(theta, friction)
    law, undamped = (rod.evaluate(rod.jump_law(ratio=sp.Rational(b)).gap_rate, numbers) for b in (ratio, 0))
    mixed, D = (rod.evaluate(part, numbers) for part in (rod.delassus[0, 1], rod.delassus.det()))
    followed = _followed(numbers, ratio) if ratio in FOLLOWED else None
    found = {"ratio": ratio, "law": law, "followed": followed, "undamped": undamped,
             "overdamped": abs(mixed) / (D * ratio**2)}
    return {"theta": theta, "friction": float(sp.Rational(friction)), **in_kept_digits(found)}


def _sliding(theta, friction):
    """Return numbers of the rod with theta' = 1/5 whose end slides on the ground with the velocity -1."""
    rates = {"X'": -1 - sin(theta) / 5, "Y'": cos(theta) / 5, "theta'": 0.2}
    return {"m": 1, "l": 1, "g": 1, "f": friction, "X": 0, "Y": sin(theta), "theta": theta, **rates}


@cache
def _stiff_ground():
    return painleve_rod.mechanism().elastic(compliance=eps**2, damping=BETA * eps)


def _followed(numbers, ratio):
    """Return the gap rate at lift-off of the rod from ground with c = STIFF^2 and h = ``ratio`` sqrt(c)."""
    state = {name: value for name, value in numbers.items() if name in painleve_rod.STATE}
    values = {**numbers, eps.name: repr(STIFF), BETA.name: ratio}
    until = 20 * STIFF * (1 + ratio) * log(1 / STIFF)
    scene = example_scene(painleve_rod.mechanism(), _stiff_ground(), values, state, repr(until), "rebound")
    opened = next(event for event in solve(scene).events if event.kind == "lift_off")
    return -STIFF * float(opened.state[scene.names.index("y")])


def formula_rows() -> StoredRows:
    """Return a row for every mechanism of the catalogue, in its order.

    A row has the critical friction and the impulses over gamma, as formulas in LaTeX and as values for the example.
    """
    return StoredRows(map(_formulas, MECHANISMS), {"kept": KEPT, "examples": "those of the catalogue"})


def rebound_rows() -> StoredRows:
    """Return the rebounds of the slender rod that slides backward with unit speed, by angle and b = h / sqrt(c).

    A row has g' / |gamma| after the jump: by the law, as ``followed``, or None, and in the limits b -> 0 and b -> oo.
    """
    found = (_rebound(theta, friction, ratio) for theta, friction in REBOUNDS for ratio in RATIOS)
    return StoredRows(found, {"kept": KEPT, "eps": STIFF})
