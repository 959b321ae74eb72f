"""``asympk report``: the results as a page."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_root, progress

HELP = "write figures, tables and formulas as one HTML page"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--out", required=True, metavar="DIR", help="directory to write index.html into")
    add_root(parser)


def run(options: Namespace) -> None:
    """Write the page and print where it is."""
    from asympk.output.page import write_page

    path = write_page(options.root, options.out, progress)
    progress("")
    print(f"wrote {path}")
