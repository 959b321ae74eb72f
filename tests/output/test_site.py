"""The site: whole, the same each time, without network and scripts, every link leading somewhere."""

import os
import re
import shutil
import signal
import subprocess
import sys
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from time import monotonic, sleep
from urllib.parse import unquote, urlsplit

import pytest
from browser import PRESENT, browser

from asympk.errors import InputError, MissingPackage
from asympk.output import article, site
from asympk.output.site import LIST, publish
from asympk.output.systempages import SCRIPT, system_equations, write_page
from asympk.pictures.sketches import SKETCHES
from asympk.systems import __all__ as SYSTEMS

ROOT = Path(__file__).parents[2]


class Page(HTMLParser):
    """What a page loads, where its links lead, what they can find on it, and how its pictures are described."""

    def __init__(self, file):
        super().__init__()
        self.loads, self.links, self.ids, self.alts = [], [], set(), []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids |= {given[name] for name in ("id", "name") if given.get(name)}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag in ("script", "link", "img", "iframe", "object", "source"):
            self.loads += [given[name] for name in ("src", "href", "data") if name in given]
        if tag == "img":
            self.alts.append(given.get("alt"))


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    pytest.importorskip("sphinx", reason="the extra site is not installed")
    pytest.importorskip("pypandoc", reason="the extra site is not installed")
    folder = tmp_path_factory.mktemp("site")
    site.write_sources(ROOT, folder / "source", lambda message: None)
    site.set_pages(folder / "source", folder / "out", folder / "doctrees")
    return folder / "out"


@pytest.fixture(scope="module")
def pages(built):
    return {file: Page(file) for file in built.rglob("*.html")}


def _pages(folder, **texts):
    shutil.rmtree(folder, ignore_errors=True)
    for name, text in texts.items():
        file = folder / "systems" / f"{name}.html"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return folder


def test_a_later_report_removes_what_an_earlier_one_wrote_and_nothing_else(tmp_path):
    out, pages = tmp_path / "out", tmp_path / "pages"
    publish(_pages(pages, old="old", edited="edited", gone="gone", kept="kept"), out)
    (out / "systems" / "gone.html").unlink()
    (out / "systems" / "own.html").write_text("a file of someone else")
    (out / "systems" / "edited.html").write_text("edited since")
    publish(_pages(pages, kept="kept anew"), out)
    assert {file.stem: file.read_text() for file in out.rglob("*.html")} == \
        {"own": "a file of someone else", "edited": "edited since", "kept": "kept anew"}


@pytest.mark.parametrize("text", ["", "[]", '{"../other": ""}', '{"/etc/passwd": ""}'])
def test_a_list_of_files_that_is_none_removes_nothing(tmp_path, text):
    out = tmp_path / "out"
    publish(_pages(tmp_path / "pages", a="a"), out)
    (tmp_path / "other").write_text("")
    (out / LIST).write_text(text)
    with pytest.raises(InputError, match="is no list"):
        publish(_pages(tmp_path / "pages", b="b"), out)
    assert (tmp_path / "other").exists()
    assert (out / "systems" / "a.html").exists()


def test_a_site_is_not_written_over_a_file(tmp_path):
    pytest.importorskip("pypandoc", reason="the extra site is not installed")
    (tmp_path / "out").write_text("")
    with pytest.raises(InputError, match="is a file"):
        site.build_site(ROOT, tmp_path / "out")


def test_folders_that_a_later_report_leaves_empty_are_removed(tmp_path):
    publish(_pages(tmp_path / "pages", a="a"), tmp_path / "out")
    (tmp_path / "none").mkdir()
    publish(tmp_path / "none", tmp_path / "out")
    assert [file.name for file in (tmp_path / "out").iterdir()] == [LIST]


def _workers(pid):
    found = (Path("/proc", child) for file in Path(f"/proc/{pid}/task").glob("*/children")
             for child in file.read_text().split())
    return [folder for folder in found if b"spawn_main" in (folder / "cmdline").read_bytes()]


def _within(seconds, holds):
    end = monotonic() + seconds
    while not (found := holds()) and monotonic() < end:
        sleep(0.1)
    return found


