"""``asympk chart``: the chart of cost and error."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_root, meter

HELP = "run every method on every scene; write what each costs and gets wrong"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--quick", action="store_true", help="under a minute, into paper/generated/quick")
    add_root(parser)


def run(options: Namespace) -> None:
    """Measure every method on every scene and print the files written."""
    from asympk.output.chart import main as chart
    from asympk.output.regenerate import project

    with meter(log=True) as shown:
        files = chart(options.quick, project(options.root) / "paper" / "generated", shown.tell)
    print(*files, sep="\n")
