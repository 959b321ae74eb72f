"""The paper: every number in it is a macro, every macro and reference is used and exists, every float has a caption."""

import re
import shutil
import subprocess
from decimal import ROUND_DOWN
from pathlib import Path

import pytest

from asympk.errors import InputError, UnknownName
from asympk.output import artefacts, macros, paper
from asympk.output.article import with_sections
from asympk.storage.rows import read_rows

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "paper"
MAIN = with_sections((PAPER / "main.tex").read_text(encoding="utf-8"), PAPER)
SUPPLEMENT = (PAPER / "supplement.tex").read_text(encoding="utf-8")
PREAMBLE = (PAPER / "preamble.tex").read_text(encoding="utf-8")
BODIES = [source.split(r"\begin{document}")[1] for source in (MAIN, SUPPLEMENT)]
BODY = "".join(BODIES)
GENERATED = (PAPER / "generated" / "numbers.tex").read_text(encoding="utf-8")
DEFINED = dict(re.findall(r"\\newcommand\{\\(\w+)\}\{(.*)\}\n", GENERATED))
FLOATS = re.findall(r"\\begin\{(figure|table)(\*?)\}(.*?)\\end\{\1\2\}", BODY, re.DOTALL)
ALLOWED = (r"\\fuf\{[\d.]+\}", r"\\(?:tab|pic)\b[^\n]*", r"\\begin\{tabular\}.*?\\end\{tabular\}")


def hand_typed_decimals(source):
    """Return the decimals of a text, those apart that are equation numbers or lengths of the layout."""
    for pattern in ALLOWED:
        source = re.sub(pattern, "", source, flags=re.DOTALL)
    return re.findall(r"\d+(?:\.|\{[.,]\})\d+", source)


def test_no_decimal_in_the_text_is_typed_by_hand():
    assert hand_typed_decimals(BODY) == []


def test_a_decimal_typed_by_hand_is_found_and_an_equation_number_is_not():
    assert hand_typed_decimals(r"by \fuf{2.7} it is 0.25 at $\mu=1{.}5$, $(0,1)$") == ["0.25", "1{.}5"]


def test_every_macro_of_the_paper_is_defined_and_every_one_defined_is_used():
    used = set(re.findall(r"\\([A-Za-z]+)", BODY))
    assert sorted(set(DEFINED) - used) == []
    known = set(DEFINED) | set(re.findall(r"\\newcommand\{\\(\w+)\}", PREAMBLE))
    ours = {name for name in used if re.search("[a-z][A-Z]", name)}  # LaTeX's own commands have no such names
    assert sorted(ours - known) == []


def test_every_reference_is_cited_and_every_citation_exists():
    entries = set(re.findall(r"@\w+\{(\w+),", (PAPER / "refs.bib").read_text(encoding="utf-8")))
    cited = {key for keys in re.findall(r"\\cite\w*\{([\w,]+)\}", BODY) for key in keys.split(",")}
    assert entries == cited


@pytest.mark.parametrize("body", BODIES, ids=paper.DOCUMENTS)
def test_every_label_is_referred_to_and_every_reference_has_a_label(body):
    labels = re.findall(r"\\label\{((?:fig|tab):\w+)\}", body)
    assert len(labels) == len(set(labels))
    assert set(labels) == set(re.findall(r"\\autoref\{((?:fig|tab):\w+)\}", body))
    other = set(re.findall(r"\\(?:autoref|eqref)\{((?:sec|eq|prop|cor):\w+)\}", body))
    assert other <= set(re.findall(r"\\label\{(.+?)\}", body))


def test_every_float_has_a_caption_and_a_label_and_its_file():
    assert FLOATS
    for kind, _, body in FLOATS:
        assert r"\caption{" in body
        assert rf"\label{{{kind[:3]}:" in body
        for name in re.findall(r"\\tab(?:\[.*?\])?\{([\w-]+)\}", body):
            assert (PAPER / "generated" / "tables" / f"{name}.tex").is_file()
            assert (PAPER / "generated" / "tables" / f"{name}.csv").is_file()


def test_figures_in_the_paper_are_pictures_of_the_registry():
    shown = [name for _, _, body in FLOATS for name in re.findall(r"\\pic\{([\w-]+)\}", body)]
    assert shown
    assert set(shown) <= set(artefacts.pictures(PAPER / "generated" / "rows"))


