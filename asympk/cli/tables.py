"""``asympk tables``: the paper's tables."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_root

HELP = "write the LaTeX tables and their CSV twins"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    add_root(parser)


def run(options: Namespace) -> None:
    """Write every table and tell how many files that made."""
    from asympk.output.regenerate import write_tables

    print(f"wrote {len(write_tables(options.root))} files under {options.root}/paper/generated/tables")
