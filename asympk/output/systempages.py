"""The catalogue of systems as pages of the site: all formulas, numbers and pictures are computed from the objects."""

import contextlib
import io
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from asympk.mechanics.described import Described
from asympk.mechanics.jump_law import jump_law
from asympk.mechanics.paradox import condition, critical_friction
from asympk.output.mechanisms import contact_lines, jump_lines, motion_lines
from asympk.pictures.figures import save
from asympk.pictures.rigid import motion_plot
from asympk.pictures.sketches import SKETCHES, sketch
from asympk.shown import latex_of
from asympk.storage.files import write_text
from asympk.symbolic.tidy import contracted
from asympk.systems import MECHANISMS
from asympk.systems.catalogue import about_system, described_mechanism

LONGEST = 900  # characters of LaTeX; in place of a longer formula a page says by which expression one gets it
SHOWN = {"painleve_klein": 1}  # index of the scene on a system's page, where this is not the first scene
SCRIPT = """import asympk as ap

scene = ap.systems.{name}.scenes()[{which}]
path = ap.solve(scene)
print(f"{{path.model}}, from {{path.modes[0]}}")
for event, mode in zip(path.events, path.modes[1:]):
    print(f"{{event.kind}} at t = {{float(event.t):.4g}}, then {{mode}}")
print("ends at")
for name, value in zip(path.names, path.final):
    print(f"    {{name}} = {{float(value):.5g}}")
path.plot("{name}-motion.svg")
ap.phase(path, file="{name}-phase.svg")
"""


def write_page(name: str, out: Path) -> None:
    """Write the page and the pictures of one system of the catalogue."""
    save(sketch(name), out / f"{name}-sketch.svg")
    first, _, rest = (import_module(f"asympk.systems.{name}").__doc__ or "").partition("\n")
    parts = [*_heading(SKETCHES[name].title, "="), first, "", *_figure(f"{name}-sketch.svg", first), *as_rst(rest), ""]
    if name in MECHANISMS:
        described = described_mechanism(name)
        save(motion_plot(described), out / f"{name}-map.svg")
        parts += [*_contact(described), *_paradox(described), *_jump(described)]
    parts += [*system_equations(name), *_motion(name, out)]
    write_text(out / f"{name}.rst", "\n".join(parts))


def write_index(out: Path) -> None:
    """Write ``out``/index.rst, which shows the sketch of every system of the catalogue."""
    parts = [*_heading("Systems", "="), "The catalogue, ``ap.systems``. ``asympk mechanism NAME`` describes a member "
             "at the prompt.", "", ".. container:: tiles", ""]
    for name in SKETCHES:
        about = about_system(name)
        tile = [f".. image:: {name}-sketch.svg", f"   :target: {name}.html", f"   :alt: {SKETCHES[name].title}", "",
                f":doc:`{name}`. {about}", ""]
        parts += ["   .. container::", "", *(f"      {line}" for line in tile)]
    parts += [".. toctree::", "   :hidden:", "", *(f"   {name}" for name in SKETCHES), ""]
    write_text(out / "index.rst", "\n".join(parts))


def _heading(words: str, line: str) -> list[str]:
    return [words, line * len(words), ""]


def _figure(file: str, caption: str) -> list[str]:
    return [f".. figure:: {file}", f"   :alt: {caption}", "", ""]


def _block(language: str, lines: list[str]) -> list[str]:
    return [f".. code-block:: {language}", "", *(f"   {line}" for line in lines), ""]


def as_rst(text: str) -> Iterator[str]:
    """Yield the lines of a docstring as reStructuredText; indented paragraphs, the equations, become literal blocks."""
    for paragraph in text.strip().split("\n\n"):
        yield from (["::", "", paragraph, ""] if paragraph.startswith("    ") else [escaped(paragraph), ""])


def escaped(words: str) -> str:
    """Return ``words`` with a backslash before each character that reStructuredText would read as markup."""
    return words.replace("\\", "\\\\").replace("*", "\\*").replace("|", "\\|").replace("_ ", "\\_ ")


