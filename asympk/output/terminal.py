"""The output of the commands as text or JSON: paths, sweeps, ladders, certificates, claims and the summary."""

import json
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from math import prod
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from asympk.ledger.verdicts import VERDICTS, Claim
from asympk.path import Path, predicted_error
from asympk.shown import ball_as_text, condensed, cut, number_as_text

if TYPE_CHECKING:
    from asympk.certify.certificates import Certificate
    from asympk.certify.proofs import Proof
    from asympk.scene import Scene
    from asympk.studies.least import Ladder

SHORT = 8  # digits of a number in a table
EVENTS = "event -> mode"  # the heading of the words beside a path
MOST_ITINERARIES = 12  # of a sweep, told in lines of their own
PROSE = 120  # characters of a line of the summary, also in a file or a pipe
NEXT = (
    "asympk claims C23                    the evidence of one claim",
    "asympk solve backward --plot a.svg   a steep rod without a rigid motion",
    "asympk mechanism painleve_rod        a mechanism, its paradox and its jump",
)


def columns() -> int:
    """Return the number of characters of a line on the terminal; in a file or a pipe any line is whole."""
    return get_terminal_size().columns if sys.stdout is not None and sys.stdout.isatty() else sys.maxsize


def wrapped(head: str, words: str, longest: int = sys.maxsize) -> list[str]:
    """Return ``head`` and ``words`` in lines of ``columns`` characters, or ``longest`` if that is less.

    The words stay to the right of the head. An equation such as ``x = 1`` stays in one line.
    """
    lines = wrap(words.replace(" = ", "\xa0=\xa0"), min(columns(), longest), initial_indent=head,
                 subsequent_indent=" " * len(head), break_long_words=False, break_on_hyphens=False)
    return [line.replace("\xa0", " ") for line in lines] or [head.rstrip()]


def path_as_json(path: Path, digits: int | None) -> str:
    """Return a path as JSON: names of the states, final, events, modes, model; with ``digits`` numbers are strings.

    Where a system has several frictions, an event has the index of its ``friction``.
    """
    several = path.scene.system is not None and len(path.scene.system.frictions) > 1
    events = [{"kind": event.kind, "t": _plain(event.t, digits), "state": [_plain(v, digits) for v in event.state],
               **({"friction": event.friction} if several else {})} for event in path.events]
    entries = {
        "names": list(path.names),
        "final": [_plain(value, digits) for value in path.final],
        "events": events,
        "modes": list(path.modes),
        "model": path.model,
    }
    if path.error is not None:
        entries["error"] = _plain(path.error, digits and 3)
    return json.dumps(entries, indent=2)


def below_scene(scene: "Scene", *parts: str, physical: bool = False) -> str:
    """Return the parts of a result that are not empty, below the numbers of its scene and what the states mean.

    ``physical`` tells that the result is in the units of the scene's file.
    """
    from asympk.scenes.turned import scene_parameters
    from asympk.systems.catalogue import strained_gaps

    read = ((name, number_as_text(value)) for name, value in scene_parameters(scene).items())
    numbers = ", ".join(map(" = ".join, scene.rod.rows if scene.rod is not None else read))
    lines = wrapped("", ": ".join(filter(None, (scene.name, numbers))))
    if scene.rod is not None and not physical:
        words = "t, x, y and z are nondimensional; asympk solve --physical gives them in the units above"
        lines += wrapped("", words)
    for friction in scene.system.frictions if scene.system is not None else ():
        lines += wrapped("", f"sliding velocity {friction.velocity}, load {cut(str(friction.load))}")
    strained = ", ".join(f"g = {gap:.6g} at contact {k}" for k, gap in strained_gaps(scene).items())
    lines += wrapped("", f"starts with a reaction, as {strained}") if strained else []
    return "\n".join(filter(None, (*lines, *parts)))