@pytest.mark.further
@pytest.mark.skipif(not any(Path("/proc/self/task").glob("*/children")), reason="the system does not list processes")
def test_the_processes_that_draw_the_pages_and_the_temporary_folder_end_with_a_report_that_is_ended(tmp_path):
    pytest.importorskip("sphinx", reason="the extra site is not installed")
    pytest.importorskip("pypandoc", reason="the extra site is not installed")
    command = [sys.executable, "-m", "asympk", "report", "--root", ROOT, "--out", tmp_path / "site"]
    (temporary := tmp_path / "temporary").mkdir()
    report = subprocess.Popen([*map(str, command)], stderr=subprocess.DEVNULL,
                              env={**os.environ, "TMPDIR": str(temporary)})
    workers = _within(120, lambda: _workers(report.pid))
    assert [*temporary.iterdir()]
    report.terminate()
    assert report.wait() == 128 + signal.SIGTERM
    assert [*temporary.iterdir()] == []
    assert workers
    assert _within(20, lambda: not any(folder.exists() for folder in workers))


@pytest.mark.further
def test_every_kind_of_page_is_there(built):
    wanted = ["index", "howto", "own", "models", "limits", "api", "glossary", "lemmas", "architecture", "article/index"]
    wanted += [f"systems/{name}" for name in SYSTEMS]
    wanted += [f"derivations/{script.stem}" for script in (ROOT / "derivations").glob("*.py")]
    assert [name for name in wanted if not (built / f"{name}.html").is_file()] == []


@pytest.mark.slow
def test_nothing_is_loaded_from_elsewhere(built, pages):
    for file, page in pages.items():
        for load in page.loads:
            assert not urlsplit(load).scheme or load.startswith("data:"), f"{file.name} loads {load}"
            assert (file.parent / unquote(urlsplit(load).path)).exists(), f"{file.name} loads {load}"
    for sheet in built.rglob("*.css"):
        assert not re.search(r"@import|url\([\"']?(?:https?:)?//", sheet.read_text(encoding="utf-8")), sheet


@pytest.mark.slow
def test_every_link_leads_somewhere(pages):
    for file, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme in ("http", "https"):
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.is_file(), f"{file.name}: {link}"
            if parts.fragment and target.suffix == ".html":
                assert unquote(parts.fragment) in pages[target].ids, f"{file.name}: {link}"


@pytest.mark.slow
def test_every_formula_is_mathml_and_none_is_left_as_latex(built):
    for file in built.rglob("*.html"):
        text = file.read_text(encoding="utf-8")
        for part in ("<pre>.*?</pre>", "<code.*?</code>", "<script.*?</script>", "<math.*?</math>", "<[^>]+>"):
            text = re.sub(part, " ", text, flags=re.DOTALL)
        assert re.findall(r"\\(?:frac|left|sigma|mu|begin)\b|\$[^$]{1,40}\$|:math:", text) == [], file.name
    assert (built / "article" / "index.html").read_text("utf-8").count("<math") > 500


@pytest.mark.slow
@pytest.mark.skipif(not PRESENT, reason="no Chromium with its driver")
def test_the_number_of_a_formula_does_not_lie_over_it_on_a_phone(built):
    gap = "n.getBoundingClientRect().left - n.parentElement.querySelector('math').getBoundingClientRect().right"
    with browser() as window:
        window.open((built / "article" / "index.html").as_uri(), width=390)
        gaps = window.run(f"return [...document.querySelectorAll('.eqno')].map(n => {gap})")
    assert min(gaps) > -1  # in pixels, of which parts are rounded


@pytest.mark.slow
def test_examples_and_equations_of_docstrings_stand_in_the_reference_as_they_are_written(built):
    words = re.sub(r"<[^>]+>", "", (built / "api.html").read_text(encoding="utf-8"))
    assert "-x + y*(1 - x**2)" in words
    assert re.findall(r"\\[*|]", words) == []


@pytest.mark.slow
def test_a_rate_keeps_its_prime_and_can_be_copied(built):
    text = (built / "systems" / "painleve_rod.html").read_text(encoding="utf-8")
    assert re.search(r"X(?:'|&#39;|&#x27;) = -1\.178", text)
    assert "\u2019" not in text


@pytest.mark.slow
def test_every_picture_says_in_words_what_it_shows(pages):
    for file, page in pages.items():
        assert all(page.alts), file.name
        assert not [alt for alt in page.alts if alt.endswith((".svg", ".png"))], file.name
        if file.parent.name == "article":
            assert min(map(len, page.alts)) > 30


