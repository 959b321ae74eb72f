"""The paper's tables of computed results: pure functions of rows."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import groupby

from asympk.output.gallery import ACCURACY
from asympk.output.tabular import Cell, Table, as_cell, words
from asympk.pictures import anymechanism, figures, style
from asympk.storage.rows import Row
from asympk.studies.convergence import by_quantity, monotone_from
from asympk.studies.damping import BORDER
from asympk.studies.decreasing import is_limit
from asympk.studies.divide import MUS, OFFSETS

SHOWN = (1e-4, 1e-8, 1e-12)  # the mu of the columns of the table of convergence


def method_table(rows: Sequence[Row]) -> Table:
    """Each method: the number of its runs with each outcome, and the range of its costs of an error below ``ACCURACY``.

    A cost is that of the cheapest run on one scene at one mu, in units of the exact flow.
    """
    body = []
    for method in (*style.METHODS, *style.MODELS):
        mine = [row for row in rows if row["method"] == method]
        counts = [sum(figures.outcome(row["status"]) == key for row in mine) for key in figures.OUTCOMES]
        places = {(row["scene"], row["mu"]) for row in mine}
        costs = [cost for scene in {s for s, _ in places}
                 for cost in figures.cheapest([r for r in mine if r["scene"] == scene], ACCURACY).values() if cost]
        span = f"{_two_digits(min(costs))} to {_two_digits(max(costs))}" if costs else "--"
        if mine:
            name = style.curve(method)["label"]
            dressed = Cell(name.replace("z/ε", r"$z/\varepsilon$").replace("(z)", "($z$)"), name)
            body.append((dressed, *map(str, counts), f"{len(costs)} of {len(places)}", span))
    bound = _power(ACCURACY)
    header = ("method", "right", "modes missed", "wrong end", "stalled", "budget spent", "refused",
              Cell(f"error below {bound.latex}", f"error below {bound.text}"), "CPU time / exact flow")
    return Table("methods", "lrrrrrrrl", header, tuple(body))


def _two_digits(ratio):
    return f"{ratio:.1f}" if ratio < 10 else f"{float(f'{ratio:.2g}'):.0f}"


def convergence_table(rows: Sequence[Row]) -> Table:
    r"""Each expansion, sigma and order: the largest |error/(first omitted term) - 1| at every mu of ``SHOWN``.

    The largest is over x, z and the times of the events. The last column of an order is the mu below which this number
    falls monotonically with mu for all these quantities.
    """
    orders = sorted({row["order"] for row in rows})
    found: dict[tuple, dict[int, list]] = {}
    for group in by_quantity(rows):
        key = group[0]["expansion"], group[0]["sigma"]
        found.setdefault(key, {n: [] for n in orders})[group[0]["order"]].append(group)
    body = [(words(expansion), _formula(sigma), *(cell for n in orders for cell in _closeness(by_order[n])))
            for (expansion, sigma), by_order in found.items()]
    header: tuple = ("expansion", r"$\sigma$")
    for n in orders:
        header += (*(Cell(f"{n}: " * (k == 0) + mu.latex, f"order {n}, mu = {mu.text}")
                     for k, mu in enumerate(map(_power, SHOWN))), Cell("from", f"order {n}, monotone from mu"))
    return Table("convergence", "ll" + "lllr" * len(orders), header, _grouped(body))


def _grouped(body):
    """Return rows with the first cell left empty in print where it is that of the row before."""
    firsts = [as_cell(row[0]) for row in body]
    return tuple((Cell("", first.text) if k and first == firsts[k - 1] else first, *row[1:])
                 for k, (first, row) in enumerate(zip(firsts, body, strict=True)))


def _closeness(several):
    """Return cells of the largest |excess| at each mu of ``SHOWN``, and of the mu below which all excesses shrink."""
    sizes = {mu: max(abs(row["excess"]) for group in several for row in group if row["mu"] == mu) for mu in SHOWN}
    return [*(_short(sizes[mu]) for mu in SHOWN), _power(min(map(monotone_from, several)))]


def decreasing_table(rows: Sequence[Row]) -> Table:
    """Each system and order: error/measure at three mu; measures are the omitted term, or mu log(1/mu) for a limit."""
    mus = (1e-2, 1e-3, 1e-4)
    body = []
    for (name, order), several in groupby(rows, key=lambda row: (row["system"], row["order"])):
        by_mu = {row["mu"]: row for row in several}
        measure = Cell(r"$\mu\log(1/\mu)$", "mu log(1/mu)") if is_limit(next(iter(by_mu.values()))) else "omitted term"
        cells = [f"${by_mu[mu]['ratio']:.5f}$" if mu in by_mu else "--" for mu in mus]
        body.append((name, _formula(order), measure, *cells))
    header = ("system", "order", "error over", *(Cell(mu.latex, f"mu = {mu.text}") for mu in map(_power, mus)))
    return Table("decreasing", "lllrrr", header, _grouped(body))


def escape_table(rows: Sequence[Row]) -> Table:
    """Starts near the divide, at two values of mu: the time they stay, and which rigid motion they take then.

    The quotient is (time - leading term)/(next term) of the expansion of the time.
    """
    body = []
    for sigma, group in groupby(rows, key=lambda row: row["sigma"]):
        several = list(group)
        for offset in OFFSETS:
            by_mu = {row["mu"]: row for row in several if row["offset"] == offset}
            cells = [cell for mu in MUS for cell in _escape(by_mu[float(mu)])]
            body.append((_formula(Fraction(sigma)), _power(offset), *cells))
    header: tuple = (r"$\sigma$", r"$\delta$")
    for mu in MUS:
        at = f" at mu = {_power(mu).text}"
        header += (Cell(rf"$T$ at $\mu={style.power_of_ten(float(mu))}$", f"T{at}"),
                   *(Cell(name, f"{name}{at}") for name in ("quotient", "motion")))
    return Table("escape", "ll" + "lll" * len(MUS), header, _grouped(body))


def mechanisms_table(rows: Sequence[Row]) -> Table:
    """The catalogue: critical friction, impulses divided by the sliding velocity, and the numbers of the examples.

    Mechanisms with the same formulas share a line, with the numbers of the first of them.
    """
    body = []
    key = ("critical_latex", "normal_latex", "tangential_latex")
    for formulas in dict.fromkeys(tuple(row[k] for k in key) for row in rows):
        same = [row for row in rows if tuple(row[k] for k in key) == formulas]
        row = same[0]
        names = ", ".join(anymechanism.NAMES[r["mechanism"]] for r in same)
        body.append((names, *(f"${part}$" for part in formulas), f"{row['critical']:.4g}", f"{row['friction']:.4g}"))
    header = ("mechanism", "critical friction", r"$P_N/\gamma_0$", r"$P_T/\gamma_0$", "critical", "$f$")
    return Table("mechanisms", ">{\\raggedright}p{1.0in}lllrr", header, tuple(body))


def damping_table(rows: Sequence[Row]) -> Table:
    """Dampings from none to Fufaev's: how often the mass comes to rest, and the time of the jam divided by its law."""
    body = []
    for damping, law, chosen in _dampings(rows):
        cells = [cell for row in chosen for cell in (str(row["sticks"]), f"{row['jam'] / row['law']:.4f}")]
        body.append((damping, _formula(law), *cells))
    header: tuple = ("damping", "$T$ to leading order")
    for epsilon in sorted({row["epsilon"] for row in rows if row["part"] == "ratio"}, reverse=True):
        at = f" at epsilon = {_power(epsilon).text}"
        header += (Cell(rf"$\varepsilon={style.power_of_ten(epsilon)}$", f"times at rest{at}"),
                   Cell("$T$/law", f"T over law{at}"))
    return Table("damping", "ll" + "rl" * 3, header, tuple(body))


