"""Every number and every derived formula that the paper prints, as a LaTeX macro: ``\\newcommand{\\name}{...}``.

Counts come from the ledger, formulas from the derivations, measurements from rows.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from decimal import ROUND_DOWN, ROUND_UP, Context
from itertools import groupby
from math import ceil, log10

import sympy as sp

from asympk.asymptotics.jump import first_integral, jump_map
from asympk.errors import InputError
from asympk.ledger import claims
from asympk.ledger.verdicts import VERDICTS
from asympk.methods import solve
from asympk.numbers import Number
from asympk.output import gallery
from asympk.pictures import figures, portraits, style
from asympk.pictures.anymechanism import limit
from asympk.scene import Scene
from asympk.storage.rows import Row
from asympk.studies import anymechanism, chart, collisions, convergence, damping, divide, leastmap, modelwork, twoguides
from asympk.studies.ladder import distance
from asympk.studies.least import LADDER
from asympk.symbolic.regimes import thresholds
from asympk.systems import painleve_klein as pk

EXAMPLE_MU = "1e-6"
_LOAD, _FIRST, _SECOND = sp.Symbol("s", real=True), sp.Symbol("Lambda_1"), sp.Symbol("Lambda_2")


def macro_definitions(found: Mapping[str, str]) -> str:
    """Return the macros as definitions; raises ``InputError`` for a name that is no macro name."""
    for name in found:
        if not (name.isascii() and name.isalpha()):
            raise InputError(f"{name!r} cannot name a macro: use letters alone")
    return "".join(f"\\newcommand{{\\{name}}}{{{value}}}\n" for name, value in sorted(found.items()))


def power(value: Number, digits: int = 2) -> str:
    """Return a number as ``m \\times 10^k``, m with ``digits`` significant digits, or as 10^k where m is 1.

    >>> power(1.5331e-7), power(1e-8), power(0)
    ('\\\\ensuremath{1.5\\\\times 10^{-7}}', '\\\\ensuremath{10^{-8}}', '0')
    """
    if value == 0:
        return "0"
    mantissa, exponent = f"{float(value):.{digits - 1}e}".split("e")
    front = "" if float(mantissa) == 1 else rf"{mantissa}\times "
    return rf"\ensuremath{{{front}10^{{{int(exponent)}}}}}"


def bound(value: float, rounding: str = ROUND_UP) -> str:
    """Return a bound of one significant digit: what is "at most" is rounded up, and what is "up to" is rounded down.

    >>> bound(1.12e-10), bound(1.66e-3, ROUND_DOWN)
    ('\\\\ensuremath{2\\\\times 10^{-10}}', '\\\\ensuremath{10^{-3}}')
    """
    return power(float(Context(prec=1, rounding=rounding).create_decimal(repr(float(value)))), 1)


def decimal(value: Number, places: int) -> str:
    """Return a number with ``places`` decimal places."""
    return rf"\ensuremath{{{float(value):.{places}f}}}"


def inline_formula(expr: sp.Basic) -> str:
    """Return an expression as inline LaTeX."""
    return rf"\ensuremath{{{sp.latex(expr)}}}"


def claim_macros() -> dict[str, str]:
    """Return the number of claims, the number of claims with each verdict, and the number of checks."""
    found = claims()
    by = Counter(claim.verdict for claim in found)
    verdicts = {f"claims{verdict.capitalize()}": str(by[verdict]) for verdict in VERDICTS}
    return {"claimCount": str(len(found)), "checkCount": str(sum(len(c.evidence) for c in found)), **verdicts}


def formula_macros() -> dict[str, str]:
    """Return the derived formulas, and the mu at which they are drawn in the phase space.

    The formulas are the loads of planes and edges, the thresholds of sigma, and the integral of Lemma 3.
    """
    names = {"Pi1": "PiOne", "Pi2": "PiTwo", "Gamma1": "GammaOne", "Gamma2": "GammaTwo"}
    levels = {f"load{names[name]}": inline_formula(expr) for name, expr in portraits.level_formulas().items()}
    ordinals = ("thresholdOne", "thresholdTwo", "thresholdThree")
    cuts = dict(zip(ordinals, map(inline_formula, thresholds(pk.system())), strict=True))
    integral = inline_formula(first_integral(pk.system()).expr)
    return {**levels, **cuts, "integral": integral, "phaseMu": rf"\ensuremath{{{gallery.PHASE_MU}}}"}


def jump_macros() -> dict[str, str]:
    """Return the jump map from z < 0 for sigma0 = sigma; Lambda_1 and Lambda_2 stand for its two logarithms."""
    jump = jump_map(pk.system(), order=1, start={pk.sigma: 1})
    landing, leaving = jump.events
    found = {
        "landMuY": inline_formula(landing.y.coefficient(-1)),
        "landX": inline_formula(pk.x + sp.factor(sp.cancel(landing.x.coefficient(0) - pk.x))),
        "landTime": inline_formula(landing.t.coefficient(1, 1)),
        "leaveTime": inline_formula(sp.expand(leaving.t.coefficient(1, 1))),
        "jumpX": inline_formula(jump.x.coefficient(0)),
    }
    for name, series in (("X", jump.x), ("Z", jump.z)):
        logs = {log: _SECOND if log.has(pk.sigma0) else _FIRST for log in series.coefficient(1).atoms(sp.log)}
        known = {symbol: log for log, symbol in logs.items()}
        found[f"jump{name}Log"] = inline_formula(_by_powers(series.coefficient(1, 1)))
        rest = _by_powers(series.coefficient(1).subs(logs))
        plain = rest.as_independent(*known)[0]
        found[f"jump{name}Rest"] = inline_formula(plain)
        found[f"jump{name}RestLogs"] = inline_formula(rest - plain)
    first, second = (inline_formula(_shown(known[log])) for log in (_FIRST, _SECOND))
    return found | {"firstLog": first, "secondLog": second}


def escape_macros() -> dict[str, str]:
    """Return a start at the divide, and the times to leave the divide for load offsets delta and exp(-q/mu)."""
    found = divide.divide(pk.system())
    above, below = found.escape_above, found.escape_below
    return {
        "escapeX": rf"\ensuremath{{{divide.START[0]}}}",
        "escapeZ": rf"\ensuremath{{{divide.START[1]}}}",
        "escapeAbove": inline_formula(above.coefficient(1)),
        "escapeBelowLog": inline_formula(below.coefficient(1, 1)),
        "escapeBelow": inline_formula(below.coefficient(1)),
        "delayTime": inline_formula(found.delay.coefficient(0).subs(divide.DEPTH, sp.Symbol("q"))),
    }


def _shown(expr):
    """Return an expression with s in place of x + y, and sigma in place of sigma0."""
    return expr.subs(pk.y, _LOAD - pk.x).subs(pk.sigma0, pk.sigma)


def _by_powers(expr):
    """Return an expression collected by the two logarithms and by z, each coefficient factored."""
    apart = sp.expand(sp.cancel(_shown(expr)))
    return sp.Add(*(
        log * sp.collect(sp.expand(apart.coeff(log)), pk.z, sp.factor) for log in (_FIRST, _SECOND)
    )) + sp.collect(apart.subs({_FIRST: 0, _SECOND: 0}), (pk.z, _LOAD), sp.factor)


def example_macros() -> dict[str, str]:
    """Return the two events of scene (ii), backward on a steep rod, at a small mu."""
    path = solve(Scene(1, EXAMPLE_MU, gallery.JUMP_START, 5))
    hit, leave = path.events
    return {
        "exampleMu": power(float(EXAMPLE_MU)),
        "hitTime": power(hit.t, 3), "hitX": decimal(hit.x, 5), "hitY": power(hit.y, 2),
        "leaveTimeExample": power(leave.t, 3), "leaveX": decimal(leave.x, 5),
    }


def accuracy_macros() -> dict[str, str]:
    """Return a power of ten that bounds the errors of the exact flow in doubles on the chart's scenes and values of mu.

    An error is relative to the largest of 1 and the final states, against a run with 30 digits.
    """
    scenes = [Scene(1, mu, start, 5) for start in chart.SCENES.values() for mu in chart.MUS]
    worst = max(distance(solve(scene).final, solve(scene, digits=30).final) for scene in scenes)
    return {"doublesError": power(10.0 ** ceil(log10(worst))), "doublesRuns": str(len(scenes)),
            "doublesLeastMu": power(1e-8)}


def of_convergence(rows: Sequence[Row]) -> dict[str, str]:
    """Return the largest |error/(first omitted term) - 1| at the least mu for each order, and errors at sigma = 1.

    ``monotoneMu`` is the mu below which all these numbers fall; that beyond the divide has a macro of its own.
    """
    found = {"convergenceLeastMu": power(least := min(row["mu"] for row in rows)),
             "convergenceUntil": str(convergence.UNTIL), "convergenceDigits": str(convergence.DIGITS)}
    for order, name in ((0, "Zero"), (1, "One"), (2, "Two")):
        away = [abs(row["excess"]) for row in rows if (row["order"], row["mu"]) == (order, least)]
        found[f"ratioOrder{name}"] = bound(max(away))
    here = [row for row in rows if (row["expansion"], row["sigma"]) == ("z < 0, s > 0", "1")]
    at = next(row["mu"] for row in here if row["mu"] == float(EXAMPLE_MU))
    for order, name in ((0, "Zero"), (1, "One")):
        errors = [abs(r["error"]) for r in here if (r["order"], r["mu"]) == (order, at) and r["quantity"] in "xz"]
        found[f"errorOrder{name}"] = power(max(errors))
    since = [(group[0]["expansion"] == "z > 0, s < -1/sigma", convergence.monotone_from(group))
             for group in convergence.by_quantity(rows)]
    for beyond, name in ((False, "monotoneMu"), (True, "monotoneMuBeyond")):
        found[name] = power(min(mu for which, mu in since if which is beyond))
    return found


def of_jump_law(rows: Sequence[Row]) -> dict[str, str]:
    """Return the compliances at which errors of the jump law were measured, and how sure the limits A are.

    ``jumpLawAgreement`` is the largest relative change of a limit A where its last row is left out.
    """
    several = [list(group) for _, group in groupby(rows, key=lambda row: row["mechanism"])]
    moved = max(abs(limit(group[:-1]) / limit(group) - 1) for group in several)
    found = {"jumpLawLayer": str(anymechanism.LAYER), "jumpLawAgreement": bound(moved)}
    return found | _least_and_most("jumpLaw", [row["compliance"] for row in rows], power)


def of_rebound(rows: Sequence[Row]) -> dict[str, str]:
    """Return eps of the contact whose rebound was followed, and the largest relative deviation from the formula."""
    away = max(abs(row["followed"] / row["law"] - 1) for row in rows if row["followed"] is not None)
    return {"reboundStiff": power(anymechanism.STIFF), "reboundWorst": bound(away)}


def of_contacts(rows: Sequence[Row]) -> dict[str, str]:
    """Return the number of integrator runs with two contacts, of runs that end right, and the methods of the others."""
    integrated = [row for row in rows if row["method"] not in chart.CRUDE]
    short = [row for row in integrated if row["status"] != "finished"]
    return {
        "contactRuns": str(len(integrated)), "contactRight": str(len(integrated) - len(short)),
        "contactShortNames": _names(short), "contactKappa": rf"\ensuremath{{{twoguides.KAPPA}}}",
        "contactUntil": str(twoguides.UNTIL),
    }


def of_models(rows: Sequence[Row]) -> dict[str, str]:
    """Return the range over mu of the cost of the cheapest integrator per that of ``jump 1``, at the same error."""
    saved = modelwork.savings([*rows])
    found = {"modelNames": _names([row for row in rows if not row["method"].startswith("jump")])}
    found |= _least_and_most("modelMu", [mu for _, mu in saved], power)
    for name, system in (("Rod", "nonlinear rod"), ("Reaction", "enzyme reaction")):
        ratios = [min(cost for cost in costs.values() if cost) for (of, _), costs in saved.items() if of == system]
        found |= _least_and_most(f"model{name}", ratios, rounded)
    return found


def of_peer(rows: Sequence[Row]) -> dict[str, str]:
    """Return the cost of the affine flow in units of the rod's kernel, and of LSODA in units of the affine flow."""
    affine, lsoda = ([row[column] for row in rows] for column in ("affine", "lsoda"))
    return _least_and_most("peer", affine, rounded) | _least_and_most("peerLsoda", lsoda, rounded)