@pytest.mark.slow
def test_every_float_of_the_paper_is_in_the_article(built):
    source = article.with_sections((ROOT / "paper" / "main.tex").read_text(encoding="utf-8"), ROOT / "paper")
    html = (built / "article" / "index.html").read_text(encoding="utf-8")
    assert html.count("<figure") == len(re.findall(r"\\begin\{figure", source))
    assert len(re.findall(r"<table[^>]* id=\"tab-", html)) == len(re.findall(r"\\begin\{table", source))


def contents(folder):
    return {file.relative_to(folder): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.further
def test_the_same_sources_in_another_place_and_at_another_time_are_set_to_the_same_bytes(built, tmp_path):
    shutil.copytree(built.parent / "source", tmp_path / "elsewhere", ignore=shutil.ignore_patterns("derivations"))
    site.set_pages(tmp_path / "elsewhere", tmp_path / "out", tmp_path / "doctrees")
    first, second = contents(built), contents(tmp_path / "out")
    assert first.keys() == second.keys()
    assert [name for name in first if first[name] != second[name]] == []


@pytest.mark.further
def test_the_page_and_the_pictures_of_a_system_are_the_same_each_time(built, tmp_path):
    write_page("held_rod", tmp_path)
    first, second = contents(tmp_path), contents(built.parent / "source" / "systems")
    assert len(first) == 5
    assert [name for name in first if first[name] != second[name]] == []


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_page_of_a_system_begins_with_its_mechanics_and_not_with_its_code(name):
    about = import_module(f"asympk.systems.{name}").__doc__
    assert not re.search(r"\b(module|package|kernel)s?\b|->", about), about


def test_code_on_the_site_is_as_legible_as_its_text():
    chosen = re.search(r'^pygments_style = "(.+?)"', (ROOT / "docs" / "conf.py").read_text(encoding="utf-8"), re.M)[1]
    style = pytest.importorskip("pygments.styles", reason="the extra site is not installed").get_style_by_name(chosen)
    ground = _luminance(style.background_color.removeprefix("#"))
    inks = {_luminance(drawn["color"]) for _, drawn in style if drawn["color"]}
    assert all((max(ink, ground) + 0.05) / (min(ink, ground) + 0.05) >= 4.5 for ink in inks)  # WCAG 2, level AA


def _luminance(colour):
    """Return the relative luminance of WCAG 2 of a colour in hexadecimal digits."""
    parts = (int(colour[k : k + 2], 16) / 255 for k in (0, 2, 4))
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_every_system_of_the_catalogue_has_a_sketch_and_a_title():
    assert set(SKETCHES) == set(SYSTEMS)
    assert len({sketch.title for sketch in SKETCHES.values()}) == len(SKETCHES)


@pytest.mark.parametrize(
    ("name", "equation"),
    [("painleve_klein", r"\mu\,\frac{d}{dt} y &= \phi - 2 x - 2 y + 1 "), ("butenin", r"eps\,\frac{d}{dt} x &= y ")],
)
def test_the_small_parameter_stands_on_one_side_of_an_equation(name, equation):
    assert equation in " ".join(system_equations(name))


@pytest.mark.slow
def test_the_script_of_a_system_and_what_it_prints_fit_on_a_page(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    script = SCRIPT.format(name="unequal_masses", which=0)
    exec(compile(script, "script", "exec"), {})
    assert max(map(len, [*script.splitlines(), *capsys.readouterr().out.splitlines()])) <= 80


def test_without_the_extra_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setattr(site, "NEEDED", ("no_such_package",))
    with pytest.raises(MissingPackage, match=r"pip install 'asympk\[site\]'"):
        site.build_site(ROOT, "nowhere")


def test_without_a_checkout_one_line_says_where_to_run(tmp_path):
    with pytest.raises(InputError, match="run asympk in a checkout"):
        site.build_site(tmp_path, tmp_path / "out")


@pytest.mark.slow
def test_a_page_with_a_dead_link_is_refused_by_name(tmp_path):
    pytest.importorskip("sphinx", reason="the extra site is not installed")
    (tmp_path / "conf.py").write_text("extensions = ['myst_parser']\n")
    (tmp_path / "index.md").write_text("# Title\n\n[there](nowhere.md)\n")
    with pytest.raises(InputError, match=r"index\.md:3.*nowhere\.md"):
        site.set_pages(tmp_path, tmp_path / "out", tmp_path / "doctrees")


def test_sections_without_their_rows_are_left_out(tmp_path):
    source = r"a \IfFileExists{rows.csv}{\input{more}}{} b"
    (tmp_path / "more.tex").write_text("M")
    assert article.with_sections(source, tmp_path) == "a  b"
    (tmp_path / "rows.csv").write_text("")
    assert article.with_sections(source, tmp_path) == "a M b"


def test_of_several_labels_in_a_formula_each_has_a_number_as_in_print():
    rst = ".. math::\n\n   \\begin{align}\n   a\\label{eq:a}\\\\\n   b\\label{eq:b}\n   \\end{align}\n\nby :eq:`eq:b`\n"
    assert article.labelled(rst) == "".join(
        f".. math::\n   :label: eq:{row}\n\n   \\begin{{align}}\n   {row}\n   \\end{{align}}\n\n" for row in "ab"
    ) + "by :eq:`eq:b`\n"


def test_a_proposition_is_called_one_and_a_command_in_the_words_of_a_picture_is_a_word_of_its_own(tmp_path):
    pytest.importorskip("pypandoc", reason="the extra site is not installed")
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "refs.bib").write_text("")
    (tmp_path / "paper" / "main.tex").write_text(
        "\\title{T}\n\\newtheorem{proposition}{Proposition}\\begin{document}By \\autoref{prop:jump}.\n"
        "\\begin{proposition}\\label{prop:jump}x\\end{proposition}\n\\begin{figure}\\includegraphics{jump.svg}"
        "\\caption{As $b\\to0$, $A\\,cL$ and $\\tan\\alpha$.}\\end{figure}\n\\end{document}\n")
    article.write_article(tmp_path, tmp_path, ROOT / "docs" / "article.lua")
    page = (tmp_path / "index.rst").read_text(encoding="utf-8")
    assert "By `proposition 1 <#prop-jump>`__." in page
    assert ":alt: As b to 0, A cL and tan alpha.\n" in page


def test_a_script_keeps_its_code_and_gains_headings_and_results():
    script = '"""Title: more words."""\n\n# %% First step\n# |a| is * here.\nx = 1\n'
    made = site.as_gallery(script, {"the_sum": {"latex": "a + b"}})
    assert made.startswith('"""\nTitle\n=====\n\nMore words.\n"""\n')
    for part in ("# First step\n# ----------\n", r"# \|a\| is \* here.", "\nx = 1\n", "# **the sum**", "#    a + b\n"):
        assert part in made


LEMMAS = set(re.findall(r"^## Lemma (\d+):", (ROOT / "docs" / "lemmas.md").read_text(encoding="utf-8"), re.MULTILINE))


def test_every_lemma_is_cited_where_it_says_and_every_citation_leads_to_a_lemma():
    text = (ROOT / "docs" / "lemmas.md").read_text(encoding="utf-8")
    cited = set()
    for number, body in re.findall(r"^## Lemma (\d+):(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL):
        for module in re.findall(r"`asympk\.([\w.]+)`", body):
            code = (ROOT / "asympk" / f"{module.replace('.', '/')}.py").read_text(encoding="utf-8")
            assert re.search(rf"Lemmas? (?:\d+ and )?{number}\b|Lemmas? {number}\b", code), (number, module)
            cited.add(number)
    for file in (ROOT / "asympk").rglob("*.py"):
        for found in re.findall(r"Lemmas? (\d+)(?: and (\d+))?", file.read_text(encoding="utf-8")):
            assert set(filter(None, found)) <= LEMMAS, file
    assert cited == LEMMAS


def test_the_places_that_the_architecture_names_are_there():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    for module in re.findall(r"`asympk\.([\w.]+)`", text):
        place = ROOT / "asympk" / module.replace(".", "/")
        assert place.is_dir() or place.with_suffix(".py").is_file(), module
    named = re.findall(r"`(\w+)`(?: and `(\w+)`)? of `asympk\.([\w.]+)`", text)
    for *names, module in named:
        place = ROOT / "asympk" / module.replace(".", "/")
        code = "" if place.is_dir() else place.with_suffix(".py").read_text(encoding="utf-8")
        for name in filter(None, names):
            defined = re.search(rf"(def|class) {name}\b|^{name} = ", code, re.MULTILINE)
            assert defined or (place / f"{name}.py").is_file(), f"{module}.{name}"
    assert len(named) > 5
