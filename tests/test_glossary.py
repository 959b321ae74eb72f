"""One word for one thing, in the code as in ``docs/glossary.md``."""

import ast
import re
from pathlib import Path

from parsed import parsed

import asympk

ROOT = Path(asympk.__file__).parent
OLD = {  # word that once stood for a noun -> the noun
    "leg": "segment", "legs": "segments", "piece": "mode", "story": "path",
    "course": "itinerary", "courses": "itineraries", "job": "scene", "problem": "automaton", "case": "scene",
    "cases": "scenes", "careful": "the methods by name", "nouns": "the nouns by name",
    "told": "in words", "finals": "final states", "replay": "compiled layers", "pieces": "segments", "stories": "paths",
}


LOCAL = {"case", "cases", "piece", "pieces"}  # words of the field for what is local


SHARED = {  # what several modules define, for all of them the same
    "advance": "follows one mode by an integrator", "arguments": "adds the options of a command",
    "main": "runs what a command line asks for", "mechanism": "of a system of the catalogue",
    "plot": "draws what was followed", "predicted_error": "to expect of a model", "rows": "of a study",
    "run": "runs a command, or follows a scene by a method", "scene": "built from numbers",
    "scenes": "of a system of the catalogue", "solve_many": "follows many trajectories",
    "system": "of a file of the catalogue or of a study",
}


def names_in(source):
    """Return the names of the public classes, functions and methods of a module."""
    nodes = (node for node in ast.walk(parsed(source)) if isinstance(node, ast.ClassDef | ast.FunctionDef))
    return {node.name for node in nodes if not node.name.startswith("_")}


def names_bound(source):
    """Return the names of all variables and parameters of a module."""
    nodes = [*ast.walk(parsed(source))]
    variables = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return variables | {node.arg for node in nodes if isinstance(node, ast.arg)}


def old_words(names):
    """Return the names, each with the old words in it."""
    words = {name: {w.lower() for w in re.findall(r"[A-Z]?[a-z]+", name)} & OLD.keys() for name in names}
    return {name: found for name, found in words.items() if found}


def test_no_module_class_or_function_has_an_old_word_for_a_noun():
    found = {}
    for file in ROOT.rglob("*.py"):
        found |= old_words({file.stem, *names_in(file.read_text(encoding="utf-8"))})
    assert not found


def test_no_variable_or_parameter_is_named_by_what_is_told_of_it():
    found = {}
    for file in ROOT.rglob("*.py"):
        found |= old_words(names_bound(file.read_text(encoding="utf-8")))
    assert set().union(*found.values()) <= LOCAL


def test_the_names_of_variables_and_parameters_are_found():
    assert names_bound("def f(told, *, b=1):\n    for c in b: d = (e := c)") == {*"bcde", "told"}


def test_an_old_word_in_a_name_is_found():
    assert old_words({"Leg", "follow_legs", "legible", "Segment"}) == {"Leg": {"leg"}, "follow_legs": {"legs"}}


def defined(sources):
    """Return {name: modules} of the public classes and functions at the top of modules."""
    found = {}
    for module, source in sources.items():
        nodes = (node for node in parsed(source).body if isinstance(node, ast.ClassDef | ast.FunctionDef))
        for name in {node.name for node in nodes if not node.name.startswith("_")}:
            found.setdefault(name, set()).add(module)
    return found


def test_a_class_or_function_of_one_name_has_one_meaning():
    sources = {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in ROOT.rglob("*.py")}
    assert {name for name, modules in defined(sources).items() if len(modules) > 1} == SHARED.keys()


def test_a_name_that_two_modules_define_is_found():
    assert defined({"a": "class Row: ...", "b": "def Row(): ...\ndef other(): ..."})["Row"] == {"a", "b"}


def test_the_nouns_that_replace_old_words_stand_in_the_glossary():
    told = (ROOT.parent / "docs" / "glossary.md").read_text(encoding="utf-8")
    terms = set(re.findall(r"^([a-z][a-z ]+)$", told, re.MULTILINE))
    assert {"automaton", "itinerary", "mode", "path", "scene", "segment"} <= terms
