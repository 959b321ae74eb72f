"""The arrow of imports, the lazy start, and the fixed public names."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import asympk

PACKAGE = Path(asympk.__file__).parent

# from left to right: a part imports only from itself and from parts to its left
ARROW = (
    "errors", "numbers", "naming", "rodmodes", "multiprecision", "digits", "doors", "shown", "formulas", "storage",
    "path", "many", "scene", "symbolic", "automaton", "mechanics", "systems", "flow", "affine", "arrays", "asymptotics",
    "integrators", "scenes", "certify", "methods", "sweep", "studies", "ledger", "pictures", "output",
    "explore", "cli", "__main__",
)
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def _name(path):
    """Return the dotted name of a module below asympk."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {_name(path) for path in MODULES}


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
    here = ARROW.index(_name(path).partition(".")[0])
    parts = {name.partition(".")[0] for name in _imports(path) if name}
    assert all(ARROW.index(part) <= here for part in parts)


def test_no_module_imports_itself_by_way_of_others():
    graph = {_name(path): set(_imports(path)) - {""} for path in MODULES}
    assert set(TopologicalSorter(graph).static_order()) == NAMES


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
    for path in MODULES:
        assert _name(path) not in asympk.__all__ or _name(path) in ("errors", "systems")
