"""Long expressions: a part that occurs many times is met once."""

import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import asympk as ap
from asympk.affine.form import affine_parts
from asympk.automaton.modes import mode_of
from asympk.symbolic import long
from asympk.symbolic.branches import Phase
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.forces import determined, forces
from asympk.symbolic.long import (
    atoms,
    carried_out,
    common_divisor,
    has_no_inverse,
    heavy,
    in_factors,
    inverse_of,
    is_clearly_nonzero,
    is_longer,
    modulus,
    parts_with,
    replaced,
    symbols_in,
    tidied,
    unnested,
    valued,
)
from asympk.symbolic.penetration import without_penetration
from asympk.symbolic.sides import shortly_after, with_real_powers

a, b, c = sp.symbols("a b c", real=True)


def _doubled(first, times):
    """An expression of 2^times occurrences of ``first`` in some ``times`` parts."""
    for _ in range(times):
        first = sp.sin(first) + sp.cos(first) ** 2
    return first


def test_an_expression_of_a_trillion_parts_is_replaced_and_found_long():
    expr = _doubled(a * b, 40)
    assert replaced(expr, {a: c}) == _doubled(c * b, 40)
    assert is_longer(expr, 10_000)
    assert atoms(expr, sp.Symbol) == {a, b}
    assert len(atoms(expr, sp.sin)) == 40


def test_quotients_nested_deep_are_one_quotient_of_short_polynomials():
    nested = a
    for _ in range(20):
        nested = 1 / (2 + b * nested)
    found = unnested(nested)
    assert found.count_ops() < 150
    place = {a: sp.Rational(3, 7), b: sp.Rational(5, 3)}
    assert found.subs(place) == nested.subs(place)


def test_terms_of_a_long_expression_are_not_multiplied_out_to_be_counted(monkeypatch):
    """Those of the reactions of three cylinders in a pyramid were for a minute and a half."""
    every = [sp.Symbol(f"q{k}") for k in range(80)]
    product = sp.Mul(*(sp.sin(q) + q * a + b for q in every))
    monkeypatch.setattr(long, "_monomials", lambda *_: pytest.fail("terms were multiplied out"))
    assert heavy(product)


def test_sums_of_many_quotients_are_long_and_those_of_few_are_not():
    every = [sp.Symbol(f"q{k}") for k in range(20)]
    few, many = (sp.Add(*(a / (1 + q * b**2) for q in every[:n])) for n in (5, 20))
    assert heavy(many)
    assert not heavy(few)
    assert not in_factors(many).is_Mul
    shared = sp.Add(*(q / (1 + a * b**2) for q in every))
    assert not heavy(shared)


def test_an_inverse_is_written_down_without_asking_whether_pivots_vanish(monkeypatch):
    monkeypatch.setattr(sp.matrices.matrixbase.MatrixBase, "inv", None)
    matrix = sp.Matrix([[sp.cos(a), 0, sp.exp(b)], [1, sp.exp(-c), 2], [sp.sin(a), a * b, sp.exp(c)]])
    assert (matrix * inverse_of(matrix)).applyfunc(sp.simplify) == sp.eye(3)


def test_an_expression_of_a_trillion_parts_has_a_derivative_a_value_and_symbols_and_is_carried_out():
    expr = _doubled(a * b, 40)
    assert symbols_in(expr) == {a, b}
    assert parts_with(expr + c, c) == {c, expr + c}
    assert carried_out(expr) == expr
    place = {a: sp.Rational(1, 3), b: sp.Rational(1, 2)}
    slope, step = slope_by(expr, a), sp.Rational(1, 10**15)
    ends = [valued(expr, place | {a: place[a] + sign * step}, 60) for sign in (1, -1)]
    assert abs(valued(slope, place, 60) - (ends[0] - ends[1]) / (2 * step)) < 1e-20


def test_equal_parts_that_are_different_objects_are_one_object_where_something_is_replaced():
    parts = [sp.Add._from_args((b, sp.sin(a))) for _ in range(2)]
    assert parts[0] is not parts[1]
    first, second = replaced(sp.Tuple(*parts), {b: c}).args
    assert first is second


