"""The page: one file that needs nothing else, with every figure and table of the paper, its formulas as MathML."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from asympk.errors import InputError
from asympk.output import page
from asympk.output.mathml import mathml

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    return page.write_page(ROOT, tmp_path_factory.mktemp("page")).read_text(encoding="utf-8")


def test_the_page_needs_no_network_and_no_script(html):
    assert re.findall(r"<(?:script|link|img|iframe|object)\b", html) == []
    assert re.findall(r"(?:src|href)=\"(?!#)[^\"]*\"|@import|url\((?!#)", html) == []


def test_every_float_of_the_paper_is_on_the_page_in_its_order(html):
    source = page.with_sections((ROOT / "paper" / "main.tex").read_text(encoding="utf-8"), ROOT / "paper")
    kinds = [kind for kind, _ in page._FLOAT.findall(source)]
    assert re.findall(r"<(figure|table)>", html) == kinds
    assert html.count("<figcaption>") == kinds.count("figure")
    assert html.count("<caption>") == kinds.count("table")


def test_no_latex_is_left_in_the_words(html):
    outside = re.sub(r"<svg.*?</svg>|<style>.*?</style>", "", html, flags=re.DOTALL)
    words = re.sub(r"<[^>]+>", " ", outside)
    assert re.findall(r"\\[A-Za-z]+|\$|[{}]", words) == []


def test_ids_are_unique_and_what_refers_to_them_finds_them(html):
    ids = re.findall(r'\bid="([^"]+)"', html)
    assert len(ids) == len(set(ids)) > 100
    assert set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', html)) <= {(i, "") for i in ids} | {("", i) for i in ids}


def test_every_picture_says_in_words_what_it_shows(html):
    labels = re.findall(r'<svg[^>]* role="img" aria-label="([^"]+)"', html)
    assert len(labels) == html.count("<svg") > 5
    assert min(map(len, labels)) > 30


def test_every_formula_is_well_formed(html):
    formulas = re.findall(r"<math.*?</math>", html, re.DOTALL)
    assert len(formulas) > 100
    for formula in formulas:
        ElementTree.fromstring(formula)


def test_fractions_roots_scripts_and_primes_become_their_elements():
    assert "<mfrac><mrow><mn>1</mn></mrow><mrow><mn>2</mn></mrow></mfrac>" in mathml(r"\frac{1}{2}")
    assert "<msup><mi>x</mi><mo>′′</mo></msup>" in mathml("x''")
    assert "<msubsup><mi>R</mi><mn>1</mn><mo>′</mo></msubsup>" in mathml("R_1'")
    assert "<msqrt><mrow><mn>1</mn><mo>−</mo>" in mathml(r"\sqrt{1 - 4 \mu}")


def test_brackets_open_and_close_wherever_they_stand_and_stretch_around_high_things_alone():
    low = '<mo form="prefix" stretchy="false">(</mo><mi>x</mi><mo form="postfix" stretchy="false">)</mo>'
    assert low in mathml(r"2 (x) 3")
    assert low in mathml(r"2 \left(x\right) 3")
    assert mathml(r"\left(y \left(x\right)\right)").count(' stretchy="false"') == 4
    high = mathml(r"\left(\frac{1}{2} \left(x\right)\right)")
    assert '<mrow><mo form="prefix">(</mo><mfrac>' in high
    assert low in high
    assert high.endswith('<mo form="postfix">)</mo></mrow></math>')


def test_an_argument_without_braces_is_one_digit_as_in_tex():
    assert mathml(r"\tfrac15") == "<math><mrow><mfrac><mn>1</mn><mn>5</mn></mfrac></mrow></math>"


def test_a_minus_at_the_start_or_after_a_bracket_is_a_sign():
    assert '<mo form="prefix">−</mo>' in mathml("(-1)")
    assert 'form="prefix"' not in mathml("2 {-1}")


@pytest.mark.parametrize(("latex", "words"), [(r"\mathbb{R}", r"\\mathbb"), ("{x", "not closed"), ("x}", "too many")])
def test_what_has_no_mathml_is_refused_by_name(latex, words):
    with pytest.raises(InputError, match=words):
        mathml(latex)


def test_sections_without_their_rows_are_left_out(tmp_path):
    source = r"a \IfFileExists{rows.csv}{\input{more}}{} b"
    (tmp_path / "more.tex").write_text("M")
    assert page.with_sections(source, tmp_path) == "a  b"
    (tmp_path / "rows.csv").write_text("")
    assert page.with_sections(source, tmp_path) == "a M b"


def test_a_work_is_called_by_its_authors_and_year():
    entry = "@article{k,\n  author = {Champneys, A. R. and V{\\'a}rkonyi, P. L.},\n  year = {2016},\n}\n"
    assert page.works(entry) == {"k": "Champneys and Várkonyi (2016)"}
