"""The registry of all that the paper, the site and the commands show: rows, pictures, tables and numbers.

Each ``Artefact`` in ``ARTEFACTS`` names the functions that compute, draw, tabulate and quote its rows. ``pictures``,
``tables`` and ``all_macros`` select the artefacts whose rows are stored, and hand these rows to the functions.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from asympk.output import gallery, macros, rowtables
from asympk.output import tables as derived
from asympk.output.tabular import Table
from asympk.pictures import anymechanism as mechanisms
from asympk.pictures import drawings, figures, maps, style
from asympk.storage.rows import StoredRows, read_rows
from asympk.studies import anymechanism, bench, chart, collisions, convergence, damping, decreasing, divide, leastmap
from asympk.studies.least import LADDER


@dataclass(frozen=True)
class Artefact:
    """The functions that make one item of the paper; each of them may be missing.

    1. ``compute()`` returns the rows, to be stored as ``name``.csv. ``asympk chart`` computes and stores its own rows.
    2. ``draw`` is {name of a picture: function}. A function returns a figure, or None where its rows do not suffice.
    3. ``tabulate`` returns a table, and ``numbers`` returns macros of the paper, {name: LaTeX}.
    4. Where the artefact has rows, all these functions take them as an argument. Those of ``draw`` also take the rows
       of each artefact named in ``beside``, or [] where these are not stored.
    """

    name: str
    compute: Callable[[], StoredRows] | None = None
    draw: Mapping[str, Callable[..., style.Figure | None]] = field(default_factory=dict)
    tabulate: Callable[..., Table] | None = None
    numbers: Callable[..., dict[str, str]] | None = None
    beside: tuple[str, ...] = ()

    @property
    def measured(self) -> bool:
        """Whether ``asympk chart`` computes and stores the rows."""
        return self.name in chart.PARTS


ARTEFACTS = (
    Artefact("catalogue", draw={"mechanisms": gallery.mechanisms_picture}),
    Artefact("system", draw={"system": drawings.draw_system}),
    Artefact("phase", draw={"phase": gallery.phase_picture}),
    Artefact("jump", draw={"jump": gallery.jump_picture}, numbers=macros.example_macros),
    Artefact("regimes", draw={"regimes": maps.regime_map}, tabulate=derived.regimes_table),
    Artefact("stick", draw={"stick": partial(maps.stick_over_static_friction, ("1", "-17/10"))}),
    Artefact("groups", tabulate=derived.groups_table),
    Artefact("modes", tabulate=derived.modes_table),
    Artefact("manifolds", tabulate=derived.manifolds_table),
    Artefact("eigenvalues", tabulate=derived.eigenvalues_table),
    Artefact("claims", tabulate=derived.claims_table, numbers=macros.claim_macros),
    Artefact("formulas", numbers=macros.formula_macros),
    Artefact("jump map", numbers=macros.jump_macros),
    Artefact("divide", numbers=macros.escape_macros),
    Artefact("accuracy", numbers=macros.accuracy_macros),
    Artefact("mechanisms", anymechanism.formula_rows, tabulate=rowtables.mechanisms_table),
    Artefact("jumplaw", anymechanism.error_rows, {"jumplaw": mechanisms.draw_errors}, numbers=macros.of_jump_law),
    Artefact("rebound", anymechanism.rebound_rows, {"rebound": mechanisms.draw_rebound}, numbers=macros.of_rebound),
    Artefact("convergence", convergence.rows, {"convergence": maps.convergence}, rowtables.convergence_table,
             macros.of_convergence),
    Artefact("escape", divide.rows, tabulate=rowtables.escape_table),
    Artefact("collisions", collisions.rows, {"collisions": maps.collisions}, numbers=macros.of_collisions),
    Artefact("least", leastmap.rows, {"least": partial(maps.least_models, names=[*LADDER])},
             numbers=macros.of_least),
    Artefact("decreasing", decreasing.rows, {"decreasing": maps.decreasing}, rowtables.decreasing_table),
    Artefact("peer", bench.peer_rows, numbers=macros.of_peer),
    Artefact("damping", damping.rows, {"damping": gallery.damping_picture}, rowtables.damping_table,
             macros.of_damping),
    Artefact("work", None, {
        **{f"chart-workprec-{s}": partial(gallery.work_precision_picture, scene=s) for s in chart.SCENES},
        "chart-few": gallery.few_costs_picture,
        f"chart-cost-{gallery.SHOWN}": partial(gallery.cost_picture, only=gallery.SHOWN),
        "chart-cost": gallery.cost_picture,
    }, rowtables.method_table, macros.of_work),
    Artefact("plane", None, {"chart-failures": gallery.failures_picture}, numbers=macros.of_plane,
             beside=("work", "contacts")),
    Artefact("nonlinear", None, {"chart-nonlinear": figures.nonlinear,
                                 "chart-nonlinear-work": gallery.nonlinear_work_picture}, numbers=macros.of_nonlinear),
    Artefact("models", None, {"chart-models": figures.model_savings}, numbers=macros.of_models),
    Artefact("contacts", numbers=macros.of_contacts),
)
README = ("phase", "jump", "regimes", "chart-cost-ii")  # the pictures in README.md


def pictures(kept: Path, among: Iterable[Artefact] = ARTEFACTS) -> dict[str, Callable[[], style.Figure | None]]:
    """Return {name of a picture: function without arguments that draws it}.

    A picture of rows is included only if the folder ``kept`` has their file.
    Raises ``MissingPackage`` without matplotlib.
    """
    style.matplotlib()
    return {name: partial(_made, draw, files, [kept / f"{other}.csv" for other in artefact.beside])
            for artefact, files in _there(kept, among) for name, draw in artefact.draw.items()}


def tables(kept: Path, among: Iterable[Artefact] = ARTEFACTS) -> list[Callable[[], Table]]:
    """Return functions without arguments that make the tables; for tables of rows, ``kept`` must have their file."""
    return [partial(_made, artefact.tabulate, files) for artefact, files in _there(kept, among) if artefact.tabulate]


def all_macros(kept: Path) -> dict[str, str]:
    """Return all macros as {name: LaTeX}; for macros of rows, the folder ``kept`` must have their file."""
    made = (_made(artefact.numbers, files) for artefact, files in _there(kept, ARTEFACTS) if artefact.numbers)
    return {name: latex for part in made for name, latex in part.items()}


def _there(kept: Path, among: Iterable[Artefact]) -> Iterator[tuple[Artefact, list[Path]]]:
    """Yield each artefact that has no rows, with [], and each whose file of rows exists, with [file]."""
    for artefact in among:
        file = kept / f"{artefact.name}.csv"
        if not (artefact.compute or artefact.measured):
            yield artefact, []
        elif file.is_file():
            yield artefact, [file]


def _made(make: Callable, files: Iterable[Path], others: Iterable[Path] = ()) -> Any:
    return make(*map(read_rows, files), *(read_rows(file) if file.is_file() else [] for file in others))
