"""The arrow of imports, the lazy start, and the fixed public names."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import asympk
from asympk.output.arrow import arrow, arrow_drawing, between_parts, imports, modules

PACKAGE = Path(asympk.__file__).parent
<<<<<<< c7f0496d85a44016abca83ac2c8dba8339a0ff4c

# from left to right: a part imports only from itself and from parts to its left
ARROW = (
    "errors", "numbers", "systems.painleve_klein.modes", "multiprecision", "arithmetic", "digits", "doors", "shown",
    "formulas", "storage", "path", "many", "scene", "symbolic", "automaton", "mechanics", "systems", "affine",
    "asymptotics", "integrators", "scenes", "certify", "methods", "sweep", "studies", "ledger", "pictures", "output",
    "cli", "__main__",
)  # fmt: skip
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def _name(path):
    """Return the dotted name of a module below asympk."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {_name(path) for path in MODULES}


def _room(name):
    """Return the entry of ARROW that a module belongs to: itself, or the package that holds it."""
    return name if name in ARROW else name.partition(".")[0]


def _imports(path):
    """Yield the modules of asympk, as dotted names below it, that a module imports anywhere but for its annotations."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            node.body = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in found:
            below = name.removeprefix("asympk.")
            if name != below:
                yield below if below in NAMES else below.rpartition(".")[0]


@pytest.mark.parametrize("path", MODULES, ids=_name)
def test_imports_go_one_way_along_the_arrow(path):
    here = ARROW.index(_room(_name(path)))
    assert all(ARROW.index(_room(name)) <= here for name in _imports(path) if name)
=======
ARROW = list(arrow(PACKAGE.parent))
MODULES = modules()


@pytest.mark.parametrize("name", MODULES)
def test_imports_go_one_way_along_the_arrow(name):
    here = ARROW.index(name.partition(".")[0])
    parts = {other.partition(".")[0] for other in imports(MODULES[name]) if other}
    assert all(ARROW.index(part) <= here for part in parts)
>>>>>>> 2de3cfaf94ce0684213e77b0a043ae0a08ecf241


def test_no_module_imports_itself_by_way_of_others():
    graph = {name: set(imports(file)) - {""} for name, file in MODULES.items()}
    assert set(TopologicalSorter(graph).static_order()) == set(MODULES)


def test_the_arrow_names_every_part_and_no_other():
    assert set(ARROW) == {name.partition(".")[0] for name in MODULES}


def test_the_drawing_has_an_arc_for_every_import_and_all_lead_upwards():
    axes = arrow_drawing(ARROW).axes[0]
    assert len(axes.patches) == len(between_parts()) > 50
    assert all(arc.height > 0 for arc in axes.patches)


def test_derivations_import_the_package_and_never_the_reverse():
    for path in PACKAGE.rglob("*.py"):
        assert "derivations" not in [name for node in ast.walk(ast.parse(path.read_text()))
                                     if isinstance(node, ast.ImportFrom) for name in [node.module]]  # fmt: skip


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


@pytest.mark.parametrize("name", sorted(set(asympk.__all__)))
def test_every_public_name_is_there_and_documented(name):
    assert getattr(asympk, name).__doc__


def test_a_public_name_survives_the_import_of_any_module():
    assert set(MODULES) & set(asympk.__all__) == {"errors", "systems"}
