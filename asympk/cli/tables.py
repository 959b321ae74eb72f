"""``asympk tables``: the paper's tables."""

from argparse import Namespace

from asympk.cli.options import add_root, meter

HELP = "write the tables of the paper as LaTeX and CSV"

arguments = add_root


def run(options: Namespace) -> None:
    """Write every table and print how many files were written."""
    from asympk.output.regenerate import write_tables

    with meter("writing tables"):
        written = write_tables(options.root)
    print(f"wrote {len(written)} files under {options.root}/paper/generated/tables")
