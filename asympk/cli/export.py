"""``asympk export``: a system's formulas as a module that does not need asympk."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import meter, place_name

HELP = "write a stand-alone module of a system's formulas"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("scene", nargs="?", help="a scene or TOML file, whose system is written (the rod)")
    parser.add_argument("--target", required=True, help="language of the module, c or python")
    parser.add_argument("--out", type=place_name, required=True, metavar="DIR", help="directory to write into")


def run(options: Namespace) -> None:
    """Write the module and print its files."""
    from asympk.output.export import export
    from asympk.scenes.scenefile import read_scene
    from asympk.systems import painleve_klein

    given = read_scene(options.scene).system if options.scene is not None else None
    with meter("deriving the formulas"):
        paths = export(given or painleve_klein.system(), options.target, options.out)
    print(*paths, sep="\n")
