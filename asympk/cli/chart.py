"""``asympk chart``: the chart of cost and error."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_root, meter

HELP = "run every method on every scene; write costs and errors"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="fewer runs, in under a minute, in paper/generated/quick")
    add_root(parser)


def run(options: Namespace) -> None:
    """Measure every method on every scene and print the files written."""
    from asympk.output.paper import write_chart
    from asympk.output.regenerate import project
    from asympk.studies import chart

    kept = project(options.root) / "paper" / "generated"
    out = kept / "quick" if options.quick else kept
    with meter(log=True) as shown:
        files = [*chart.write(out, kept, options.quick, shown.tell), *write_chart(out, shown.tell)]
    print(*files, sep="\n")