def _least_and_most(name: str, numbers: Sequence[float], dress: Callable[[float], str]) -> dict[str, str]:
    return {f"{name}Least": dress(min(numbers)), f"{name}Most": dress(max(numbers))}


def of_collisions(rows: Sequence[Row]) -> dict[str, str]:
    """Return the number of starts, and the largest number of stops at the small and at the large mu."""
    small, large = (max(r["count"] for r in rows if r["mu"] == mu) for mu in collisions.MUS)
    names = {"collisionMuSmall": power(collisions.MUS[0]), "collisionMuLarge": f"{collisions.MUS[1]:g}"}
    return {"collisionRuns": str(len(rows)), "collisionsSmall": str(small), "collisionsLarge": str(large),
            "collisionUntil": str(collisions.UNTIL), **names}


def of_least(rows: Sequence[Row]) -> dict[str, str]:
    """Return the atlas's parameters, and the largest mu at which ``rigid`` (shallow) and ``jump-0`` (steep) suffice."""
    found = {"leastRuns": str(len(rows)), "leastTolerance": power(leastmap.RTOL), "leastUntil": f"{leastmap.UNTIL:g}",
             "leastLoad": rf"\ensuremath{{{leastmap.START[1]:g}}}"}
    for name, sigma, side, rung in (("Shallow", "-1/2", 1, "rigid"), ("Steep", "1", -1, "jump-0")):
        here = [row for row in rows if row["sigma"] == sigma and row["z"] * side > 0]
        beyond = min(row["mu"] for row in here if row["rung"] > list(LADDER).index(rung))
        found[f"least{name}Mu"] = bound(max(row["mu"] for row in here if row["mu"] < beyond), ROUND_DOWN)
    return found