def path_as_text(path: Path, digits: int | None) -> str:
    """Return a path as a table of modes with the time and state at which each begins, and the final state.

    With ``digits`` the final state follows once more, with that many digits.
    """
    scene = path.scene
    begins = [("start", 0, *scene.start), *((event.kind, event.t, *event.state) for event in path.events)]
    rows = [(map(_shortly, state), f"{kind} -> {mode}")
            for (kind, *state), mode in zip(begins, path.modes, strict=True)]
    prediction = f", predicted error {error}" if (error := predicted_error(path)) else ""
    rows.append((map(_shortly, (scene.until, *path.final)), f"until ({path.model}{prediction})"))
    lines = _table(("t", *path.names), EVENTS, rows)
    if digits is not None:
        lines += [f"{name} = {_plain(value, digits)}" for name, value in zip(path.names, path.final, strict=True)]
    return "\n".join(lines)


def sweep_as_text(found: Mapping[str, Any]) -> str:
    """Return the summary of a sweep in lines: outcomes, the most frequent itineraries, collisions and quantiles."""
    outcomes = ", ".join(f"{n:,} {words}" for words, n in found["outcomes"].items())
    total, itineraries = found["trajectories"], [*found["itineraries"].items()]
    lines = wrapped("", f"{total:,} {'trajectory' if total == 1 else 'trajectories'}: {outcomes}")
    lines += wrapped("", f"refused, first of them {found['refused']}") if found["refused"] else []
    lines += [line for words, n in itineraries[:MOST_ITINERARIES] for line in wrapped(f"{n:>14,}  ", condensed(words))]
    if len(itineraries) > MOST_ITINERARIES:
        lines.append(f"{'':>14}  and {len(itineraries) - MOST_ITINERARIES} itineraries more")
    if found["collisions"]:
        counts = ", ".join(f"{k} each in {n:,}" for k, n in found["collisions"].items())
        lines += wrapped("", f"collisions (zeros of a velocity): {counts}")
    known = {state: row for state, row in found["quantiles"].items() if row}
    if known:  # else no trajectory was followed
        rows = zip(found["probabilities"], *known.values(), strict=True)
        lines += _table(("quantile", *known), "", (([f"{q:.6g}" for q in row], "") for row in rows))
    return "\n".join(lines)


def scenes_as_text(names: Iterable[str]) -> str:
    """Return one line for each name, of a scene that ships or of a system of the catalogue."""
    from asympk.scenes.scenefile import about

    width = max(map(len, names))
    return "\n".join(line for name in names for line in wrapped(f"{name:<{width}}  ", about(name)))


def _table(labels, heading, rows):
    """Return rows (cells, words) as lines below labels and a heading; a row that is too long has lines of its own."""
    table = [([*cells], words) for cells, words in rows]
    widths = [max(map(len, column)) for column in zip(labels, *(cells for cells, _ in table), strict=True)]
    lines = ["  ".join([*map(str.rjust, cells, widths), words]).rstrip()
             for cells, words in ((labels, heading), *table)]
    if max(map(len, lines)) <= columns():
        return lines
    numbered = ((words, ", ".join(map("{} = {}".format, labels, cells))) for cells, words in table)
    return [line for words, numbers in numbered for line in (*filter(None, [words]), *wrapped("    ", numbers))]


def _shortly(number):
    """Return a number with ``SHORT`` digits; an mpf may lie outside the range of doubles."""
    near = float(number)
    if not hasattr(number, "_mpf_") or not number or sys.float_info.min <= abs(near) <= sys.float_info.max:
        return f"{near:z.{SHORT}g}"
    return _plain(number, SHORT)


def _plain(value, digits):
    if digits is None:
        return float(value)
    import mpmath

    return mpmath.nstr(value, digits, strip_zeros=True)


def ladder_as_text(ladder: "Ladder") -> str:
    """Return a ladder of models as a table, lowest rung first, with an arrow at the least model that will do."""
    lines = [f"   {'model':<8}{'predicted':>11}{'measured':>11}{'time/exact':>12}"]
    for rung in ladder.rungs:
        mark = "->" if rung.model == ladder.model else "  "
        numbers = (rung.predicted, rung.measured)
        shown = [f"{number:.1e}" if number is not None else "--" for number in numbers]
        shown.append(f"{rung.cost:.1f}" if rung.cost else "--")
        lines.append(f"{mark} {rung.model:<8}{shown[0]:>11}{shown[1]:>11}{shown[2]:>12}")
        first = next(other.model for other in ladder.rungs if other.reason == rung.reason)
        reason = f"as {first}" if rung.reason and first != rung.model else rung.reason
        lines += wrapped(" " * 6, reason) if reason else []
    return "\n".join([*lines, f"least model, the lowest for an error below {ladder.rtol:g} at until: {ladder.model}"])


