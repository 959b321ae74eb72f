"""The drawings of the mechanics can be read, and their bytes depend on nothing but the code."""

import pytest
from legibility import flaws
from matplotlib.figure import Figure

from asympk.pictures import drawings
from asympk.pictures.figures import save
from asympk.pictures.sketches import SKETCHES, sketch


@pytest.mark.slow
def test_every_text_is_on_the_sheet_and_lies_on_no_other():
    assert flaws(drawings.draw_system()) == []


@pytest.mark.parametrize("name", SKETCHES)
@pytest.mark.few(2)
def test_every_sketch_of_the_catalogue_is_legible(name):
    assert flaws(sketch(name)) == []


def test_a_text_on_another_and_one_off_the_sheet_are_found():
    figure = Figure(figsize=(2, 1))
    for x, y, words in ((0.5, 0.5, "upper"), (0.52, 0.5, "lower"), (0.99, 0.1, "outside")):
        figure.text(x, y, words)
    assert flaws(figure) == ["'outside' leaves the sheet", "'upper' lies on 'lower'"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pdf", "svg"])
def test_the_same_drawing_has_the_same_bytes(kind, tmp_path):
    first, second = (save(drawings.draw_system(), tmp_path / f"{k}.{kind}").read_bytes() for k in (1, 2))
    assert first == second
    assert b"Date" not in first


def test_the_symbols_are_those_of_the_text():
    words = " ".join(text.get_text() for ax in drawings.draw_system().axes for text in ax.texts)
    for symbol in ("M_1", "M_2", r"\alpha", r"\beta", "P", "F", "R", r"\Delta l", "f_0", "R_1", "R_2"):
        assert symbol in words
