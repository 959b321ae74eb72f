"""The arrow of imports, the lazy start, and the fixed public names."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path
from statistics import median

import pytest
from parsed import parsed

import asympk
from asympk.output.arrow import arrow_drawing, between_parts, imported_modules, modules, part_of, parts_in_order

PACKAGE = Path(asympk.__file__).parent
ARROW = list(parts_in_order(PACKAGE.parent))
MODULES = modules()


@pytest.mark.slow
def test_imports_go_one_way_along_the_arrow():
    places = {name: ARROW.index(part_of(name, ARROW)) for name in MODULES}
    imports = [(name, other) for name, file in MODULES.items() for other in imported_modules(file) if other]
    assert [(name, other) for name, other in imports if places[other] > places[name]] == []


def test_no_module_imports_itself_by_way_of_others():
    graph = {name: imported_modules(file) - {""} for name, file in MODULES.items()}
    assert set(TopologicalSorter(graph).static_order()) == set(MODULES)


def test_the_arrow_names_every_part_and_no_other():
    assert set(ARROW) == {part_of(name, ARROW) for name in MODULES}


@pytest.mark.slow
def test_the_drawing_has_an_arc_for_every_import_and_all_lead_upwards():
    axes = arrow_drawing(ARROW).axes[0]
    assert len(axes.patches) == len(between_parts(ARROW)) > 50
    assert all(arc.height > 0 for arc in axes.patches)


@pytest.mark.slow
def test_no_function_has_more_than_forty_lines_and_half_of_them_have_at_most_six():
    trees = [parsed(file.read_text()) for file in MODULES.values()]
    functions = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    lengths = {node.end_lineno - node.lineno + 1: node.name for node in functions}
    assert max(lengths) <= 40, lengths[max(lengths)]
    assert median(node.end_lineno - node.lineno + 1 for node in functions) <= 6


def test_derivations_import_the_package_and_never_the_reverse():
    for path in PACKAGE.rglob("*.py"):
        assert "derivations" not in [name for node in ast.walk(parsed(path.read_text()))
                                     if isinstance(node, ast.ImportFrom) for name in [node.module]]


def _loaded(code):
    probe = f"import sys\n{code}\nprint(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    return set(subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True).stdout.split())


def test_importing_the_package_loads_nothing_heavy():
    assert not _loaded("import asympk") & {"numpy", "sympy", "scipy", "mpmath", "matplotlib"}


def test_a_first_solve_loads_neither_sympy_nor_scipy_nor_numpy():
    code = "import asympk; asympk.solve(asympk.Scene(sigma=1, mu=1e-3, start=(0, 0.2, -1), until=1))"
    assert not _loaded(code) & {"numpy", "sympy", "scipy", "mpmath", "matplotlib"}


def test_help_loads_nothing_heavy():
    code = "import asympk.__main__ as m\ntry:\n m.main(['--help'])\nexcept SystemExit: pass"
    assert not _loaded(code) & {"numpy", "sympy", "scipy", "mpmath", "matplotlib"}


def test_every_public_name_is_there_and_documented():
    assert [name for name in asympk.__all__ if not getattr(asympk, name).__doc__] == []


def test_a_public_name_survives_the_import_of_any_module():
    assert set(MODULES) & set(asympk.__all__) == {"errors", "systems"}
