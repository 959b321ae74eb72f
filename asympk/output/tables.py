"""The paper's tables of derived results, as rows of symbols and words."""

import sympy as sp

from asympk.asymptotics.jump import jump_map
from asympk.ledger import claims
from asympk.output.tabular import Cell, Table, values_of, words
from asympk.symbolic.manifold import rest_state, slow_manifolds
from asympk.symbolic.regimes import regimes
from asympk.symbolic.stability import Eigenvalues, eigenvalues
from asympk.symbolic.stick import RegionCell, latex_union, spans_in_words
from asympk.systems import painleve_klein as pk

_MODE = {
    "slip_same": "slip, $s z > 0$ (2.7)",
    "slip_opposite": "slip, $s z < 0$ (2.8)",
    "stick": "stick, $z = 0$ (2.9)",
}
_S = sp.Symbol("s", real=True)


def groups_table() -> Table:
    """Nondimensional groups of section 2 with their definitions in physical quantities."""
    rows = tuple((group.meaning, group.symbol, group.definition) for group in pk.groups())
    return Table("groups", "lcl", ("quantity", "symbol", "definition"), rows)


def modes_table() -> Table:
    r"""The right-hand sides mu y' and z' of every mode in terms of s = x + y; x' = y in all."""
    rows = tuple((_MODE[mode.name], _of_load(mode.fast[pk.y]), _of_load(mode.slow[pk.z])) for mode in pk.system().modes)
    return Table("modes", "lll", ("mode", Cell(r"$\mu \dot y$", "mu y'"), Cell(r"$\dot z$", "z'")), rows)


def _of_load(expr):
    """Make a cell of an expression that is linear in the load: 1 - (sigma + 4) s."""
    linear = sp.Poly(expr.subs(pk.y, _S - pk.x), _S)
    rest, slope = linear.coeff_monomial(1), linear.coeff_monomial(_S)
    if not slope:
        return rest
    sign, size = ("-", sp.expand(-slope)) if slope.could_extract_minus_sign() else ("+", slope)
    return Cell(f"${_linear(rest, sign, size, sp.latex, ' ')}$", _linear(rest, sign, size, str, "*"))


def _linear(rest, sign, size, form, times):
    front = f"{form(rest)} {sign} " if rest else sign.replace("+", "")
    factor = form(size) if size.is_Atom else f"({form(size)})"
    return f"{front}{'' if size == 1 else factor + times}{form(_S)}"


def manifolds_table() -> Table:
    """Slow manifolds by range of sigma: place, stability, first term in mu, and the acceleration on them."""
    planes = {plane.name: plane for plane in slow_manifolds(pk.system(), order=1)}
    rows = [_manifold_row(planes["Pi1"], "all", regimes(pk.system())[0].passages[0])]
    for regime in (regimes(pk.system())[0], regimes(pk.system())[-1]):
        side = r"$\sigma > 0$" if regime.condition == (pk.sigma > 0) else r"$\sigma < 0$"
        rows.append(_manifold_row(planes["Pi2"], side, regime.passages[1]))
    drift = Cell(r"$\dot z$ on it", "z' on it")
    header = ("plane", r"$\sigma$", r"at $\mu = 0$", r"$\mu$ term of $y$", "lives in", "", drift)
    return Table("manifolds", "lllllll", header, tuple(rows))


def _manifold_row(plane, where, passage):
    return (Cell(rf"$\Pi_{plane.name[-1]}$", plane.name), where, sp.Eq(_S, sp.cancel(pk.x + plane.coefficient(0))),
            sp.factor(plane.coefficient(1)), *_place(passage), rest_state(plane).drift[pk.z])


def _place(passage):
    return f"$z {'>' if passage.side > 0 else '<'} 0$", "attracts" if passage.stable else "repels"


def eigenvalues_table() -> Table:
    """Exact slow and fast eigenvalues of every mode, and the mu at which node turns to focus."""
    spectra = (s for s in eigenvalues(pk.system()) if isinstance(s, Eigenvalues))
    rows = tuple((_MODE[s.mode], s.slow, s.fast, s.coalescence) for s in spectra)
    header = ("mode", "slow eigenvalue", "fast eigenvalue", r"node to focus at $\mu$")
    return Table("eigenvalues", "llll", header, rows)


def regimes_table() -> Table:
    """The ranges of sigma between thresholds: stick region, side and stability of Pi2, where its motions meet z = 0."""
    rows = tuple(_regime_row(regime) for regime in regimes(pk.system()))
    header = (r"$\sigma$", "stick on $z = 0$, $s$ in", r"$\Pi_2$", r"its motions meet $z = 0$ in",
              Cell(r"from $z < 0$, as $\mu \to 0$", "from z < 0 as mu -> 0"))
    return Table("regimes", "lllll", header, rows)


def _regime_row(regime):
    second, stick = regime.passages[1], RegionCell(sp.true, regime.stick).put({pk.sigma0: pk.sigma}).spans
    reached = {"stick": "the stick region", "edge": "the edge of stick", "up": "upward crossing",
               "down": "downward crossing", None: "--"}
    return (values_of(regime.sigma, regime.values), Cell(f"${latex_union(stick)}$", spans_in_words(stick)),
            ", ".join(_place(second)) if second.side else "does not exist", reached[second.meets],
            _from_below(second.side))


def _from_below(side):
    """Make a cell on the motion from z < 0: slow motion on Pi2, or the jump x -> x - z with its leading time.

    At sigma = 0 no exponential grows: by mu y' = 1 and z' = 1 + s, z reaches 0 after sqrt(-2 mu z) to leading order.
    """
    if side < 0:
        return Cell(r"to $\Pi_2$ and along it", "to Pi_2 and along it")
    if not side:
        return Cell(r"jumps in $\sqrt{-2\mu z}$", "jumps in sqrt(-2 mu z)")
    time = sp.expand(jump_map(pk.system(), order=1, start={pk.sigma: 1}).events[1].t.coefficient(1, 1))
    return Cell(rf"jumps in $({sp.latex(time)})\,\mu L$", f"jumps in ({time}) mu log(1/mu)")


def claims_table() -> Table:
    """The ledger: every claim of the paper with its verdict, and what holds where it is not a plain confirmation."""
    rows = []
    for claim in claims():
        rows.append((claim.id, words(claim.statement), claim.verdict))
        if claim.finding:
            rows.append(("", Cell(rf"\emph{{{words(claim.finding).latex}}}", claim.finding), ""))
    return Table("claims", r"lp{0.82\linewidth}l", ("claim", "statement", "verdict"), tuple(rows))
