"""``asympk derive``: run the derivations."""

from argparse import Namespace

from asympk.cli.options import add_root, meter

HELP = "run the derivations; write their results as LaTeX, JSON and srepr"

arguments = add_root


def run(options: Namespace) -> None:
    """Run every derivation and print how many files were written."""
    from asympk.output.regenerate import derive

    with meter() as shown:
        written = derive(options.root, shown.tell)
    print(f"wrote {len(written)} files under {options.root}/paper/generated")
