"""``asympk scenes``: the scenes that ship, and the systems of the catalogue, whose examples are scenes, too."""

from argparse import ArgumentParser, Namespace

HELP = "list the scenes that ship and the catalogue of systems, or print one as TOML"


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", help="print the file of this scene or of this system's example")


def run(options: Namespace) -> None:
    """Print a line on each scene that ships and on each system of the catalogue, or the file of one."""
    from asympk import systems
    from asympk.output.terminal import scenes_as_text
    from asympk.scenes.scenefile import known_name, scene_names, scene_text

    if options.name is not None:
        print(scene_text(known_name(options.name, beyond="")))
        return
    shipped, catalogue = map(scenes_as_text, (scene_names(), systems.__all__))
    print(shipped, "the catalogue of systems, whose examples are scenes, too:", catalogue, sep="\n\n")
