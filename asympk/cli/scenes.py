"""``asympk scenes``: the scenes that ship."""

from argparse import ArgumentParser, Namespace

HELP = "list the scenes that ship, or print one as TOML"


def arguments(parser: ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("name", nargs="?", help="print this scene's file")


def run(options: Namespace) -> None:
    """Print a line on each scene that ships, or the file of one."""
    from asympk.output.terminal import scenes_as_text
    from asympk.scenes.scenefile import scene_file, scene_names, shipped

    if options.name is not None:
        scene_file(options.name)
    print(scenes_as_text(scene_names()) if options.name is None else shipped(options.name).rstrip())
