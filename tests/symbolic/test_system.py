"""The symbolic system: how friction turns one field into three modes, and what it refuses."""

import itertools
import re

import pytest
import sympy as sp

import asympk as ap
from asympk.errors import InputError
from asympk.symbolic.branches import with_powers
from asympk.symbolic.forces import forces
from asympk.symbolic.guards import named_branches
from asympk.symbolic.system import Friction, System

x, y, z, mu, F, N, k = sp.symbols("x y z mu F N k", real=True)


def _oscillator(**changes):
    """A mass on a compliant support that slides with friction: the load is the support's force."""
    parts = {
        "slow": {x: y},
        "fast": {y: 1 - 2 * x - 3 * y + 4 * F},
        "velocity": {z: 2 - x + F},
        "force": F,
        "load": x + y,
        "kinetic": k,
        "static": k + 1,
        "small": mu,
    }
    return System.with_friction(**{**parts, **changes})


def _two_blocks(push):
    """Two blocks, of which the first is pushed by ``push``, which contains the friction forces F and N of both."""
    frictions = [Friction(velocity=z, force=F, load=1, kinetic=k), Friction(velocity=y, force=N, load=1, kinetic=k)]
    return System.with_frictions({z: push - x, y: N, x: z}, {}, frictions)


def _nested(levels):
    expr = x
    for _ in range(levels):
        expr = sp.Add(1, sp.Pow(expr, 2, evaluate=False), evaluate=False)
    return expr


@pytest.mark.parametrize(("rate", "why"), [
    (_nested(110), "an expression nested deeper than 180"),
    (sp.Mul(*(sp.sin(n * x + y) for n in range(1, 301))), "more than 100 factors"),
    (sp.legendre(10**5, x, evaluate=False), "has the order 10+, beyond 64"),
    (sp.binomial(10**9, x), "has the order 10+, beyond 64"),
    (sp.ff(x, 10**5, evaluate=False), "has the order 10+, beyond 64"),
])
def test_an_expression_that_sympy_works_on_without_end_or_cannot_visit_is_refused_by_its_size(rate, why):
    with pytest.raises(InputError, match=why):
        System.smooth({x: -y}, {y: rate}, mu)


def test_remainders_angles_steps_and_bessel_functions_have_no_order():
    System.smooth({x: sp.Mod(x, 1000) + sp.atan2(x, 1000) + sp.Heaviside(x, 100) + sp.besselj(100, x)}, {y: x - y}, mu)


def test_a_mode_of_a_load_that_contains_its_own_force_holds_where_this_load_says():
    """In slip F = -+N/2 of N = x + y + F/8, so N = (x + y)/(1 +- 1/16); at rest F = x + y - 1. F stood in all three."""
    system = _oscillator(load=x + y + F / 8, velocity={z: 1 - x - y + F}, kinetic=sp.Rational(1, 2), static=None)
    same, opposite, stick = (mode.where for mode in system.modes)
    assert (same, opposite) == (z * (16 * x / 17 + 16 * y / 17) > 0, z * (16 * x / 15 + 16 * y / 15) < 0)
    loads = (sp.Rational(1, 2), sp.Rational(3, 4), 2, 3)
    told = [stick.subs({x: s, y: 0, z: 0}) == sp.true for s in loads]
    assert told == [abs(s - 1) <= abs(9 * s - 1) / 16 for s in loads] == [False, True, True, False]


def test_each_mode_is_the_field_with_its_own_friction_force():
    system = _oscillator()
    forces = {"slip_same": -k * (x + y), "slip_opposite": k * (x + y), "stick": x - 2}
    for name, force in forces.items():
        mode = system.mode(name)
        assert sp.expand(mode.fast[y] - (1 - 2 * x - 3 * y + 4 * force)) == 0
        assert sp.expand(mode.slow[z] - (2 - x + force)) == 0
        assert mode.slow[x] == y


def test_a_load_that_is_not_linear_in_its_own_force_is_refused_by_the_name_of_the_force():
    with pytest.raises(InputError, match=r"slip_same: the forces must enter .* linearly, and F does not"):
        _oscillator(load=sp.Abs(F))


def test_stick_has_no_acceleration_and_slip_opposes_the_velocity():
    system = _oscillator()
    assert system.mode("stick").slow[z] == 0
    for name in ("slip_same", "slip_opposite"):
        for load in (2, -2):
            velocity = load if name == "slip_same" else -load
            push = (system.mode(name).slow[z] - (2 - x)).subs({x: load, y: 0, k: 3})
            assert push * velocity < 0


