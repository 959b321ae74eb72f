"""What several commands share: their options, the scene that these name, and the meter of progress."""

import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from asympk.output.meter import Meter
    from asympk.scene import Scene

_REQUIRED = ("sigma", "mu", "start", "until")


def add_root(parser: ArgumentParser) -> None:
    """Add the option that names the checkout."""
    parser.add_argument("--root", type=place_name, default=".", metavar="DIR",
                        help="the checkout with derivations/ and paper/ (here)")  # fmt: skip


def add_scene(parser: ArgumentParser) -> None:
    """Add a scene, by name, file or numbers."""
    parser.add_argument("scene", nargs="?", help="a scene that ships, a system of the catalogue (asympk scenes lists "
                                                 "both), or a TOML file")  # fmt: skip
    parser.add_argument("--sigma", help="friction parameter f tan(alpha) - 2, above -2")
    parser.add_argument("--mu", help="compliance, above 0")
    parser.add_argument("--start", nargs=3, metavar=("X", "Y", "Z"), help="rho, rho', v")
    parser.add_argument("--until", help="horizon in units of h l, or of the scene")
    parser.add_argument("--sigma0", help="static friction, sigma by default")
    add_settings(parser, "another number of the scene, a parameter or a state at the start, f=2.5")


def add_settings(parser: ArgumentParser, words: str) -> None:
    """Add the option that gives numbers by name."""
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help=words)


def settings(options: Namespace) -> dict[str, str]:
    """Return ``{name: value}`` of settings such as ``f=2.5``; raises ``InputError`` for what is none."""
    from asympk.errors import InputError
    from asympk.numbers import number

    found = {}
    for setting in options.set:
        name, equals, value = setting.partition("=")
        if not (name.strip() and equals and value.strip()):
            raise InputError(f"--set {setting!r:.60}: write it as NAME=VALUE, f=2.5")
        found[name.strip()] = value.strip()
        number(name.strip(), value.strip())
    return found


def scene_numbers(options: Namespace) -> dict:
    """Return the numbers of a scene that the options give."""
    given = {name: getattr(options, name) for name in (*_REQUIRED, "sigma0")}
    return {name: value for name, value in given.items() if value is not None}


def given_scene(options: Namespace) -> "Scene":
    """Return the ``Scene`` that the options name, their own numbers replacing its own; raises ``InputError``."""
    from asympk.errors import InputError
    from asympk.scene import Scene
    from asympk.scenes.scenefile import read_scene

    given, named = scene_numbers(options), settings(options)
    if options.scene is not None:
        return _turned(read_scene(options.scene), given, named)
    if named:
        raise InputError(f"--set {next(iter(named))}: it changes a number of a scene; name the scene")
    missing = [f"--{name}" for name in _REQUIRED if name not in given]
    if missing:
        raise InputError(f"a scene, or {', '.join(missing)}, required; asympk scenes lists those that there are")
    return Scene(**{**given, "start": tuple(given["start"])})


def _turned(scene: "Scene", given: dict, named: dict[str, str]) -> "Scene":
    from asympk.errors import InputError
    from asympk.scenes.turned import in_own_units, turned

    names, start, until = in_own_units(scene).names, given.pop("start", ()), given.pop("until", None)
    if start and len(start) != len(names):
        raise InputError(f"--start has {len(start)} numbers for {', '.join(names)}; give each by --set")
    begun = dict(zip(names, start, strict=False)) | {name: named.pop(name) for name in names if name in named}
    numbers = {**given, **named}
    return turned(scene, numbers, begun, until) if numbers or begun or until is not None else scene


def require_other_file(written: str | None, read: str | None) -> None:
    """Raise ``InputError`` where a file to be written is the one that is read."""
    from pathlib import Path

    from asympk.errors import InputError

    if written and read and Path(read).is_file() and Path(written).exists() and Path(written).samefile(read):
        raise InputError(f"{written}: it is the scene's own file; give another to write")


def place_name(text: str) -> str:
    """Read the name of a file or of a directory; an empty one, as of a variable that is not set, is none."""
    if not text:
        raise ArgumentTypeError("it has no name; give one")
    return text


def whole_number(text: str) -> int:
    """Read a whole number; argparse tells what it was."""
    from asympk.numbers import short

    try:
        return int(text)
    except ValueError:
        raise ArgumentTypeError(f"invalid int value {short(text)}: it must be a whole number") from None


def meter(words: str = "", total: int | None = None, log: bool = False) -> "Meter":
    """Return the ``Meter`` of a job on stderr, a context; ``log`` lets it add lines to a file, too."""
    from asympk.output.meter import Meter

    shown = Meter(sys.stderr, total, log)
    shown.tell(words)
    return shown
