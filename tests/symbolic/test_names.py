"""What is derived of a system does not depend on the names that its states and parameters have."""

from functools import cache

import pytest
import sympy as sp

import asympk as ap
from asympk.errors import InputError

x, y, z, F, kappa, r = sp.symbols("x y z F kappa r", real=True)
mu = sp.Symbol("mu", positive=True)
NUMBERS = [*map(sp.Rational, ("1/7", "2/9", "-5/4", "2/5", "9/2", "1/100"))]  # of x, y, z, r, kappa and mu


def _named(state, fast, speed, parameter, steepness):
    load = state + fast
    return ap.System.with_friction(
        slow={state: fast}, fast={fast: 1 - (1 + parameter) * load + F}, velocity={speed: 1 - parameter * load + F},
        force=F, load=load, kinetic=steepness, static=steepness, small=mu,
        assumptions=sp.And(steepness > 0, parameter > 0),
    )


def _curves(system):
    return [curve for plane in ap.slow_manifolds(system) for curve in ap.integral_curves(plane).values()]


def _eigenvalues(system):
    return [value for mode in ap.eigenvalues(system) for value in (mode.slow, mode.fast)]


def _jump(system):
    steepness = system.frictions[0].kinetic
    (parameter,) = {*system.parameters} - {steepness, mu}
    found = ap.jump_map(system, order=1, start={steepness: 5, parameter: "2/5"})
    return [series.coefficient(*m) for series in (found.x, found.z) for m in ((0, 0), (1, 1), (1, 0))]


def _edges(system):
    return ap.stick_regions(system).edges


def _at_numbers(values, names):
    own = dict(zip((*names, mu), NUMBERS, strict=True))
    found = [sp.sympify(value).subs(own) for value in values]
    return [complex(value.subs(dict.fromkeys(value.free_symbols, 3))) for value in found]


@cache
def _plain(derived):
    names = (x, y, z, r, kappa)
    return _at_numbers(derived(_named(*names)), names)


OTHERS = [sp.symbols("s C d_0 beta delta"), sp.symbols("s C d_0 lambda nu", real=True)]


@pytest.mark.parametrize("derived", [pytest.param(_curves, marks=pytest.mark.slow), _eigenvalues, _jump, _edges])
@pytest.mark.parametrize("names", [own[k:] + own[:k] for own in OTHERS for k in (0, 3)], ids=str)
@pytest.mark.few(2)
def test_names_do_not_matter(derived, names):
    found = _at_numbers(derived(_named(*names)), names)
    assert found == pytest.approx(_plain(derived), rel=1e-9)


@pytest.mark.parametrize("name", ["X%", "{f", "x$", "m&n", "k#1", "_", "", "'"])
def test_a_name_that_latex_cannot_set_is_refused_where_it_is_given(name):
    odd = sp.Symbol(name, real=True)
    for build in (lambda: _named(odd, y, z, r, kappa), lambda: _named(x, y, z, odd, kappa),
                  lambda: ap.Mechanism((x, odd), (y, z), sp.eye(2), (0, 0), ap.Contact(odd, x, 1)),
                  lambda: ap.Mechanism((x, r), (y, z), sp.eye(2), (0, 0), ap.Contact(r, x, odd))):
        with pytest.raises(InputError, match="cannot name a quantity; give letters, digits and underscores"):
            build()


def test_a_parameter_may_be_called_as_the_fast_time_is():
    states = {}
    for p in sp.symbols("tau p"):
        system = ap.System.smooth({x: p * y - x}, {y: p * x - (2 + p) * y + x**2 / 3}, mu)
        states[p.name] = ap.jump_map(system, order=2).states[x].coefficient(2).subs(p, r)
    assert sp.simplify(states["tau"] - states["p"]) == 0


def test_the_constant_of_a_curve_is_not_called_as_a_fast_state_is():
    fast = sp.Symbol("C", real=True)
    (plane,) = ap.slow_manifolds(ap.System.smooth({x: -x, z: x}, {fast: x - fast}, mu), order=0)
    assert ap.integral_curves(plane) == sp.Dict({z: sp.Symbol("C_", real=True) - x})


@pytest.mark.parametrize("name", ["lambda", "nu"])
def test_an_eigenvalue_is_not_taken_for_a_parameter_of_its_name(name):
    with pytest.raises(InputError, match=f"{name} is an eigenvalue here; declare the parameter as real=True"):
        ap.eigenvalues(_named(x, y, z, sp.Symbol(name), kappa))


def test_an_offset_is_not_taken_for_a_parameter_of_its_name():
    with pytest.raises(InputError, match="near: the system has a delta already"):
        ap.jump_map(_named(x, y, z, sp.Symbol("delta", real=True), kappa), near="slip_opposite")