def certificates_as_text(found: "Sequence[Certificate]", digits: int) -> str:
    """Return certificates as text: a single one with a row for each event; the pieces of a box counted by outcome.

    A row shows the digits of a ball that are certain, at most ``SHORT``; the final state has ``digits`` of them.
    """
    if len(found) == 1:
        return _certificate_as_text(found[0], digits)
    proven = [piece for piece in found if piece.proven]
    outcomes = Counter(" -> ".join(piece.modes) if piece.proven else f"undecided, {piece.obstacle}" for piece in found)
    share = f"{100 * covered(found):.6g}%"
    share = f"nearly {share}" if share == "100%" and len(proven) < len(found) else share
    lines = [f"{len(proven)} of {len(found)} pieces of the box proven, {share} of its volume"]
    lines += [line for words, count in outcomes.most_common() for line in wrapped(f"{count:>6}  ", words)]
    if proven:
        hull = [reduce(lambda one, other: one.union(other), balls)
                for balls in zip(*(piece.final for piece in proven), strict=True)]
        lines += ["  final, over the proven pieces", *_balls(proven[0].scene.names, hull, digits)]
    return "\n".join(lines)


def covered(found: "Sequence[Certificate]") -> float:
    """Return the fraction of the volume of a box that is proven, from the certificates of its pieces."""
    sizes = [prod(high - low for low, high in piece.box.values() if high > low) for piece in found]
    return float(sum(size for size, piece in zip(sizes, found, strict=True) if piece.proven) / sum(sizes))


def _certificate_as_text(one, digits):
    if not one.proven:
        return "\n".join(wrapped("undecided: ", one.reason))
    lines = wrapped("proven: ", f"{' -> '.join(one.modes)}, with {one.bits} bits")
    rows = [(map(_certain, (t, *state)), f"{kind} -> {mode}")
            for (kind, t, state, _), mode in zip(one.events, one.modes[1:], strict=True)]
    lines += _table(("t", *one.scene.names), EVENTS, rows) if rows else []
    return "\n".join([*lines, "  final", *_balls(one.scene.names, one.final, digits)])


def _certain(ball):
    """Return the certain digits of a ball, at most ``SHORT``; a ball without any, of which "0e+0" is left, whole."""
    text = ball.str(SHORT, radius=False)
    return ball.str(SHORT) if text.startswith("0e") else text


def _balls(names, values, digits):
    return [f"    {name} = {ball_as_text(value, digits)}" for name, value in zip(names, values, strict=True)]


def certificates_as_json(found: "Sequence[Certificate]", digits: int) -> str:
    """Return certificates as a list in JSON; a ball is a string "[middle +/- radius]"."""
    return json.dumps([_certificate_as_dict(one, digits) for one in found], indent=1)


def _certificate_as_dict(one, digits):
    box = {name: [str(low), str(high)] for name, (low, high) in one.box.items()}
    if not one.proven:
        return {"proven": False, "reason": one.reason, "bits": one.bits, "box": box}
    events = [{"kind": kind, "t": ball_as_text(t, digits), "state": [ball_as_text(v, digits) for v in state]}
              for kind, t, state, _ in one.events]
    return {"proven": True, "names": list(one.scene.names), "modes": list(one.modes), "events": events,
            "final": [ball_as_text(v, digits) for v in one.final], "bits": one.bits, "box": box}


def proofs_as_text(found: "Iterable[Proof]") -> str:
    """Return one line for each inequality: its verdict, its statement and its box."""
    lines = []
    for proof in found:
        box = ", ".join(f"{symbol} from {float(low):.7g} to {float(high):.7g}"
                        for symbol, (low, high) in proof.inequality.box.items())
        verdict = "proven" if proof.proven else "undecided"
        lines += wrapped(f"{proof.inequality.claim}  ", f"{verdict}: {proof.inequality.statement} ({box})")
    return "\n".join(lines)