def test_a_fast_velocity_that_sticks_has_no_rate_whatever_other_forces_act_on_it():
    other = Friction(velocity=x, force=N, load=y, kinetic=1 + 1 / (1 + x**2))
    held = Friction(velocity=y, force=F, load=2, kinetic=1)
    system = System.with_frictions({x: 1 + N}, {y: sp.cos(x) - 3 * N - y + F}, [other, held], small=mu)
    assert [mode.fast[y] for mode in system.modes if mode.name.endswith("+stick")] == [0, 0, 0]


def test_a_system_and_its_modes_are_values():
    assert _oscillator() == _oscillator()
    assert hash(_oscillator()) == hash(_oscillator())
    with pytest.raises(AttributeError):
        _oscillator().small = x


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: _oscillator(velocity={z: 2 - x + F**2}), "must enter the rates linearly"),
        (lambda: _two_blocks(F * N), "friction 1: the force F must enter the rates linearly, and not so that of z"),
        (lambda: _oscillator(kinetic=sp.nan), "kinetic = nan: it must be finite and real, such as 1/.1 . abs.z.."),
        (lambda: _oscillator(static=sp.oo), "static = oo: it must be finite and real"),
        (lambda: _oscillator(velocity=z), "must be a mapping"),
        (lambda: System.smooth([x], [y], mu), "must be a mapping"),
        (lambda: System.smooth(slow={x: 0.5 * y}, fast={y: -y}, small=mu), "contains a float"),
        (lambda: System.smooth(slow={x: y}, fast={}, small=mu), "there is no fast state"),
        (lambda: System.smooth(slow={x: y}, fast={x: y}, small=mu), "given twice"),
        (lambda: System.smooth(slow={x: y}, fast={y: -y}, small="mu"), "small = 'mu': it must be a Symbol"),
        (lambda: System.smooth({x: -k * x}, {}, None, assumptions=sp.Q.positive(k)), "no relation"),
        (lambda: System.smooth({x: -k * x}, {}, None, (k < 0) | sp.Contains(k, sp.S.Integers)), "no relation"),
        (lambda: System.smooth({x: -k * x}, {}, None, k), "assumptions: k is no relation"),
        (lambda: System.smooth({x: -k * x}, {}, None, sp.And(k > 0, x > 0)), "assumptions: x is no parameter"),
        (lambda: _oscillator(assumptions=F > 0), "assumptions: F is no parameter"),
        (lambda: System.smooth(slow={mu: y}, fast={y: -y}, small=mu), "small parameter"),
        (lambda: System.smooth(slow={x: y}, fast={y: -y}, small=None), "small is missing: fast states .y. need"),
        (lambda: System.smooth(slow={x + y: y}, fast={y: -y}, small=mu), "not a Symbol"),
        (lambda: System.with_frictions({z: F}, {}, 2 * [Friction(z, F, 1, 1)]), "F is the force or reaction of two"),
        (lambda: _oscillator(kinetic=k + F / 2), "kinetic = F/2 . k contains the force F; only rates, loads"),
        (lambda: System.with_frictions({z: F}, {}, [Friction(z + F, F, 1, 1)]), "velocity = F . z contains the force"),
        (lambda: _oscillator().mode("slide"), "mode 'slide' is unknown; this system has slip_same"),
    ],
)
def test_what_is_no_system_is_refused_by_name(make, match):
    with pytest.raises(InputError, match=match):
        make()


def test_a_system_reads_its_assumptions_as_its_class_methods_do():
    assert System({x: -x}, {}, (x,), None, assumptions=True) == System.smooth({x: -x}, {}, None, assumptions=True)
    for make in (lambda: System({x: -k * x}, {}, (x,), None, assumptions="k > 0"),
                 lambda: System.smooth({x: -k * x}, {}, None, "k > 0")):
        with pytest.raises(InputError, match="assumptions = 'k > 0': it must be a SymPy expression"):
            make()


LAWS = {
    "falls with the speed": ("k/(1 + Abs(z))", 1),
    "falls with the speed, the load negative": ("k/(1 + Abs(z))", -1),
    "falls with the speed, the load of either sign": ("k/(1 + Abs(z))", "x + y"),
    "grows with the load": ("k*(1 + Abs(x + y))", "x + y"),
    "differs forward and backward": ("k*(2 + sign(z))", "x + y"),
}