def of_damping(rows: Sequence[Row]) -> dict[str, str]:
    """Return the largest relative deviations of jam times from their laws, and macros on the undamped rod."""
    least = min(row["epsilon"] for row in rows)
    ratio, border = ([r for r in rows if (r["part"], r["epsilon"]) == (part, least)] for part in ("ratio", "border"))
    undamped = [row for row in rows if row["part"] == "undamped"]
    off = [(row, abs(row["jam"] / row["law"] - 1)) for row in ratio if not damping.is_single(row)]
    above, below = (max(size for row, size in off if (row["zeta"] > 1) is over) for over in (True, False))
    jams = dict(zip(damping.BORDER, (row["jam"] for row in border), strict=True))
    return {
        "dampingRuns": str(len(rows)), "dampingLeast": power(least), "dampingAbove": bound(above),
        "dampingBelow": bound(below), "lossPerPeriod": decimal(damping.loss_per_period(1), 4),
        "undampedFactor": decimal(damping.undamped_factor(1), 2), "dampingDrop": power(jams[0.99] / jams[1.01], 1),
        "undampedTimes": gallery.in_a_sentence([f"{row['jam']:.0f}" for row in undamped]),
        "undampedStops": gallery.in_a_sentence([str(row["sticks"]) for row in undamped]),
        "undampedEpsilons": gallery.in_a_sentence([rf"$1/{round(1 / row['epsilon'])}$" for row in undamped]),
    }