def displayed_formula(label: str, value: Any, instead: str) -> list[str]:
    """Return a displayed formula; for one longer than ``LONGEST``, the expression ``instead`` that evaluates to it."""
    latex = latex_of(value)
    if len(latex) > LONGEST:
        return [f"{label}: too long for a page; it is ``{instead}``.", ""]
    return [f"{label}:", "", ".. math::", "", f"   {latex}", ""]


def _contact(described: Described) -> list[str]:
    rod, plain = described.mechanism, described.mechanism.plain
    words = f"The contact {rod.contact.side}. In the plain symbols, where a prime marks a rate:"
    return [*_heading("The mechanism", "-"), words, "",
            *displayed_formula("Mass matrix", plain.mass.applyfunc(contracted), "mechanism().mass"),
            *displayed_formula("Forces", plain.forces.T.applyfunc(contracted), "mechanism().forces"),
            *displayed_formula("Gap", plain.gap, "mechanism().contact.gap"),
            *displayed_formula("Sliding velocity", plain.slip, "mechanism().sliding_velocity")]


def _paradox(described: Described) -> list[str]:
    plain = described.mechanism.plain
    critical = contracted(critical_friction(plain))
    parts = [*_heading("Where the paradox is", "-"),
             *displayed_formula("Delassus matrix", plain.delassus, "mechanism().delassus"),
             *displayed_formula("Critical friction", critical, "mechanism().critical_friction"),
             *displayed_formula("There is a paradox where", condition(plain), "mechanism().paradox")]
    numbers = ", ".join(f"{name} = {_short(value)}" for name, value in described.numbers.items())
    figure = _figure(f"{described.name}-map.svg", f"{SKETCHES[described.name].title}: the number of rigid motions")
    return [*parts, f"At the numbers of the example, {escaped(numbers)}:", "",
            *_block("text", contact_lines(described) + motion_lines(described)), *figure]


def _jump(described: Described) -> list[str]:
    law = jump_law(described.mechanism.plain)
    parts = [*_heading("The jump through the paradox", "-"),
             *displayed_formula("Normal impulse", law.impulses[0], "mechanism().jump_law().impulses[0]"),
             *displayed_formula("Tangential impulse", law.impulses[1], "mechanism().jump_law().impulses[1]"),
             "At the numbers of the example:", ""]
    return [*parts, *_block("text", jump_lines(described))]


def system_equations(name: str) -> list[str]:
    """Return the lines of a page with the equations of a system; the rate of a fast state y is ``mu y' = g``."""
    system = import_module(f"asympk.systems.{name}").system()
    rows, long = [], []
    for state in system.states:
        small = f"{latex_of(system.small)}\\," if state in system.fast else ""
        right = latex_of({**system.slow, **system.fast}[state])
        if len(right) > LONGEST:
            long.append(f"``{state}``")
            right = r"\ldots"
        rows.append(rf"{small}\frac{{d}}{{dt}} {latex_of(state)} &= {right}")
    note = f"The rates of {', '.join(long)} are too long for a page; they are in ``system().rates``." if long else ""
    body = r" \\[4pt] ".join(rows)
    return [*_heading("The system", "-"), "With the friction force of the modes in it:", "", ".. math::", "",
            rf"   \begin{{aligned}} {body} \end{{aligned}}", "", note, ""]


def _motion(name: str, out: Path) -> list[str]:
    script = SCRIPT.format(name=name, which=SHOWN.get(name, 0))
    return [*_heading("A motion", "-"), *_block("python", script.splitlines()),
            *_block("text", _printed(script, out).splitlines()), *_figure(f"{name}-motion.svg", "The states over time"),
            *_figure(f"{name}-phase.svg", "The phase picture of the motion")]


def _printed(script: str, folder: Path) -> str:
    screen = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(screen):
        exec(compile(script, "<page>", "exec"), {})
    return screen.getvalue()


def _short(value: Any) -> str:
    return f"{float(value):.4g}" if isinstance(value, float) else str(value)
