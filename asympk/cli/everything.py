"""``asympk`` without a command: regenerate derivations, claims and tables."""

from argparse import Namespace

from asympk.cli.options import add_root, meter

arguments = add_root


def run(options: Namespace) -> int:
    """Regenerate all, print a summary, and return 1 where a claim is not settled."""
    from asympk.output.regenerate import everything

    with meter() as shown:
        return everything(options.root, shown.tell)