def test_the_readme_shows_committed_pictures_each_with_the_command_that_makes_it():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.findall(r"!\[.+?\]\((.+?)/([\w-]+)\.svg\)\n\n`asympk paper --only ([\w-]+)`", readme)
    assert [name for _, name, _ in found] == [name for _, _, name in found]
    assert sorted(name for _, name, _ in found) == sorted(artefacts.README)
    for folder, name, _ in found:
        assert (ROOT / folder / f"{name}.svg").is_file()


def test_the_regimes_of_the_readme_are_those_of_the_package():
    from asympk.output.tables import regimes_table
    from asympk.output.tabular import plain_rows

    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for row in plain_rows(regimes_table()):
        assert f"| {' | '.join(row)} |".replace("--", "–") in readme


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="TeX is not installed")
def test_the_tables_need_the_packages_that_the_how_to_page_names(tmp_path):
    named = re.search(r"\(packages (.*?)\)", (ROOT / "docs" / "howto.md").read_text(encoding="utf-8"))[1]
    packages = ",".join(re.split(", | and ", named))
    tables = sorted((PAPER / "generated" / "tables").glob("*.tex"))
    floats = "".join(rf"\begin{{table}}\input{{{file}}}\end{{table}}" for file in tables)
    page = rf"\documentclass{{article}}\usepackage{{{packages}}}\begin{{document}}{floats}\end{{document}}"
    (tmp_path / "page.tex").write_text(page)
    run = subprocess.run(["pdflatex", "-interaction=nonstopmode", "page"], capture_output=True, cwd=tmp_path)
    assert re.findall(rb"^! .*", run.stdout, re.MULTILINE) == []


def test_the_readme_names_the_integrators_that_fail_beside_the_unstable_plane_as_the_rows_do():
    readme = re.sub(r"\s+", " ", (ROOT / "README.md").read_text(encoding="utf-8"))
    found = macros.of_plane(read_rows(PAPER / "generated" / "rows" / "plane.csv"))
    assert f"{found['planeWrongNames']} end wrong; {found['planeRightNames']} do not" in readme


def test_one_picture_is_drawn_by_its_name_and_an_unknown_one_is_refused(tmp_path):
    written = paper.draw_pictures(tmp_path, ["system"], tmp_path, ("pdf", "svg"))
    assert [path.name for path in written] == ["system.pdf", "system.svg"]
    with pytest.raises(UnknownName, match="picture 'chart' is unknown; choose one of mechanisms, system"):
        paper.draw_pictures(tmp_path, ["chart"], tmp_path)


def test_numbers_are_set_as_powers_of_ten_and_decimals():
    assert macros.power(1.5331e-7) == r"\ensuremath{1.5\times 10^{-7}}"
    assert macros.power(1e-8) == r"\ensuremath{10^{-8}}"
    assert macros.power(9.99e-4, 2) == r"\ensuremath{10^{-3}}"
    assert macros.power(0) == "0"
    assert macros.decimal(0.999986, 4) == r"\ensuremath{1.0000}"


def _printed(name):
    front, exponent = re.fullmatch(r"\\ensuremath\{(?:(\d)\\times )?10\^\{(-?\d+)\}\}", DEFINED[name]).groups()
    return float(f"{front or 1}e{exponent}")


def test_of_all_rows_holds_what_the_paper_says_is_at_most_or_up_to_a_number():
    """The largest quotients at 1e-12 are 1.1e-10, 3.5e-10, 2.4e-10, and were said to be at most 1, 3 and 2 of 1e-10."""
    rows = {name: read_rows(PAPER / "generated" / "rows" / f"{name}.csv") for name in ("convergence", "rebound")}
    for row in rows["convergence"]:
        if row["mu"] == _printed("convergenceLeastMu"):
            assert abs(row["excess"]) <= _printed("ratioOrder" + ("Zero", "One", "Two")[row["order"]])
    for row in rows["rebound"]:
        assert row["followed"] is None or abs(row["followed"] / row["law"] - 1) <= _printed("reboundWorst")
    assert macros.bound(2.35e-3) == r"\ensuremath{3\times 10^{-3}}"
    assert macros.bound(1.66e-3, ROUND_DOWN) == r"\ensuremath{10^{-3}}"


def test_a_name_with_a_digit_cannot_be_a_macro():
    with pytest.raises(InputError, match="'rate2' cannot name a macro"):
        macros.macro_definitions({"rate2": "1"})


