"""The pictures that select rows or compute paths before ``asympk.pictures`` draws them.

Each function takes rows, or no argument, and returns a ``Figure``, or None where the rows do not suffice.
"""

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import Any

from asympk.methods import solve
from asympk.pictures import anymechanism, figures, portraits
from asympk.pictures import damping as jam
from asympk.pictures.style import Figure
from asympk.scene import Scene
from asympk.storage.rows import Row, StoredRows
from asympk.studies.chart import COMPILED
from asympk.studies.damping import TINY
from asympk.systems.catalogue import described_mechanism

PHASE_MU, JUMP_MUS, JUMP_START, JUMP_UNTIL = "1/50", ("1/10", "1/100", "1/1000"), (0, "1/5", -1), 3
STEEP, SHALLOW = 1, Fraction(-1, 2)
RINGING, RINGS = 0.5, 66  # of the undamped rod that is drawn: epsilon, and the horizon in physical time
STEEP_STARTS = (((0, -2, -1), 5), ((0, -3, "9/10"), 5), ((0, "-3/5", "2/5"), 4))
SHALLOW_STARTS = (((0, -4, -1), 5), ((0, -3, "9/10"), 4))
DRAWN = ("painleve_klein", "painleve_rod", "crank_slider", "arm")  # the mechanisms of ``mechanisms_picture``
SHOWN = "ii"  # the scene whose costs have a figure of their own, for the README
FEW = ("exact", "kvaerno5", "lsoda", "rk45")  # the methods that the paper compares in its text
FAILING = "iii"  # the scene on which the most runs fail
ACCURACY = 1e-5  # the error of the final state for which costs are compared
IN_WORDS = {  # the methods that compile the right-hand side, in the words of the caption
    "heyoka": "heyoka (Taylor, tol = rtol)",
    "kvaerno5": "Kvaerno5 (diffrax, default root finder and controller, 64 bit)",
}


def mechanisms_picture() -> Figure:
    """Draw four mechanisms of the catalogue over their maps of rigid motions."""
    return anymechanism.draw_mechanisms({name: described_mechanism(name) for name in DRAWN})


def phase_picture() -> Figure:
    """Draw the phase space of the steep and the shallow rod with trajectories of the exact flow."""
    groups = []
    for sigma, words, starts in ((STEEP, "steep", STEEP_STARTS), (SHALLOW, "shallow", SHALLOW_STARTS)):
        paths = [solve(Scene(sigma, PHASE_MU, start, until)) for start, until in starts]
        groups.append((sigma, rf"{words} rod, $\sigma = {sigma}$", paths))
    return portraits.phase_space(groups)


def jump_picture() -> Figure:
    """Draw the jump from z < 0 for decreasing mu, beside the jump of the paper, which keeps x constant."""
    paths = [solve(Scene(STEEP, mu, JUMP_START, JUMP_UNTIL)) for mu in JUMP_MUS]
    return portraits.jump_beside_the_vertical_one(paths, portraits.with_x_held(STEEP, JUMP_START, JUMP_UNTIL))


def damping_picture(rows: Sequence[Row]) -> Figure:
    """Draw the time of the jam over the damping ratio, and the phase plane of the rod without damping."""
    d = TINY * RINGING
    return jam.draw_damping(rows, solve(Scene(STEEP, (RINGING / d) ** 2, (0, 0, -1 / d), RINGS / d)))


def work_precision_picture(rows: Sequence[Row], scene: str) -> Figure | None:
    """Draw work against precision on one scene, at four values of mu."""
    if scene not in {row["scene"] for row in rows}:
        return None
    mus = sorted({row["mu"] for row in rows}, reverse=True)
    return figures.work_precision(rows, scene, mus if len(mus) < 5 else [mus[k] for k in (0, 2, 4, -1)])


def cost_picture(rows: StoredRows, only: str | None = None) -> Figure | None:
    """Draw the cost of ``ACCURACY`` over mu on all scenes, or on ``only`` one, with the methods' options in a note."""
    scenes = [scene for scene in dict.fromkeys(row["scene"] for row in rows) if only in (None, scene)]
    note = options_note({row["method"] for row in rows}, rows.provenance["plan"])
    return figures.cost_against_mu(rows, scenes, ACCURACY, note) if scenes else None


def options_note(methods: Collection[str], plan: Mapping[str, Any]) -> str:
    """Return the options of the integrators in words; heyoka, CVODE and Kvaerno5 are named only if in ``methods``."""
    analytic = ["Radau", "BDF", "LSODA (scipy)", *(["CVODE (SUNDIALS, BDF)"] if "cvode" in methods else [])]
    compiled = [words for method, words in IN_WORDS.items() if method in methods]
    verb = "are" if compiled[1:] else "is"
    once = f"{in_a_sentence(compiled)} {verb} compiled, and compiling is not counted; the others" if compiled else "all"
    more = f" (heyoka {COMPILED} times as many)" if "heyoka" in methods else ""
    steps = plan["step_sizes"]
    return (
        "All integrators: one smooth piece at a time, directed events, snapped states, atol = rtol. "
        f"{in_a_sentence(analytic)} have the analytic Jacobian; {once} call Python, as the exact flow does. "
        f"At most {plan['steps']} steps{more} and {plan['seconds']:g} s. sign: LSODA. tanh: Radau, ε = rtol. "
        f"Moreau-Jean: implicit Euler, fixed steps of {max(steps):g} to {min(steps):g}, the present mode where a step "
        "has several solutions."
    )


def in_a_sentence(names: Sequence[str]) -> str:
    """Return names as an enumeration, "a, b and c", or "none"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "none"


def few_costs_picture(rows: Sequence[Row]) -> Figure | None:
    """Draw the cost of ``ACCURACY`` over mu for the methods that the paper compares in its text."""
    here = [row for row in rows if row["scene"] == SHOWN]
    return figures.few_costs(here, FEW, ACCURACY) if {row["method"] for row in here} >= {*FEW} else None


def failures_picture(plane: Sequence[Row], work: Sequence[Row], contacts: Sequence[Row]) -> Figure | None:
    """Draw the failed runs in three parts: scene ``FAILING`` over mu, starts beside Pi_2, two contacts over mu."""
    failing = [row for row in work if row["scene"] == FAILING]
    parts = [(r"scene (iii), $\mu$", failing, "mu"), (r"deviation from $\Pi_2$", plane, "offset"),
             ("two\ncontacts, $\\mu$", contacts, "mu")]
    found = [(words, [row for row in rows if row["method"] != "exact"], over) for words, rows, over in parts]
    shown = [part for part in found if part[1]]
    return figures.failures(shown) if shown else None


def nonlinear_work_picture(rows: Sequence[Row]) -> Figure:
    """Draw work against precision for the geometrically nonlinear rod, at a moderate mu and at the least mu."""
    kept = [row for row in rows if row["kappa"] == 1]
    mus = sorted({row["mu"] for row in kept})
    return figures.work_precision(kept, SHOWN, [mus[-1 - len(mus) // 3], mus[0]])
