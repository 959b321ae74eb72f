"""``asympk bench``: speed as ratios."""

from argparse import ArgumentParser, Namespace

HELP = "measure speed as ratios in one run"


def arguments(parser: ArgumentParser) -> None:
    """Add nothing: the command has no options."""


def run(options: Namespace) -> int:
    """Measure and print the ratios, line by line."""
    from asympk.studies.bench import main as bench

    return bench()