def test_a_value_is_that_of_sympy_and_not_a_number_where_a_part_is_not_real():
    expr = sp.sqrt(a - b) / 3 + sp.Max(a, 1) * sp.pi
    assert valued(expr, {a: sp.Integer(3), b: sp.S.One}, 30) == expr.evalf(30, subs={a: 3, b: 1})
    assert valued(expr, {a: sp.S.One, b: sp.Integer(3)}, 30) is sp.nan
    assert valued(expr, {a: sp.Integer(3)}, 15).free_symbols == {b}


def test_a_rate_of_a_trillion_parts_is_found_not_to_be_affine():
    system = ap.System.smooth({a: b, b: -a}, {}, None)
    assert affine_parts(system, _doubled(a * b, 40)) is None
    assert affine_parts(system, _doubled(sp.sqrt(a - b - 9), 40)) is None  # without a real value at a generic place
    assert affine_parts(system, b + _doubled(c, 40) * a)[0] == (_doubled(c, 40), 1)


@pytest.mark.parametrize("expr", [
    a, -a, a - b / c, -a / b / c - c, sp.Rational(-3, 7), sp.sin(a - b) ** 2 / (a + 2) - sp.sqrt(b),
    sp.Piecewise((a, a > 0), (b, True)), sp.Tuple(a, -a * b, c - sp.Abs(b)), _doubled(a - b / c, 4),
])
def test_replacing_and_measuring_a_short_expression_are_those_of_sympy(expr):
    rule = {a: b * c, b: a, c: sp.Integer(2)}
    assert replaced(expr, rule) == expr.xreplace(rule)
    assert atoms(expr, sp.Pow, sp.Function) == expr.atoms(sp.Pow, sp.Function)
    operations = expr.count_ops()
    assert is_longer(expr, operations - 1) if operations else expr.is_Atom
    assert carried_out(expr) == expr.doit()
    assert symbols_in(expr) == expr.free_symbols
    assert not is_longer(expr, operations)


@pytest.mark.parametrize("expr", [
    a / (2 * a + 2) + 1 / (2 * a + 2), a / (b + c / a) - 1, (a / b) ** 2 / (1 + 1 / a) ** 2, 1 / a - 1 / (b - a) / b,
    (a + b / c) ** -3 * (c / b - 1 / a), sp.pi / a + a / sp.pi, 1 / (a - b) + 1 / (b - a), c + (a**2 - b**2) / (a + b),
])
def test_a_quotient_is_tidied_to_the_one_over_a_common_denominator_without_common_factors(expr):
    assert tidied(expr) == sp.cancel(expr)


def test_a_divisor_with_a_square_is_left_whole_unless_it_cancels():
    whole = 1 + (1000 * a - 2000) ** 2
    assert tidied(1 / whole**2) == 1 / whole**2
    assert tidied(whole / (whole + b**2) - 1 / (1 + b**2 / whole)) == 0


def test_the_modulus_of_an_expression_of_a_trillion_terms_is_not_expanded():
    def long(of):
        return -c - sp.Mul(*(sp.sin(k * of) + b + c for k in range(1, 26)))

    assert replaced(sp.Abs(long(a), evaluate=False), {a: b}) == modulus(long(b)) == sp.Abs(long(b), evaluate=False)
    assert modulus(-2 * a) == 2 * sp.Abs(a)
    jump = sp.Piecewise((1, sp.Gt(long(a), 0, evaluate=False)), (2, True), evaluate=False)
    assert shortly_after(jump, lambda part: sp.S.One, 1e-15).has(sp.Abs(long(a), evaluate=False))


def test_a_least_of_long_expressions_stays_as_it_stands_where_its_parts_are_replaced():
    """SymPy would compare them: here it finds that one is the greater, of determinants it finds nothing in minutes."""
    long_sum = sp.Add(*(sp.sin(k * a) for k in range(1, 90)))
    for kind in (sp.Min, sp.Max):
        two = kind(long_sum, long_sum + 1, evaluate=False)
        for found in (replaced(two, {a: b}), carried_out(two)):
            assert found.func is kind
            assert len(found.args) == 2
    assert replaced(sp.Min(a, b), {b: a + 1}) == a


