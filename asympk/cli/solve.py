"""``asympk solve``: the path of a scene."""

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any

from asympk.cli.options import add_scene, given_scene, limits, meter, place_name, require_writable, whole_number

if TYPE_CHECKING:
    from asympk.scene import Scene

HELP = "follow the motion of one scene"


def arguments(parser: ArgumentParser) -> None:
    add_scene(parser)
    parser.add_argument("--physical", action="store_true", help="give the path in the units of the scene's file")
    parser.add_argument("--csv", type=place_name, metavar="FILE", help="write the path as CSV, in doubles")
    parser.add_argument("--plot", type=place_name, metavar="FILE", help="draw the path into a .pdf, .svg or .png file")
    parser.add_argument("--method", default="exact", help="exact (default), rigid, slow, jump, or an integrator such "
                                                          "as lsoda; an unknown name lists all")
    parser.add_argument("--digits", type=whole_number, help="compute with that many decimal digits, and print them")
    parser.add_argument("--order", type=whole_number, help="order in mu (asymptotic models)")
    parser.add_argument("--rtol", help="relative tolerance (integrators)")
    parser.add_argument("--atol", help="absolute tolerance (integrators)")
    parser.add_argument("--steps", type=whole_number, help="largest number of steps (integrators)")
    parser.add_argument("--seconds", help="largest number of seconds (integrators)")
    parser.add_argument("--events", type=whole_number, help="largest number of events (systems, and integrators)")
    parser.add_argument("--json", action="store_true", help="print the path as JSON")


def run(options: Namespace) -> None:
    """Follow the scene, write the files asked for and print the path."""
    from contextlib import redirect_stdout

    from asympk.methods import solve
    from asympk.output.terminal import below_scene, path_as_json, path_as_text

    given = limits(options, "digits", "order", "rtol", "atol", "steps", "seconds", "events")
    require_writable(options)
    scene = given_scene(options)
    with meter("following the scene", log=True) as shown, redirect_stdout(None):  # where scikit-sundae prints
        path = solve(scene, options.method, **given, **_reaching(scene, options, shown))
    if options.physical:
        path = path.physical()
    if options.csv:
        path.to_csv(options.csv)
    if options.plot:
        path.plot(options.plot)
    if options.json:
        print(path_as_json(path, options.digits))
    else:
        print(below_scene(scene, path_as_text(path, options.digits), physical=options.physical))


def _reaching(scene: "Scene", options: Namespace, shown: Any) -> dict[str, Any]:
    """Return the option by which the rod's exact flow with many digits reports its progress; for others, none."""
    if not options.digits or options.method != "exact" or scene.system is not None:
        return {}
    return {"progress": lambda t, until, digits: shown.tell(f"t = {t:.6g} of {until:.6g}, with {digits} digits")}