@pytest.mark.parametrize(("kinetic", "load"), LAWS.values(), ids=LAWS)
def test_the_rates_of_a_mode_are_those_of_the_friction_law_wherever_it_holds(kinetic, load):
    known = {s.name: s for s in (x, y, z, k)}
    kinetic, load = sp.sympify(kinetic, known), sp.sympify(load, known)
    law = Friction(force=F, velocity=z, load=load, kinetic=kinetic)
    system = System.with_frictions({x: y, y: -x, z: F - x}, {}, [law])
    for place in itertools.product((-2, 3), (-5, 1), (-3, 4)):
        at = {**dict(zip((x, y, z), place, strict=True)), k: sp.Rational(1, 3)}
        (mode,) = (m for m in system.modes if m.where.subs(at) == sp.true)
        friction = (-kinetic * sp.Abs(load) * sp.sign(z)).subs(at)
        assert mode.slow[z].subs(at) == friction - at[x]


@pytest.mark.parametrize("law", [
    sp.Piecewise((3 * k, z > 0), (k, True)), k + 2 * k * sp.Max(sp.sign(z), 0), k * sp.Abs(1 + 2 * sp.sign(z)),
])
def test_a_law_of_a_piece_for_each_direction_has_the_modes_and_manifolds_of_the_same_law_by_signs(law):
    """Where the load has either sign, its pieces stayed in the rates, and an expansion or an export refused them."""
    pieces, signs = (_oscillator(kinetic=same, static=None) for same in (law, k * (2 + sp.sign(z))))
    for one, other in zip(pieces.modes, signs.modes, strict=True):
        assert all(sp.expand(one.fast[s] - rate) == 0 for s, rate in other.fast.items())
        assert all(sp.expand(one.slow[s] - rate) == 0 for s, rate in other.slow.items())
    found, expected = (ap.slow_manifolds(system, order=1) for system in (pieces, signs))
    for one, other in zip(found, expected, strict=True):
        assert all(sp.simplify(a - b) == 0 for a, b in zip(one.coefficients, other.coefficients, strict=True))


def test_a_factorial_of_a_fraction_is_that_of_the_gamma_function():
    """LSODA called Python's own factorial, and ended in a TypeError; 5/2! is gamma(7/2) = 15 sqrt(pi)/8."""
    system = System.smooth({x: -sp.factorial(k) * x}, {}, None)
    scene = ap.Scene(system=system, values={k: "5/2"}, start={x: 1}, until="1/10")
    for method, close in (("exact", 1e-14), ("lsoda", 1e-4)):
        (final,) = ap.solve(scene, method).final
        assert final == pytest.approx(float(sp.exp(-15 * sp.sqrt(sp.pi) / 80)), rel=close)


def test_a_contact_that_opens_is_open_or_slides_one_way_wherever_it_is():
    """Its load x + y only pushes: where that is negative neither slip holds, whichever sign the velocity has."""
    law = Friction(force=F, velocity=z, load=x + y, kinetic=k, gap=-x - y, normal=N)
    system = System.with_frictions({x: y, y: -x - N, z: F - x}, {}, [law])
    for place in itertools.product((-2, 3), (-5, 1), (-3, 4)):
        at = dict(zip((x, y, z), place, strict=True))
        (mode,) = (m for m in system.modes if m.where.subs(at) == sp.true)
        assert mode.name == ("open" if place[0] + place[1] < 0 else "slip_same" if place[2] > 0 else "slip_opposite")


@pytest.mark.parametrize(("rate", "kinetic", "words"), [
    ((F - x) / k, 1, "k = 0 is refused; y' = (F - x)/k divides by k"),
    (F - x * sp.exp(-1 / k**2), 1, "k = 0 is refused; y' = F - x*exp(-1/k**2) divides by k"),
    (-(x**3) + F, 1 / (k - mu), "k = 0, mu = 0 is refused; kinetic = 1/(k - mu) divides by k - mu")])
def test_a_value_by_which_a_formula_divides_is_refused_with_the_formula(rate, kinetic, words):
    block = System.with_frictions({x: y, y: rate}, {}, [Friction(velocity=y, force=F, load=1, kinetic=kinetic)])
    with pytest.raises(InputError, match=re.escape(words)):
        block.placed(dict.fromkeys(block.parameters, 0), (2, 0))


