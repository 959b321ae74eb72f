"""Regeneration: what is committed under paper/generated is what the code makes, byte for byte."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from asympk.errors import InputError
from asympk.output import regenerate
from asympk.output.artefacts import ARTEFACTS, tables
from asympk.output.tabular import latex, plain_rows
from asympk.storage.files import csv_text

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "paper" / "generated"
TABLES = ("methods", "convergence", "escape", "damping", "decreasing", "mechanisms")
FROM_ROWS = {
    f"{name}.{end}" for name in TABLES for end in ("tex", "csv")
}


@pytest.fixture(scope="module")
def regenerated(tmp_path_factory):
    """Run the main job in another process, under another hash seed, in a copy that has the derivations alone."""
    root = tmp_path_factory.mktemp("checkout")
    (root / "derivations").mkdir()
    for script in (ROOT / "derivations").glob("*.py"):
        (root / "derivations" / script.name).write_bytes(script.read_bytes())
    command = [sys.executable, "-m", "asympk", "--root", str(root)]
    run = subprocess.run(command, capture_output=True, text=True, env={"PYTHONHASHSEED": "7", "PYTHONPATH": str(ROOT)})
    assert (run.returncode, run.stderr) == (0, "")
    return root / "paper" / "generated", run.stdout


@pytest.mark.further
def test_every_regenerated_file_is_the_committed_one(regenerated):
    out, _ = regenerated
    made = sorted(path.relative_to(out) for path in out.rglob("*") if path.is_file())
    assert len(made) > 20
    assert [name for name in made if (out / name).read_bytes() != (COMMITTED / name).read_bytes()] == []


@pytest.mark.slow
def test_no_committed_derivation_or_table_is_left_over(regenerated):
    out, _ = regenerated
    for part in ("derivations", "tables"):
        kept = {path.name for path in (COMMITTED / part).iterdir()} - FROM_ROWS
        assert kept == {path.name for path in (out / part).iterdir()}


def test_tables_of_what_was_computed_are_those_of_the_kept_rows():
    stored = [artefact for artefact in ARTEFACTS if artefact.compute or artefact.measured]
    made = [make() for make in tables(COMMITTED / "rows", stored)]
    assert {f"{table.name}.{end}" for table in made for end in ("tex", "csv")} == FROM_ROWS
    for table in made:
        for end, dress in (("tex", latex), ("csv", lambda table: csv_text(plain_rows(table)))):
            assert (COMMITTED / "tables" / f"{table.name}.{end}").read_text(encoding="utf-8") == dress(table)


@pytest.mark.slow
def test_the_summary_tells_the_verdicts_and_the_corrections(regenerated):
    _, screen = regenerated
    assert "43 claims" in screen
    assert "Corrected:\n  C23" in screen
    assert "z -> 0, x -> x - z" in screen
    assert max(map(len, screen.splitlines())) <= 120


@pytest.mark.slow
def test_derivations_are_silent_and_end_in_results(regenerated):
    out, screen = regenerated
    assert screen.startswith("Fufaev 1991")
    for script in sorted((ROOT / "derivations").glob("*.py")):
        assert json.loads((out / "derivations" / f"{script.stem}.json").read_text(encoding="utf-8"))
        assert script.read_text().rstrip().endswith("}")


def test_outside_a_checkout_the_error_says_where_to_run(tmp_path):
    with pytest.raises(InputError, match="no derivations/: run asympk in a checkout"):
        regenerate.derive(tmp_path)