def of_work(rows: Sequence[Row]) -> dict[str, str]:
    """Return the cost of ``ACCURACY`` on one scene at the least and the largest mu, and counts of failed runs."""
    here, accuracy = [row for row in rows if row["scene"] == gallery.SHOWN], gallery.ACCURACY
    mus = sorted({row["mu"] for row in here})
    methods = (*chart.EXPLICIT, *chart.IMPLICIT)
    costs = figures.cheapest_by_method(here, methods, accuracy)
    best, fast = (min((m for m in methods if costs[m].get(mu)), key=lambda m: costs[m][mu]) for mu in (mus[0], mus[-1]))
    (jump,) = (row for row in here if row["method"] == "jump 1" and row["mu"] == mus[0])
    found = {
        "workRuns": str(len(rows)), "workAccuracy": power(accuracy), "workLeastMu": power(mus[0]),
        "bestName": style.curve(best)["label"], "bestRatio": rounded(costs[best][mus[0]]),
        "explicitLeastMu": power(min(mu for m in ("rk45", "dop853") for mu, cost in costs[m].items() if cost)),
        "workLargestMu": power(mus[-1]),
        "fastName": style.curve(fast)["label"], "fastRatio": rounded(costs[fast][mus[-1]]),
        "jumpRatio": rounded(jump["ratio"]), "jumpError": power(jump["final_error"], 1),
    }
    for method, kind in (("sign", "stalled"), ("moreau", "wrong branch")):
        mine = [row for row in rows if row["method"] == method]
        failed = [row for row in mine if figures.outcome(row["status"]) == kind]
        mine = [row for row in mine if row["scene"] in {failure["scene"] for failure in failed}]
        found |= {f"{method}Runs": str(len(mine)), f"{method}Failed": str(len(failed))}
    found["moreauCoarse"] = rounded(min(row["rtol"] / row["mu"] for row in failed))
    stiff = [row for row in rows if row["method"] in chart.IMPLICIT]
    short = [row for row in stiff if row["status"] != "finished"]
    steps = [row for row in here if row["method"] == "moreau"]
    longest = max(row["rtol"] for row in steps)
    return found | {
        "stiffNames": _names(stiff), "stiffRuns": str(len(stiff)), "stiffRight": str(len(stiff) - len(short)),
        "shortNames": _names(short), "shortTolerance": power(max((row["rtol"] for row in short), default=0)),
        "moreauLongest": power(longest),
        "moreauError": bound(max(row["final_error"] for row in steps if row["rtol"] == longest)),
    }


