"""A sweep as a text, without a file."""

from asympk.storage.tomlfile import parse_table
from asympk.sweep.sweepfile import sweep_of_table


def parse_sweep(text):
    """Return the ``Sweep`` that a text of TOML describes."""
    return sweep_of_table(parse_table(text.encode(), "sweep"), "sweep")
