"""``asympk mechanism``: a mechanism's paradox and its jump."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_settings, meter, place_name, settings
from asympk.errors import InputError

HELP = "print the paradox of a mechanism, and the jump through it"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("name", nargs="?", help="one of the catalogue, or a TOML file; without it, list the catalogue")
    add_settings(parser, "another number for a parameter or a state, as in f=2.5")
    parser.add_argument("--plot", type=place_name, metavar="FILE", help="draw its rigid motions (.pdf, .svg, .png)")


def run(options: Namespace) -> None:
    """Print the catalogue, or the screen on a mechanism, or draw the map of its rigid motions."""
    from asympk.output.mechanisms import load_mechanism, mechanism_as_text
    from asympk.output.terminal import scenes_as_text
    from asympk.systems import MECHANISMS

    if options.name is None:
        if options.set or options.plot:
            raise InputError("--set and --plot are for one mechanism; name it, or give a TOML file")
        print(scenes_as_text(MECHANISMS))
        return
    described = load_mechanism(options.name).changed(settings(options))
    if options.plot:
        from asympk.pictures import sheets
        from asympk.pictures.rigid import motion_plot

        with meter("drawing"):
            sheets(options.plot).kept(motion_plot(described), options.plot)
        print(f"wrote {options.plot}")
        return
    with meter("looking for the paradox"):
        lines = mechanism_as_text(described)
    print(lines)
