"""Shared by several commands: options, the scene that the options name, and the meter of progress."""

import sys
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError, Namespace
from typing import TYPE_CHECKING, Any

from asympk.errors import InputError

if TYPE_CHECKING:
    from asympk.output.meter import Meter
    from asympk.scene import Scene

_REQUIRED = ("sigma", "mu", "start", "until")


def add_root(parser: ArgumentParser) -> None:
    """Add the option that names the checkout, which may stand before and after the command."""
    parser.add_argument("--root", type=place_name, default=SUPPRESS, metavar="DIR",
                        help="the checkout with derivations/ and paper/ (here)")


def add_scene(parser: ArgumentParser) -> None:
    """Add the options that give a scene, by its name, its file or its numbers."""
    parser.add_argument("scene", nargs="?", help="a scene that ships, a system of the catalogue (asympk scenes lists "
                                                 "both), or a TOML file")
    parser.add_argument("--sigma", help="friction parameter f tan(alpha) - 2, above -2")
    parser.add_argument("--mu", help="scaled compliance of the rod, above 0")
    parser.add_argument("--start", nargs="+", metavar="NUMBER", help="a number for each state of the start; of the rod "
                                                                  "x, y, z")
    parser.add_argument("--until", help="horizon, in the scene's unit of time; for the rod, h l")
    parser.add_argument("--sigma0", help="static friction parameter f0 tan(alpha) - 2 (by default sigma)")
    add_settings(parser, "another number for a parameter or a state of the start, as in f=2.5 or theta=pi/4")


def add_settings(parser: ArgumentParser, words: str) -> None:
    """Add the option that gives numbers by name."""
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help=words)


def settings(options: Namespace) -> dict[str, str]:
    """Return ``{name: value}`` of settings such as ``f=2.5``; raises ``InputError`` for a setting of another form."""
    from asympk.formulas import read_number

    found = {}
    for setting in options.set:
        name, equals, value = setting.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise InputError(f"--set {setting!r:.60}: write it as NAME=VALUE, f=2.5")
        if name.strip() in found:
            raise InputError(f"{name.strip()} is given twice; give it once")
        found[name.strip()] = value.strip()
        read_number(name.strip(), value)  # whether an angle is in degrees, the scene knows
    return found


def limits(options: Namespace, *names: str) -> dict[str, Any]:
    """Return the given ones of the options ``names``, numbers for formulas such as "10^-8"; raises ``InputError``."""
    from asympk.formulas import read_constant

    given = {name: getattr(options, name) for name in names}
    return {name: read_constant(name, value, angles=False) for name, value in given.items() if value is not None}


def scene_numbers(options: Namespace) -> dict:
    """Return the numbers of a scene that the options give."""
    given = {name: getattr(options, name) for name in (*_REQUIRED, "sigma0")}
    return {name: value for name, value in given.items() if value is not None}


def scene_name(options: Namespace) -> str | None:
    """Return the name or file of the scene, which may stand after the numbers of --start, too, and take it off them."""
    from asympk.numbers import spells_number
    from asympk.scenes.scenefile import is_scene

    if options.scene is None and options.start and not spells_number(last := options.start[-1]) and is_scene(last):
        options.scene = options.start.pop()
    return options.scene


def given_scene(options: Namespace) -> "Scene":
    """Return the ``Scene`` that the options name, with the numbers that they give; raises ``InputError``."""
    from asympk.formulas import read_constant, read_constants
    from asympk.scene import Scene
    from asympk.scenes.scenefile import changed_scene
    from asympk.scenes.turned import in_own_units

    name = scene_name(options)
    given, named = scene_numbers(options), settings(options)
    if name is not None:
        scene, left = changed_scene(name, named)
        taken = {*given, *(in_own_units(scene).names if "start" in given else ())}
        if twice := [name for name in named if name in taken]:
            raise InputError(f"{twice[0]} is given twice; give it once")
        return _turned(scene, given, left)
    if named:
        raise InputError(f"--set {next(iter(named))}: it changes a number of a scene; name the scene")
    missing = [f"--{name}" for name in _REQUIRED if name not in given]
    if missing:
        raise InputError(f"a scene, or {', '.join(missing)}, required; asympk scenes lists the scenes")
    start = read_constants("start", given.pop("start"), angles=False)
    read = {name: read_constant(name, value, angles=False) for name, value in given.items()}
    return Scene(start=tuple(start), **read)


def _turned(scene: "Scene", given: dict, named: dict[str, str]) -> "Scene":
    from asympk.scenes.turned import in_own_units, scene_parameters, turned

    if "until" in named and "until" not in scene_parameters(scene):
        raise InputError(f"--set until: the horizon is no parameter; give it by --until {named['until']}")
    names, start, until = in_own_units(scene).names, given.pop("start", ()), given.pop("until", None)
    if start and len(start) != len(names):
        count = f"{len(start)} number{'s' * (len(start) != 1)}"
        raise InputError(f"--start has {count}; give all {len(names)}, {', '.join(names)}, or some by --set")
    begun = dict(zip(names, start, strict=False)) | {name: named.pop(name) for name in names if name in named}
    numbers = {**given, **named}
    return turned(scene, numbers, begun, until) if numbers or begun or until is not None else scene


def require_writable(options: Namespace) -> None:
    """Raise, before any work is done, where --csv or --plot names the scene's own file, or no plot can be drawn."""
    from pathlib import Path

    read = scene_name(options)
    for written in filter(None, (options.csv, options.plot)):
        if read and Path(read).is_file() and Path(written).exists() and Path(written).samefile(read):
            raise InputError(f"{written}: it is the scene's own file; give another to write")
    require_drawable(options.plot)


def require_drawable(file: str | None) -> None:
    """Raise, before any work is done, the errors of a plot that cannot be drawn into ``file``; None is for no plot."""
    if file is not None:
        from asympk.pictures import sheets

        sheets(file)


def place_name(text: str) -> str:
    """Return the name of a file or directory; refuse "", which comes from a shell variable that is not set, and "-"."""
    if not text:
        raise ArgumentTypeError("it has no name; give one")
    if text == "-":
        raise ArgumentTypeError("- is no name; give one, such as ./- or, for the terminal, /dev/stdout")
    return text


def whole_number(text: str) -> int:
    """Return the whole number that ``text`` spells; raises ``ArgumentTypeError``, which argparse reports."""
    from asympk.numbers import short

    try:
        return int(text)
    except ValueError:
        raise ArgumentTypeError(f"invalid int value {short(text)}: it must be a whole number") from None


def meter(words: str = "", total: int | None = None, log: bool = False) -> "Meter":
    """Return the ``Meter`` of a job on stderr, a context; with ``log`` it also writes where stderr is no terminal."""
    from asympk.output.meter import Meter

    shown = Meter(sys.stderr, total, log)
    shown.tell(words)
    return shown
