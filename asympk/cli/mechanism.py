"""``asympk mechanism``: a mechanism's paradox and its jump."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_settings, meter, place_name, require_drawable, settings
from asympk.errors import AsympkError, InputError

HELP = "print the paradox of a mechanism, and the jump through it"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", help="one of the catalogue, or a TOML file; without it, list the catalogue")
    add_settings(parser, "another number for a parameter or a state, as in f=2.5 or theta=pi/4")
    parser.add_argument("--plot", type=place_name, metavar="FILE", help="draw its rigid motions (.pdf, .svg, .png)")


def run(options: Namespace) -> None:
    """Print the catalogue, or the screen on a mechanism, or draw the map of its rigid motions."""
    from asympk.formulas import read_constants
    from asympk.output.mechanisms import load_mechanism, mechanism_as_text
    from asympk.output.terminal import scenes_as_text
    from asympk.systems import MECHANISMS

    if options.name is None:
        if options.set or options.plot:
            raise InputError("--set and --plot are for one mechanism; name it, or give a TOML file")
        print(scenes_as_text(MECHANISMS))
        return
    require_drawable(options.plot)
    given = settings(options)
    described = load_mechanism(options.name).changed(read_constants("--set", given))
    try:
        with meter("drawing" if options.plot else "looking for the paradox"):
            screen = _drawn(described, options.plot) if options.plot else mechanism_as_text(described, given)
    except AsympkError as error:
        raise InputError(f"{options.name}: {error}") from None
    print(screen)


def _drawn(described, place):
    """Draw the map of the rigid motions into a file, and return a line that says so."""
    from asympk.pictures import sheets
    from asympk.pictures.rigid import motion_plot

    sheets().kept(motion_plot(described), place)
    return f"wrote {place}"