def test_an_expression_is_clearly_nonzero_at_a_place_where_it_has_a_value_that_no_rounding_has():
    assert is_clearly_nonzero(_doubled(a - b / c, 8))
    assert is_clearly_nonzero(sp.exp(a) - 1 - a)
    for unknown in (sp.sin(a) ** 2 + sp.cos(a) ** 2 - 1, 10**30 * (sp.sin(2 * a) - 2 * sp.sin(a) * sp.cos(a)),
                    sp.sqrt(-1 - a**2), 1 / sp.Add(a, -a, evaluate=False)):
        assert not is_clearly_nonzero(unknown)


def test_no_simple_relation_holds_at_a_generic_place():
    """The third of all symbols was 1 there, and the first 5/7: inertia in these could be called singular."""
    for relation in (7 * a - 5, a * b * (c - 1), a * b * sp.log(c), 8 * a * b - 5 * c**2):
        assert is_clearly_nonzero(relation)
    assert not has_no_inverse(a * b * sp.Matrix([[1, c], [c, 1]]))


def test_generic_numbers_are_short_as_bases_of_ideals_at_them_would_grow_long():
    """With numbers of 52 bits the basis for three quartics took 25 s, with these 4 s."""
    symbols = sp.symbols("s0:20")
    place = long.generic_place(sp.Tuple(*symbols))
    assert len({*place.values()}) == len(symbols)
    assert all(1 / sp.Integer(2) < number < 1 and number.q < 300 for number in place.values())
    assert is_clearly_nonzero(sp.Mul(*symbols))


def test_a_matrix_is_regular_at_a_place_where_its_determinant_is_not_zero_for_all_values():
    turned = sp.Matrix([[sp.cos(a), -sp.sin(a)], [sp.sin(a), b * sp.cos(a)]])
    assert has_no_inverse(turned) is False
    rows = sp.Matrix(4, 4, [sp.Symbol(f"{row}{k}") for row in "abcd" for k in range(4)])
    assert has_no_inverse(rows * rows.T) is False  # with numbers that are nearly dependent, as of neighbours
    assert has_no_inverse(sp.Matrix([[0, 1], [0, c]])) is not False
    assert has_no_inverse(sp.Matrix([[sp.cos(a) ** 2, 1 - sp.sin(a) ** 2], [c, c]])) is not False
    for unknown in (sp.log(a - a), 1 / (sp.sin(a) ** 2 + sp.cos(a) ** 2 - 1)):
        assert has_no_inverse(sp.Matrix([[unknown, 1], [0, 1]])) is not False
    for root in (sp.sqrt(-1 - a**2), sp.sqrt(a - 1)):  # complex at the place
        assert has_no_inverse(sp.Matrix([[root, 1], [0, 1]])) is False
        assert has_no_inverse(sp.Matrix([[root, 1], [root**2, root]])) is True


def test_a_matrix_that_many_digits_leave_singular_is_so_in_any_units():
    row = sp.Matrix([[sp.sin(a), b / c, sp.exp(-a) * b]])
    dependent = sp.Matrix.vstack(row, row.applyfunc(sp.cos), 2 * row + row.applyfunc(sp.cos) / c)
    units = sp.diag(1, sp.Rational(1, 10**15), 10**15)
    assert all(map(has_no_inverse, (dependent, units * dependent, dependent * units)))
    assert not has_no_inverse(units * (dependent + sp.diag(0, 0, sp.Rational(1, 10**9))))
    assert not has_no_inverse(sp.Matrix([[sp.sqrt(-1 - a**2), 1], [0, 1]]))