def test_a_piece_that_does_not_hold_may_divide_by_zero():
    spring = System.smooth({x: y, y: sp.Piecewise((-x / k, k > 0), (0, True))}, {}, None)
    assert spring.placed({k: 0}, (2, 0)) == ((0,), (2, 0))


def test_a_start_of_zero_of_a_positive_state_says_how_to_declare_the_state():
    """An enzyme starts without complex, whose concentration a user declares positive."""
    s, mu = (sp.Symbol(name, positive=True) for name in ("s", "mu"))
    system = System.smooth({}, {s: 1 - s}, mu)
    with pytest.raises(InputError, match=r"s = 0 is refused; .* positive; if its formulas hold at 0, declare it"):
        system.placed({"mu": 1}, {"s": 0})
    with pytest.raises(InputError, match=r"mu = 0 is refused; the symbol is declared positive$"):
        system.placed({"mu": 0}, {"s": 1})


@pytest.mark.parametrize("small", [0, "-1/1000"])
def test_a_small_parameter_is_positive_also_where_its_symbol_is_declared_real(small):
    """At -1/1000 the limit of the layer was given as the motion, and at 0 a division by zero."""
    with pytest.raises(InputError, match=r"mu = (0|-0\.001) is refused; the small parameter is positive"):
        _oscillator().placed({mu: small, k: 1}, (0, 0, -1))


def test_forces_for_numbers_are_those_for_symbols_at_these_numbers():
    """A matrix of numbers is inverted at once, one of symbols by its adjugate."""
    q, rates, c = sp.symbols("q1:5", real=True), sp.symbols("u1:5", real=True), sp.Symbol("c", positive=True)

    def pair(coupling):
        mass = sp.eye(4) + coupling * sp.Matrix(4, 4, lambda i, j: int(abs(i - j) == 1))
        guides = [ap.Contact(gap=q[k], slip=rates[k - 1], friction=sp.Rational(k, 5), unilateral=False) for k in (1, 3)]
        return ap.Mechanism(q, rates, mass, (-q[0], -1, 1 - q[2], -2), guides[0], others=guides[1:]).rigid()

    at, named = pair(sp.Rational(1, 5)), pair(c)
    for branch in [*named_branches(at)][::4]:
        found, general = forces(at, branch), forces(named, branch)
        assert all(sp.expand(found[force] - general[force].subs(c, sp.Rational(1, 5))) == 0 for force in at.pushes)


def test_a_contact_is_rigid_by_its_constraint_and_unilateral_with_a_gap():
    elastic = Friction(velocity=x, force=F, load=-y, kinetic=k, gap=y)
    bilateral = Friction(velocity=x, force=F, load=N, kinetic=k, normal=N, constraint=N - z)
    unilateral = Friction(velocity=x, force=F, load=N, kinetic=k, normal=N, constraint=N - z, gap=y)
    kinds = [(f.rigid, f.unilateral) for f in (elastic, bilateral, unilateral)]
    assert kinds == [(False, False), (True, False), (True, True)]


def test_a_friction_is_mapped_in_every_part():
    friction = Friction(velocity=x, force=F, load=N, kinetic=k * x, static=k, normal=N, constraint=N - x, gap=x)
    moved = friction.mapped(lambda part: part.xreplace({x: y}))
    assert moved.parts == {name: part.xreplace({x: y}) for name, part in friction.parts.items()}
    assert (moved.force, moved.normal) == (F, N)


def test_the_expressions_of_a_system_are_its_rates_and_the_parts_of_its_frictions():
    friction = Friction(velocity=x, force=F, load=1 + z, kinetic=k)
    system = System.with_frictions({x: F - y, y: x}, {z: -z}, [friction], small=mu)
    assert system.expressions == (F - y, x, -z / mu, *friction.parts.values())


def test_fast_fields_are_divided_by_the_small_parameter_in_the_order_of_the_states():
    system = System(sp.Dict({x: y}), sp.Dict({z: -z}), (z, x), mu)
    assert list(system.divided({x: -x}, {z: x}).items()) == [(z, x / mu), (x, -x)]
    assert list(system.rates.items()) == [(z, -z / mu), (x, y)]


