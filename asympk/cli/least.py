"""``asympk least``: the least model that is accurate enough."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import add_scene, given_scene, limits, meter

HELP = "find the least model that is accurate enough for a scene"


def arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    parser.add_argument("--rtol", default="1e-3", help="error allowed, relative to the largest of 1 and states (1e-3)")
    parser.add_argument("--seconds", help="try no further model, and measure no error, after so many (no limit)")
    parser.add_argument("--json", action="store_true", help="print the ladder as JSON")


def run(options: Namespace) -> None:
    """Climb the ladder of models and print its rungs."""
    import json

    from asympk.output.terminal import below_scene, ladder_as_text
    from asympk.studies.least import least_model

    scene, given = given_scene(options), limits(options, "rtol", "seconds")
    with meter("climbing the ladder of models"):
        ladder = least_model(scene, **given)
    print(json.dumps(ladder.as_dict(), indent=2) if options.json else below_scene(scene, ladder_as_text(ladder)))
