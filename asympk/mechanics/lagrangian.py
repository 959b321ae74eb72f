"""Mass matrix and forces from a Lagrangian, a ``LagrangesMethod`` or a ``KanesMethod`` of sympy.physics.mechanics.

    M q'' = Q,    M = d^2 L/dq'^2,    Q = dL/dq - (d/dt dL/dq' without q'') + generalised forces
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from asympk.errors import InputError
from asympk.mechanics.kinetics import slope_in_powers
from asympk.numbers import short
from asympk.symbolic.long import atoms, is_longer, replaced
from asympk.symbolic.reading import entries_of, real_expression
from asympk.symbolic.tidy import LONG, collected, in_normal_form

OWN: Mapping = MappingProxyType({})  # for symbols that stand for themselves


def equations_of(
    source: Any, coordinates: Any, forces: Any
) -> tuple[tuple, sp.Matrix, sp.Matrix, dict[sp.Expr, sp.Expr]]:
    """Return (coordinates, M, Q, {generalised speed: its value by rates}) of M q'' = Q, from a Lagrangian or method."""
    from sympy.physics.mechanics import KanesMethod, LagrangesMethod

    if isinstance(source, LagrangesMethod | KanesMethod):
        if coordinates is not None or forces is not None:
            raise InputError(f"a {type(source).__name__} has its own coordinates and forces; give the contact alone")
        return (_from_lagrange if isinstance(source, LagrangesMethod) else _from_kane)(source)
    if not isinstance(source, sp.Expr):
        raise InputError(f"lagrangian = {short(source)}: give an expression, a LagrangesMethod or a KanesMethod")
    coordinates, source = _functions(coordinates), source.doit()
    _require_first_order(source, coordinates)
    mass, forcing = _by_lagrange(source, coordinates)
    return coordinates, mass, forcing + sp.Matrix(_forces(forces, coordinates)), {}


def _by_lagrange(energy: sp.Expr, coordinates: tuple) -> tuple[sp.Matrix, sp.Matrix]:
    """Return M and Q of a Lagrangian, differentiated in symbols, as SymPy takes three times as long with functions."""
    time = coordinates[0].args[0]
    places, rates = (tuple(sp.Symbol(f"{kind}#{k}", real=True) for k in range(len(coordinates))) for kind in "qu")
    plain = dict(zip([*coordinates, *(q.diff(time) for q in coordinates)], [*places, *rates], strict=True))
    back = {name: q for q, name in plain.items()}
    mass, forcing = lagranges_equations(energy.xreplace(plain), places, rates, time, back)
    return tuple(part.applyfunc(lambda entry: replaced(entry, back)) for part in (mass, forcing))


def lagranges_equations(
    energy: sp.Expr, q: tuple[sp.Symbol, ...], u: tuple[sp.Symbol, ...], t: sp.Symbol, own: Mapping = OWN
) -> tuple[sp.Matrix, sp.Matrix]:
    """Return M and Q of Lagrange's equations in plain symbols, M u' = dL/dq - (d/dt dL/du without u').

    Raises ``InputError`` for a term that is not quadratic in the rates; ``own`` maps symbols to those of the message.
    """
    momenta, places = [slope_in_powers(energy, v) for v in u], range(len(u))
    lower = [[slope_in_powers(p, v) for v in u[: k + 1]] for k, p in enumerate(momenta)]
    mass = sp.Matrix([[lower[max(i, j)][min(i, j)] for j in places] for i in places])
    if mass.has(*u) or any(part.has(*u) for part in atoms(sp.Tuple(*momenta), sp.Function)):  # as sign(u), of |u|
        bent = next((term for term in sp.Add.make_args(energy) if sp.hessian(term, u).has(*u)), energy)
        raise InputError(f"{short(bent.xreplace(own))} in the Lagrangian is not quadratic in the rates, and the mass "
                         "matrix would depend on them; friction and the like are forces=")
    if any(is_longer(entry, LONG) for entry in mass):
        energy, momenta, mass = _shortened(energy, momenta, mass, u)
    moved = {t: sp.S.One, **dict(zip(q, u, strict=True))}
    turning = [sp.Add(*(slope_in_powers(p, x) * v for x, v in moved.items())) for p in momenta]
    forces = (slope_in_powers(energy, x) - part for x, part in zip(q, turning, strict=True))
    return mass, sp.Matrix([collected(force) for force in forces])  # most terms cancel


def _shortened(
    energy: sp.Expr, momenta: list[sp.Expr], mass: sp.Matrix, u: tuple[sp.Symbol, ...]
) -> tuple[sp.Expr, list[sp.Expr], sp.Matrix]:
    """Return energy, momenta and mass matrix with normal forms in the matrix: most squares of Euler angles add up."""
    still, rates = dict.fromkeys(u, 0), sp.Matrix(u)
    mass, drift = mass.applyfunc(in_normal_form), sp.Matrix(momenta).xreplace(still)
    turning = mass * rates
    return turning.dot(rates) / 2 + drift.dot(rates) + energy.xreplace(still), [*(turning + drift)], mass


def _require_first_order(lagrangian: Any, coordinates: tuple) -> None:
    """Raise ``InputError`` for functions of time other than coordinates and first rates, which SymPy would ignore."""
    known = {own for q in coordinates for own in (q, q.diff(q.args[0]))}
    found = lagrangian.atoms(sp.Derivative, AppliedUndef, sp.Integral, sp.Subs) - known
    for rest in sorted(found, key=str):
        if isinstance(rest, sp.Derivative) and rest.expr in known:
            raise InputError(f"{rest} in the Lagrangian: it is to have first derivatives alone; where one of second "
                             "order enters linearly, integrate by parts, as X*X'' to -X'**2")
        raise InputError(f"{rest} in the Lagrangian is no coordinate or velocity; list it, or write it out")


def _functions(coordinates: Any) -> tuple:
    found = () if coordinates is None else entries_of("coordinates", coordinates, "a sequence of dynamicsymbols")
    for q in found:
        if not isinstance(q, AppliedUndef) or len(q.args) != 1:
            raise InputError(f"coordinate {short(q)} is not a dynamicsymbol; for plain symbols there is ap.Mechanism")
    if not found:
        raise InputError("coordinates are missing; give the dynamicsymbols of the Lagrangian")
    return found


def _forces(forces: Any, coordinates: tuple) -> list:
    if forces is None:
        return [sp.S.Zero] * len(coordinates)
    if isinstance(forces, dict):
        if unknown := forces.keys() - {*coordinates}:
            raise InputError(f"forces: {', '.join(sorted(map(short, unknown)))} is no coordinate; these are "
                             f"{', '.join(map(str, coordinates))}")
        return [real_expression(f"the force on {q}", forces.get(q, 0)) for q in coordinates]
    given = entries_of("forces", forces, "one for each coordinate, or a dict")
    if len(given) != len(coordinates):
        raise InputError(f"{len(given)} forces for {len(coordinates)} coordinates; give one for each, or a dict")
    return [real_expression(f"the force on {q}", force) for q, force in zip(coordinates, given, strict=True)]


def _from_lagrange(method: Any) -> tuple[tuple, sp.Matrix, sp.Matrix, dict]:
    if method.coneqs:
        raise InputError("the LagrangesMethod has constraints; give independent coordinates and leave the contact out")
    _require_first_order(sp.Matrix([method._L]), tuple(method.q))
    method.form_lagranges_equations()
    return tuple(method.q), method.mass_matrix, method.forcing, {}


def _from_kane(method: Any) -> tuple[tuple, sp.Matrix, sp.Matrix, dict]:
    r"""Rewrite M u' = f for the speeds u = K q' + k as K' M K q'' = K' (f - M (dK/dt q' + dk/dt))."""
    if method._qdep or method._udep or len(method.q) != len(method.u) or method._qdot_u_map is None:
        raise InputError("the KanesMethod has dependent coordinates or speeds; give independent ones, contact left out")
    if method._fr is None:
        raise InputError("the KanesMethod has no equations yet; call its kanes_equations first")
    q, u = sp.Matrix(method.q), sp.Matrix(method.u)
    time = method.q[0].args[0]
    rates = q.diff(time)
    kinematics = method.kindiffdict()
    flow = rates.applyfunc(lambda rate: sp.sympify(kinematics[rate], strict=True))
    inverse = flow.jacobian(u).inv().applyfunc(sp.simplify)
    drift = flow.subs(dict.fromkeys(u, 0))
    speeds = inverse * (rates - drift)
    turned = {name: value for name, value in zip(u, speeds, strict=True) if name not in rates}
    mass, forcing = (part.subs(turned) for part in (method.mass_matrix, method.forcing))
    extra = inverse.diff(time) * (rates - drift) - inverse * drift.diff(time)
    right = inverse.T * (forcing - mass * extra)
    return tuple(q), (inverse.T * mass * inverse).applyfunc(sp.simplify), right, turned
