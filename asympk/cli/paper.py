"""``asympk paper``: the paper's figures, tables and numbers, and its PDF."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_root, meter

HELP = "write the figures, tables and numbers of the paper, and its PDF"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--only", metavar="PICTURE", help="only draw this picture, such as jump, as PDF and SVG; an "
                                                          "unknown name lists all")
    add_root(parser)


def run(options: Namespace) -> None:
    """Build the paper, or draw one picture, and print what was written."""
    from asympk.output.paper import build, draw_pictures
    from asympk.output.regenerate import project

    root, only = project(options.root), options.only
    with meter(f"drawing {only}") as shown:
        figures = root / "paper" / "generated" / "figures"
        lines = draw_pictures(root, [only], figures, ("pdf", "svg")) if only else build(root, shown.tell)
    print(*lines, sep="\n")