def test_no_determinant_in_symbols_tells_whether_slip_determines_the_forces_on_three_feet(monkeypatch):
    x, y, turn = dynamicsymbols("x y turn")
    t, m, J, h = dynamicsymbols._t, *sp.symbols("m J h", positive=True)
    places = (y - h * sp.cos(turn) - k * b * sp.sin(turn) for k in (-1, 0, 1))
    slips = (x + h * sp.sin(turn) - k * b * sp.cos(turn) for k in (-1, 0, 1))
    first, *others = (ap.Contact(gap=gap, slip=slip, friction=c**2, unilateral=True)
                      for gap, slip in zip(places, slips, strict=True))
    energy = m * (x.diff(t) ** 2 + y.diff(t) ** 2) / 2 + J * turn.diff(t) ** 2 / 2 - m * y
    table = ap.Mechanism.from_lagrangian(energy, (x, y, turn), contact=first, others=others).rigid()
    monkeypatch.setattr(sp.MatrixBase, "det", None)
    assert not determined(table, (Phase(1, 1),) * 3)


def test_forces_of_contacts_in_any_directions_are_solved_for_without_an_expanded_determinant(monkeypatch):
    """Its terms are products of the entries of both contacts: it took minutes."""
    q, u, Q, *rows = ([sp.Symbol(f"{name}{k}", real=True) for k in range(4)] for name in ("q", "u", "Q", *"nNsS"))
    gaps, slips = ([sp.Add(*(r * x for r, x in zip(row, by, strict=True))) for row in pair]
                   for pair, by in ((rows[:2], q), (rows[2:], u)))
    first, other = (ap.Contact(gap, slip, c**2, unilateral=True) for gap, slip in zip(gaps, slips, strict=True))
    feet = ap.Mechanism(q, u, sp.eye(4), Q, first, None, (other,)).rigid()
    det = sp.MatrixBase.det
    monkeypatch.setattr(sp.MatrixBase, "det", lambda matrix, method: det(matrix, method))
    place = {x: sp.Rational(k + 2, 7 - k % 3) for k, x in enumerate(sorted({*feet.parameters, *feet.states}, key=str))}
    for slides in (0, 1):
        at = {force: value.xreplace(place) for force, value in forces(feet, (Phase(1, slides),) * 2).items()}
        assert all(f.constraint.xreplace(at | place) == 0 for f in feet.frictions)


def test_forces_on_many_blocks_that_stick_are_solved_for_one_after_the_other(monkeypatch):
    """By cofactors 30 of them took 14 times as long."""
    count, d = 6, sp.Symbol("d", positive=True)
    speeds, sticking = (sp.symbols(f"{name}:{count}", real=True) for name in ("v", "F"))
    rates = [(own - below / 2 + c) / d for own, below in zip(sticking, (sp.S.Zero, *sticking[:-1]), strict=True)]
    frictions = [ap.Friction(speed, own, load=1, kinetic=1) for speed, own in zip(speeds, sticking, strict=True)]
    system = ap.System.with_frictions(dict(zip(speeds, rates, strict=True)), {}, frictions)
    monkeypatch.delattr(sp.MatrixBase, "adjugate")
    found = forces(system, tuple(Phase(1, 0) for _ in range(count)))
    assert found[sticking[-1]] == -c * (2 - sp.Rational(1, 2) ** (count - 1))


def test_a_body_of_three_freedoms_and_many_parameters_sticks_in_formulas_of_thousands_of_operations():
    """A woodpecker on its sleeve, which meets the pole with two edges, its beak with a spring: angles a and b."""
    u, v, w, F, N, G, R = sp.symbols("u v w F N G R", real=True)
    m, M, A, B, p, q, h, r, d, s, f, g, k = sp.symbols("m M A B p q h r d s f g k", positive=True)
    mass = sp.Matrix([[m + M, M * p, M * q], [M * p, A + M * p**2, M * p * q], [M * q, M * p * q, B + M * q**2]])
    twist, beak = s * (a - b), k * q**2 * sp.Max(0, b - g)
    forces = [F + G - (m + M) * g, h * (N - R) + r * (F + G) - twist - M * g * p, twist - M * g * q - beak]
    rates = mass.inv() * sp.Matrix(forces)
    edges = [ap.Friction(velocity=u + r * v, force=force, load=-k * (side * h * a + d) - side * s * v, kinetic=f,
                         gap=side * h * a + d, normal=normal)
             for side, force, normal in ((1, F, N), (-1, G, R))]
    toy = ap.System.with_frictions({a: v, b: w, u: rates[0], v: rates[1], w: rates[2]}, {}, edges)
    stick = mode_of(toy, (Phase(1, 0), Phase(1, 1)))
    assert sum(rate.count_ops() for rate in stick.rates) < 10_000
    place = {x: sp.Rational(j + 2, 7 - j % 3) for j, x in enumerate(sorted({*toy.parameters, *toy.states}, key=str))}
    assert (stick.rates[2] + r * stick.rates[3]).subs(place) == 0


