"""``asympk report``: the results, the systems and the reference as a site."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_root, meter, place_name

HELP = "write the site: results, systems, derivations, reference"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--out", type=place_name, required=True, metavar="DIR", help="directory to write the site into")
    add_root(parser)


def run(options: Namespace) -> None:
    """Write the site and print where it is."""
    from asympk.output.site import build_site

    with meter() as shown:
        path = build_site(options.root, options.out, shown.tell)
    print(f"wrote {path}")
