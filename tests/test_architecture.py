"""The arrow of imports, the lazy start, and the fixed public names."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import asympk

PACKAGE = Path(asympk.__file__).parent

# from left to right; a module imports only from its own stage or from stages to its left
STAGES = (
    ("errors", "arithmetic", "files", "tomlfile", "lock", "meter", "executors", "style", "path", "tape", "rows"),
    ("conditions", "system", "systems", "ratio", "series"),
    ("diffring", "expansion", "critical", "manifold", "stability", "linear", "itinerary", "layers", "jump"),
    ("lowering", "regions", "stick", "export", "regimes"),
    ("scene", "smooth", "fastslow", "ordinary", "roots", "rounding", "dense", "flow", "exact", "piecewise",
     "integrators",
     "integrate", "replay", "composite", "hybrid", "collocation",
     "scenefile", "units", "trace", "balls", "enclosure", "certify", "proofs"),
    ("sweepfile", "asymptotic", "finals", "columns", "kernels", "courses", "brackets", "motions", "careful",
     "ensemble", "methods"),
    ("chunks", "sweep", "summary", "divide", "compare", "least", "bench", "convergence", "collisions", "leastmap"),
    ("ledger",),
    ("mathml", "tabular", "tables", "figures", "drawings", "portraits", "maps"),
    ("chart", "terminal", "regenerate", "gallery", "numbers", "paper", "page"),
    ("__main__",),
)
STAGE = {name: number for number, names in enumerate(STAGES) for name in names}


def _imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("asympk."):
            yield node.module.split(".")[1]
        elif isinstance(node, ast.ImportFrom) and node.module == "asympk":
            yield from (alias.name for alias in node.names if alias.name in STAGE)
        elif isinstance(node, ast.Import):
            yield from (a.name.split(".")[1] for a in node.names if a.name.startswith("asympk."))


def _module(path):
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_one_way_along_the_arrow(path):
    if path == PACKAGE / "__init__.py":
        return
    stage = STAGE[_module(path)]
    assert all(STAGE[name] <= stage for name in _imports(path) if name != "errors")


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
    for path in PACKAGE.glob("*.py"):
        assert path.stem not in asympk.__all__ or path.stem in ("errors", "systems")
