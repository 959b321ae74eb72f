"""``asympk export``: the system's formulas as a module without asympk."""

from argparse import ArgumentParser, Namespace

HELP = "write a stand-alone module of the system's formulas"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--target", required=True, help="c or python")
    parser.add_argument("--out", required=True, metavar="DIR", help="directory to write into")


def run(options: Namespace) -> None:
    """Write the module and print its files."""
    from asympk.symbolic.export import export
    from asympk.systems import painleve_klein

    for path in export(painleve_klein.system(), options.target, options.out):
        print(path)