def test_the_first_complaint_of_tex_is_told_with_its_line():
    log = "pdfTeX\n! Undefined control sequence.\n<recently read> \\hitTim\nl.12 at $\\hitTim\n  $\n! Emergency stop."
    assert paper.first_complaint(log) == r"Undefined control sequence. at l.12 at $\hitTim"
    assert paper.first_complaint("Latexmk: nothing\nlast words\n") == "last words"


def test_without_latexmk_one_line_says_what_to_install(monkeypatch, tmp_path):
    for name in ("write_paper_rows", "write_figures", "write_tables"):
        monkeypatch.setattr(paper, name, lambda *_: [])
    monkeypatch.setattr(artefacts, "all_macros", lambda _: {"one": "1"})
    monkeypatch.setattr(paper.shutil, "which", lambda _: None)
    (tmp_path / "derivations").mkdir()
    *_, last = paper.build(tmp_path)
    assert last == f"no PDF, for latexmk is not installed: apt-get install --no-install-recommends {paper.PACKAGES}"


ASKING = "LaTeX Warning: Label(s) may have changed. Rerun to get cross-references right.\n"


@pytest.mark.parametrize(("log", "asks"), [
    (ASKING, True),
    ("Package natbib Warning: Citation(s) may have changed.\n(natbib)      Rerun to get citations correct.\n", True),
    ("Package: rerunfilecheck 2022-07-10 v1.10 Rerun checks for auxiliary files (HO)\n", False),
])
def test_a_log_asks_to_run_again_where_latex_or_a_package_does(log, asks):
    assert paper.asks_to_run_again(log) is asks


def _latexmk(folder, logs, commands):
    """Return a stand-in for ``subprocess.run`` that writes one log after the other, as latexmk does."""
    (folder / "build").mkdir()

    def run(command, **_):
        commands.append(command)
        (folder / "build" / "main.log").write_text(logs[min(len(commands), len(logs)) - 1])
        return subprocess.CompletedProcess(command, 0, "", "")

    return run


def test_the_paper_is_typeset_until_its_labels_settle(monkeypatch, tmp_path):
    commands = []
    monkeypatch.setattr(paper.subprocess, "run", _latexmk(tmp_path, [ASKING, ASKING, "done\n"], commands))
    assert paper.typeset_pdf(tmp_path) == tmp_path / "build" / "main.pdf"
    assert ["-g" in command for command in commands] == [False, True, True]


def test_labels_that_never_settle_are_an_error_and_no_endless_loop(monkeypatch, tmp_path):
    monkeypatch.setattr(paper.subprocess, "run", _latexmk(tmp_path, [ASKING], []))
    with pytest.raises(InputError, match="labels still change after 6 runs"):
        paper.typeset_pdf(tmp_path)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A checkout with the text and the rows of the paper alone, in which it is built."""
    root = tmp_path_factory.mktemp("checkout")
    (root / "derivations").mkdir()
    for file in (*PAPER.glob("*.tex"), *PAPER.glob("*.bib"), *(PAPER / "generated" / "rows").iterdir()):
        copy = root / file.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, copy)
    paper.build(root)
    return root / "paper"


@pytest.mark.slow
def test_what_the_paper_is_made_of_is_as_it_is_committed(built):
    made = [file.relative_to(built) for part in ("rows", "tables") for file in (built / "generated" / part).iterdir()]
    assert len(made) > 20
    for name in (*made, Path("generated/numbers.tex")):
        assert (built / name).read_bytes() == (PAPER / name).read_bytes(), name


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("latexmk"), reason="latexmk is not installed")
@pytest.mark.parametrize("name", paper.DOCUMENTS)
def test_the_paper_compiles_to_the_same_bytes_twice_without_a_complaint(built, name):
    first, log = (built / "build" / f"{name}.pdf").read_bytes(), built / "build" / f"{name}.log"
    subprocess.run(["latexmk", "-C", "-outdir=build", f"{name}.tex"], cwd=built, capture_output=True, check=True)
    assert paper.typeset_pdf(built, name).read_bytes() == first
    assert first.startswith(b"%PDF")
    complaints = r"^(?:LaTeX|Package) .*Warning.*|^Overfull.*"
    assert re.findall(complaints, log.read_text(errors="replace"), re.MULTILINE) == []