def claims_as_json(found: Sequence[Claim]) -> str:
    """Return claims with all their evidence as JSON."""
    return json.dumps([claim.as_dict() for claim in found], indent=1, ensure_ascii=False) + "\n"


def print_claims(found: Sequence[Claim], as_json: bool, evidence: bool) -> int:
    """Print claims, as JSON, with their ``evidence``, or a line each; return the exit status as ``exit_status``."""
    if as_json:
        print(claims_as_json(found), end="")
    elif evidence:
        print("\n\n".join(_with_evidence(claim) for claim in found))
    else:
        room = columns() - 17
        print("\n".join(f"{claim.id}  {claim.verdict:<10}  {cut(claim.statement, room)}" for claim in found))
    return exit_status(found)


def exit_status(found: Sequence[Claim]) -> int:
    """Return 0, or 1 when a claim is not settled."""
    return 0 if all(claim.verdict in VERDICTS for claim in found) else 1


def _with_evidence(claim):
    lines = [f"{claim.id} (section {claim.where}): {claim.verdict}", *wrapped("  ", claim.statement)]
    lines += wrapped("  -> ", claim.finding) if claim.finding else []
    for check in claim.evidence:
        mark = "holds" if check.holds else "fails"
        lines += wrapped("  - ", f"{check.role}, {check.kind}, {mark}: {check.what}")
        lines += wrapped(" " * 6, check.value) if check.value else []
    return "\n".join(lines)


def summary(found: Sequence[Claim], files: int) -> str:
    """Return the screen of the main job: counts of verdicts, claims refined or corrected, results beyond the paper."""
    counts = Counter(claim.verdict for claim in found)
    checks = [check for claim in found for check in claim.evidence]
    parts = [
        *wrapped("", "Fufaev 1991, the Painlevé-Klein example: rederived from the elastic rod and checked."),
        f"{len(found)} claims, {len(checks)} checks: {', '.join(f'{n} {verdict}' for verdict, n in counts.items())}.",
        "",
    ]
    for verdict in ("corrected", "refined", "not settled"):
        chosen = [claim for claim in found if claim.verdict == verdict]
        if chosen:
            parts.append(f"{verdict.capitalize()}:")
            for claim in chosen:
                parts += wrapped(f"  {claim.id:<5}", claim.statement, PROSE)
                parts += wrapped(" " * 7, f"-> {claim.finding}", PROSE)
            parts.append("")
    parts += ["Beyond the paper, for sigma > 0 and z < 0, with L = log(1/mu):", *_jump_lines(), ""]
    parts += ["Regimes of the plane v = 0 and of the slow plane Pi2:", *_regime_lines(), ""]
    parts += [f"{files} files written under paper/generated. To try next:", *(f"  {command}" for command in NEXT)]
    return "\n".join(parts)


def _jump_lines():
    from asympk.asymptotics.jump import jump_map
    from asympk.systems.painleve_klein import sigma, system

    jump = jump_map(system(), order=1, start={sigma: 1})
    lasts = f"the layer lasts ({jump.t_leave.coefficient(1, 1)}) mu L + O(mu), and mid-way y is of order 1/mu"
    lines = wrapped("  ", lasts)
    for name, expansion in (("x", jump.x), ("z", jump.z)):
        lines.append(f"  {name} -> {expansion.coefficient(0)}{_signed(expansion.coefficient(1, 1))} mu L + O(mu)")
    return lines


def _signed(coefficient):
    import sympy as sp

    coefficient = sp.factor(coefficient)
    negative = coefficient.could_extract_minus_sign()
    return f" - {-coefficient}" if negative else f" + {coefficient}"


def _regime_lines():
    from asympk.output.tables import regimes_table
    from asympk.output.tabular import plain_rows

    rows = [row[:-1] for row in plain_rows(regimes_table())]  # the last column would not fit on a screen
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  " + "  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
    if max(map(len, lines)) <= columns():
        return lines
    (_, *heads), *regimes = rows
    headed = ((regime, "; ".join(map("{} {}".format, heads, cells))) for regime, *cells in regimes)
    return [line for regime, words in headed for line in (f"  {regime}", *wrapped(" " * 6, words))]
