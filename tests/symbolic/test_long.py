"""Long expressions: a part that occurs many times is met once."""

import pytest
import sympy as sp

from asympk.symbolic.long import atoms, is_longer, is_regular, replaced

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


@pytest.mark.parametrize("expr", [
    a, -a, a - b / c, -a / b / c - c, sp.Rational(-3, 7), sp.sin(a - b) ** 2 / (a + 2) - sp.sqrt(b),
    sp.Piecewise((a, a > 0), (b, True)), sp.Tuple(a, -a * b, c - sp.Abs(b)), _doubled(a - b / c, 4),
])  # fmt: skip
def test_replacing_and_measuring_a_short_expression_are_those_of_sympy(expr):
    rule = {a: b * c, b: a, c: sp.Integer(2)}
    assert replaced(expr, rule) == expr.xreplace(rule)
    assert atoms(expr, sp.Pow, sp.Function) == expr.atoms(sp.Pow, sp.Function)
    operations = expr.count_ops()
    assert is_longer(expr, operations - 1) if operations else expr.is_Atom
    assert not is_longer(expr, operations)


def test_a_matrix_is_regular_at_a_place_where_its_determinant_is_not_zero_for_all_values():
    turned = sp.Matrix([[sp.cos(a), -sp.sin(a)], [sp.sin(a), b * sp.cos(a)]])
    assert is_regular(turned)
    assert not is_regular(sp.Matrix([[sp.cos(a) ** 2, 1 - sp.sin(a) ** 2], [c, c]]))
    for unknown in (sp.sqrt(-1 - a**2), sp.log(a - a), 1 / (sp.sin(a) ** 2 + sp.cos(a) ** 2 - 1)):
        assert not is_regular(sp.Matrix([[unknown, 1], [0, 1]]))