def test_an_expression_without_penetration_or_roots_on_a_side_is_left_though_it_has_the_same_part_very_often():
    nested = _doubled(sp.sqrt(a), 60)
    assert without_penetration(nested) is nested
    assert with_real_powers(nested, ((b, 1),)) is nested


def test_a_quotient_comes_over_one_denominator_without_being_expanded_before(monkeypatch):
    """Expanded, the forces of three contacts of a woodpecker toy had 19000 operations in place of 280."""
    a, b, c, d = sp.symbols("a b c d", positive=True)
    inertia = a * c - b**2
    quotient = (a + b) * (c - d * (a + d)) / inertia + (b + d) * (a - c) / inertia + d
    expected = long.tidied(quotient)
    assert sp.cancel(expected - quotient) == 0
    assert sp.fraction(expected)[1] in {inertia, -inertia}
    monkeypatch.setattr(long, "expanded", lambda expr: pytest.fail(f"expanded {expr}"))
    assert long.tidied(quotient) == expected


def test_the_common_divisor_of_fractions_does_not_stop_at_a_1():
    assert common_divisor(map(sp.Rational, ("1", "1", "5/9", "1/2", "1/8"))) == sp.Rational(1, 72)
    assert common_divisor([sp.Integer(-6), sp.Integer(4)]) == 2


def test_exponentials_that_are_high_powers_of_one_are_factored_as_they_are():
    expr = a * sp.exp(b / 10) - a * c * sp.exp(b / 18 - 2)
    assert in_factors(expr) == -a * (c * sp.exp(b / 18 - 2) - sp.exp(b / 10))
    assert in_factors(sp.exp(2 * a) - 1) == (sp.exp(a) - 1) * (sp.exp(a) + 1)


def test_exponentials_that_are_high_powers_of_one_are_named_as_powers_of_those_among_them():
    names, meaning = long.named_exponentials(sp.exp(-2 * b / 10 - 2) + sp.exp(b / 10 + 1) + sp.exp(b / 18) + sp.exp(-1))
    assert {name: e for e, name in names.items()}.keys() >= meaning.keys()
    assert len(meaning) == 3
    for e, name in names.items():
        assert sp.expand(sp.log(name.xreplace(meaning)) - e.exp) == 0


def test_an_exponential_of_a_sum_is_the_product_of_those_beside_it():
    """With a name of its own it hid the factors, and that the second expression is 0."""
    assert in_factors(sp.exp(a + b) + sp.exp(b) - sp.exp(a) - 1) == (sp.exp(a) + 1) * (sp.exp(b) - 1)
    assert in_factors(sp.exp(a - b) * sp.exp(b - c) - sp.exp(a - c)) == 0


def test_a_matrix_that_is_singular_everywhere_has_no_inverse_where_rounding_leaves_a_pivot_or_a_column_has_none():
    """The first is that of a drawer which jams in its guides."""
    square = sp.cos(a) ** 2
    half = sp.Matrix([[square, -2 * square], [-2 * square, 4 * square]])
    jammed = sp.Matrix(sp.BlockMatrix([[sp.eye(2) + half, sp.eye(2) - half], [sp.eye(2) - half, sp.eye(2) + half]]))
    for singular in (jammed, sp.Matrix([[0, 0, a], [0, 0, b], [0, 0, 1]])):
        assert has_no_inverse(singular)
        assert has_no_inverse(singular + sp.eye(singular.rows)) is False