def test_a_system_of_mappings_and_sequences_is_that_of_the_dicts_and_tuples_that_it_keeps():
    friction = Friction(velocity=y, force=F, load=1, kinetic=k)
    made = System({x: y, y: F - x}, {z: -z}, [x, y, z], small=mu, frictions=[friction], dependent={z: 0})
    kept = System(sp.Dict({x: y, y: F - x}), sp.Dict({z: -z}), (x, y, z), mu, (friction,), dependent=sp.Dict({z: 0}))
    assert made == kept
    assert hash(made) == hash(kept)
    assert made.parameters == (k, mu)


@pytest.mark.parametrize(("changes", "words"), [
    ({"slow": None}, "slow = None: it must be a mapping from each state to its rate, {x: rate of x}"),
    ({"slow": {x: "y", y: -x}}, "slow: the rate of x = 'y': it must be a SymPy expression or a number"),
    ({"fast": [x]}, "fast = [x]: it must be a mapping from each state to its rate"),
    ({"fast": {x: y}, "small": mu}, "the state x is given twice"),
    ({"states": "xy"}, "states = 'xy': give the states that have rates, x, y, in any order"),
    ({"states": (x,)}, "states = (x,): give the states that have rates, x, y, in any order"),
    ({"states": (x, y, F)}, "states = (x, y, F): give the states that have rates, x, y, in any order"),
    ({"states": ("x", "y")}, "states = ('x', 'y'): give the states that have rates"),
    ({"frictions": None}, "frictions = None: give a sequence of ap.Friction"),
    ({"frictions": [F]}, "frictions: F is no Friction; give a sequence"),
    ({"dependent": {x: "y"}}, "dependent: the value of x = 'y': it must be a SymPy expression or a number"),
])
def test_a_part_of_a_system_that_is_none_is_refused_by_its_name(changes, words):
    with pytest.raises(InputError, match=re.escape(words)):
        System(**{"slow": {x: y, y: -x}, "fast": {}, "states": (x, y), "small": None, **changes})


def test_a_load_does_not_contain_the_symbol_that_stands_for_it():
    """Without a constraint nothing determines such a load, and the friction was accepted."""
    v, F, N = sp.symbols("v F N", real=True)
    with pytest.raises(InputError, match="normal = N stands for the load, which contains it"):
        ap.Friction(v, F, load=N, kinetic=1, normal=N)


def test_a_force_that_pushes_on_at_the_values_is_refused_with_them():
    """In a file no parameter is known to be positive: -F/m was followed, to several motions at rest."""
    x, v, F, m = sp.symbols("x v F m", real=True)
    block = ap.System.with_frictions({x: v, v: -(x + F) / m}, {}, [ap.Friction(v, F, 1, 1)])
    start = {"x": 0, "v": 1}
    with pytest.raises(InputError, match=r"with m = 2, the rate of the velocity v falls .*; write \+ F for - F"):
        ap.Scene(system=block, values={"m": 2}, start=start, until=1)
    assert ap.Scene(system=block, values={"m": -2}, start=start, until=1).values == (-2,)


def test_numbers_such_as_the_sine_of_a_slope_are_coefficients_where_a_square_is_looked_for():
    """SymPy took them for symbols of a polynomial, and a block on a wedge ended in its error that one divides."""
    x, slope = sp.Symbol("x"), sp.Rational(3, 5)
    plain = x**2 * sp.cos(slope) ** 2 / (3 - sp.sin(slope) ** 2) + 2 * x + 1
    assert with_powers(plain) == plain
    assert with_powers(2 * x**2 + 2 * sp.sqrt(2) * x + 1) == 2 * (x + sp.sqrt(2) / 2) ** 2


def test_no_common_factors_are_sought_of_numbers_or_where_roots_along_a_line_are_far_apart(monkeypatch):
    """A block on a wedge of slope 3/5 ended in SymPy's error on a number; with three such numbers it took minutes."""
    x, y, slope = *sp.symbols("x y"), sp.Rational(3, 5)
    a, b, c = sp.sin(slope) / (1 + sp.cos(slope) ** 2), sp.sqrt(2), sp.exp(-slope)
    monkeypatch.setattr(sp, "sqf_list", lambda *_: pytest.fail("common factors were sought"))
    for plain in (sp.cos(slope) ** 2 / (3 - sp.sin(slope) ** 2) + 1,
                  a * x**2 + (a * b + c / (1 + a)) * y**2 + x * y * (a - c / (b + a * c)) + b * y**3 + c * x + y + a):
        assert with_powers(plain) is plain
