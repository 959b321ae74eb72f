"""``asympk tables``: the paper's tables."""

from argparse import Namespace

from asympk.cli.options import add_root, meter

HELP = "write the LaTeX tables and their CSV twins"

arguments = add_root


def run(options: Namespace) -> None:
    """Write every table and tell how many files that made."""
    from asympk.output.regenerate import write_tables

    with meter("writing tables"):
        written = write_tables(options.root)
    print(f"wrote {len(written)} files under {options.root}/paper/generated/tables")