def _names(rows):
    methods = dict.fromkeys(row["method"] for row in rows)
    return gallery.in_a_sentence([style.curve(method)["label"] for method in methods])


def of_plane(rows: Sequence[Row]) -> dict[str, str]:
    """Return the number of integrator runs from beside the unstable plane, of wrong ones, and their methods."""
    rows = [row for row in rows if row["method"] != "exact"]
    wrong = [row for row in rows if figures.outcome(row["status"]) == "wrong branch"]
    failing = {row["method"] for row in wrong}
    (mu,) = {row["mu"] for row in rows}
    away = [abs(row["offset"]) for row in rows]
    return {
        "planeRuns": str(len(rows)), "planeWrong": str(len(wrong)), "planeMu": power(mu),
        "planeWrongNames": _names(wrong), "planeRightNames": _names(r for r in rows if r["method"] not in failing),
        "planeNearest": power(min(away)), "planeFarthest": power(max(away)),
    }


def of_nonlinear(rows: Sequence[Row]) -> dict[str, str]:
    """Return errors of small-angle models of the nonlinear rod at the least mu, for kappa = 1 and the largest kappa."""
    least, large = min(row["mu"] for row in rows if row["kappa"] == 1), max(row["kappa"] for row in rows)
    found = {"nonlinearMu": power(least), "nonlinearLarge": f"{large:g}",
             "nonlinearTolerance": power(figures.ALONGSIDE)}
    for name, method, value in (("Exact", "exact", 1), ("Zero", "jump 0", 1), ("One", "jump 1", 1),
                                ("LargeZero", "jump 0", large), ("LargeOne", "jump 1", large)):
        (row,) = (r for r in rows if (r["kappa"], r["mu"], r["method"]) == (value, least, method))
        found[f"nonlinear{name}"] = power(row["final_error"])
    return found


def rounded(ratio: float) -> str:
    """Return a ratio of times to two significant digits, which is about its accuracy."""
    return f"{float(f'{ratio:.2g}'):g}"
