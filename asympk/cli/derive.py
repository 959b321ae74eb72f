"""``asympk derive``: run the derivations."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_root, progress

HELP = "run the derivations; write LaTeX, JSON and srepr"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    add_root(parser)


def run(options: Namespace) -> None:
    """Run every derivation and tell how many files it wrote."""
    from asympk.output.regenerate import derive

    print(f"wrote {len(derive(options.root, progress))} files under {options.root}/paper/generated")