def _dampings(rows):
    """Yield (damping as a cell, law in LaTeX, rows from the largest epsilon down)."""
    below, above = r"T_1+\varepsilon L/\zeta", r"T_1+\varepsilon L/(\zeta-\sqrt{\zeta^2-1})"
    single = r"(\varepsilon^2/d)(1+1/\sigma)\log(d|z_0|/\varepsilon^2)"
    ringing = [row for row in rows if row["part"] == "undamped"]
    coarse = Cell(r"none; $\varepsilon=1/2$, $1/3$, $1/4$", "none; epsilon = 1/2, 1/3, 1/4")
    yield coarse, r"\pi\varepsilon A^4/2C", sorted(ringing, key=lambda row: -row["epsilon"])
    ratios = sorted({_to_three(row["zeta"]) for row in rows if row["part"] == "ratio"})
    for place, law in ((3, below), (5, below), (8, above), (10, above), (len(ratios) - 1, single)):
        chosen = [row for row in rows if row["part"] == "ratio" and _to_three(row["zeta"]) == ratios[place]]
        ratio = f"{ratios[place]:g}"
        yield Cell(rf"$\zeta={ratio}$", f"zeta = {ratio}"), law, chosen
    for share, law in zip(BORDER, (above, above, single, single), strict=True):
        bordering = (row for row in rows if row["part"] == "border")
        chosen = [row for row in bordering if round(row["damping"] / row["epsilon"] ** (2 / 3), 6) == share]
        yield Cell(rf"$d={share}\,(\varepsilon^2|z_0|)^{{1/3}}$", f"d = {share} of the border"), law, chosen


def _to_three(ratio):
    return float(f"{ratio:.3g}")


def _escape(row):
    quotient = "--" if row["ratio"] is None else f"{row['ratio']:.6f}"
    return _power(row["time"], 5), quotient, row["motion"]


def _formula(content):
    return Cell(f"${content}$", str(content))


def _short(value):
    """Make a cell of a number to one digit, in a form that is narrow in print: 2e-12."""
    mantissa, exponent = _mantissa_and_exponent(value, 1)
    return Cell(f"{mantissa}e${exponent}$", f"{mantissa}e{exponent}")


def _power(value, digits=1):
    """Make a cell, m x 10^k, of a number or of a string that spells a decimal."""
    mantissa, exponent = _mantissa_and_exponent(value, digits)
    front = {"1": "", "-1": "-"}.get(mantissa, rf"{mantissa}\times ")
    if not exponent:
        return Cell(f"${mantissa}$", mantissa)
    return Cell(f"${front}10^{{{exponent}}}$", f"{mantissa}e{exponent}")


def _mantissa_and_exponent(value, digits):
    mantissa, _, exponent = (value if isinstance(value, str) else f"{value:.{digits - 1}e}").partition("e")
    return mantissa, int(exponent or 0)
