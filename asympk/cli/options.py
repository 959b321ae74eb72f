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
    parser.add_argument("--until", help="horizon in units of h l")
    parser.add_argument("--sigma0", help="static friction, sigma by default")


def scene_numbers(options: Namespace) -> dict:
    """Return the numbers of a scene that the options give."""
    given = {name: getattr(options, name) for name in (*_REQUIRED, "sigma0")}
    return {name: value for name, value in given.items() if value is not None}


def given_scene(options: Namespace) -> "Scene":
    """Return the ``Scene`` that the options name, their own numbers replacing the file's; raises ``InputError``."""
    from asympk.errors import InputError
    from asympk.scene import Scene
    from asympk.scenes.scenefile import changed, read_scene

    given = scene_numbers(options)
    if options.scene is not None:
        return changed(read_scene(options.scene), given)
    missing = [f"--{name}" for name in _REQUIRED if name not in given]
    if missing:
        raise InputError(f"a scene, or {', '.join(missing)}, required; asympk scenes lists those that there are")
    return Scene(**{**given, "start": tuple(given["start"])})


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
