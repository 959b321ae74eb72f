"""From arguments to an exit status: the parser of all commands, and one line on stderr for whatever is wrong."""

import argparse
import errno
import os
import re
import signal
import sys
import threading
import traceback
from _thread import interrupt_main
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from types import FrameType
from typing import Any, NoReturn

from asympk import __version__
from asympk.cli import COMMANDS
from asympk.errors import AsympkError, InputError, MissingPackage, OrderError, UnknownName

_OF_ARGUMENTS = (InputError, MissingPackage, OrderError, UnknownName)  # of files these name the file themselves
_NEGATIVE = re.compile(r"^-(\d|\.\d|\(|pi\b|[a-z]+\()")  # -1e-3 and -pi/4 are numbers too, where argparse sees options
_AGAIN = 0.05  # seconds after which an interruption that was ignored is raised again


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status: 0 done, 1 a claim or check does not hold, 2 bad input.

    Ctrl-C and SIGTERM end it alike, with status 130 and 143: what is half written is removed, and workers end.
    """
    _open_streams()
    try:
        with _hearing_signals():
            return _run(parser(), arguments)
    except KeyboardInterrupt as interruption:
        _complain("asympk: interrupted")
        return 128 + int(next(iter(interruption.args), signal.SIGINT))


@contextmanager
def _hearing_signals() -> Iterator[None]:
    """Raise ``KeyboardInterrupt`` for Ctrl-C and SIGTERM, which only the main thread can hear.

    An interruption that comes in the callback of a weak reference, where Python ignores it, is raised again.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = [signal.SIGTERM] + [signal.SIGINT] * (signal.getsignal(signal.SIGINT) is signal.default_int_handler)
    before, hook = {number: signal.signal(number, _interrupt) for number in heard}, sys.unraisablehook
    sys.unraisablehook = partial(_ignored, hook)
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _loads(frame):
        _raise_again(number)
    else:
        raise KeyboardInterrupt(number)


def _loads(frame: FrameType | None) -> bool:
    """Tell whether a command loads a module: mpmath ignores whatever is raised while it loads gmpy2."""
    while frame and frame.f_code is not main.__code__:
        if frame.f_globals.get("__name__") == "importlib._bootstrap":
            return True
        frame = frame.f_back
    return False


def _ignored(hook: Callable[[Any], Any], ignored: Any) -> None:
    if issubclass(ignored.exc_type, KeyboardInterrupt):
        _raise_again(next(iter(ignored.exc_value.args), signal.SIGINT))
    else:
        hook(ignored)


def _raise_again(number: int) -> None:
    posix = hasattr(signal, "pthread_kill")  # which ends a wait, too
    raised = partial(signal.pthread_kill, threading.get_ident()) if posix else interrupt_main
    again = threading.Timer(_AGAIN, raised, (number,))
    again.daemon = True
    again.start()


def _run(whole, arguments):
    if "_ARGCOMPLETE" in os.environ:
        _complete(whole)
    options = whole.parse_args(arguments)
    try:
        return options.run(options) or 0
    except BrokenPipeError:  # the reader of the output has closed it
        sys.stdout = None
        return 141
    except (AsympkError, OSError) as error:
        if options.debug:
            _complain(traceback.format_exc())
        _complain(f"asympk: {_file_of(options, error)}{_one_line(error)}")
        return 2
    except AttributeError:
        if options.debug or sys.flags.optimize < 2:
            raise
        _complain("asympk: python -OO drops the docstrings that SymPy's mechanics reads; run python -O, or neither")
        return 2


def _file_of(options: argparse.Namespace, error: Exception) -> str:
    """Return "file: " for an error of the motion or the model of a scene in a file, which does not know its file."""
    place, words = getattr(options, "scene", None), str(error)
    of_arguments = isinstance(error, (OSError, *_OF_ARGUMENTS)) and not words.startswith("start: ")
    if not place or of_arguments or words.startswith(f"{place}: "):
        return ""
    from asympk.scenes.scenefile import is_file

    return f"{place}: " if is_file(place) else ""


def _complete(whole: argparse.ArgumentParser) -> None:
    """Print the completions of a line for the shell, and exit; print nothing where argcomplete is not installed."""
    try:
        import argcomplete
    except ImportError:
        raise SystemExit(1) from None
    argcomplete.autocomplete(whole)


def _open_streams() -> None:
    """Replace closed streams by the null device, lest a file get their number; escape what a stream cannot encode."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - it stays open
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def _complain(line: str) -> None:
    """Print a line on stderr; where stderr is full or closed, the exit status alone reports the error."""
    with suppress(OSError, ValueError):
        print(line, file=sys.stderr, flush=True)


def _one_line(error: object) -> str:
    if isinstance(error, OSError) and (error.filename or error.errno == errno.ENOSPC):
        return f"{error.filename or 'the output'}: {error.strerror}; give another place"
    return " ".join(str(error).split())


class _Parser(argparse.ArgumentParser):
    """An argument parser that reads any negative number as a value, and whose complaint is one line."""

    def __init__(self, *arguments: Any, **options: Any):
        super().__init__(*arguments, **options)
        self._negative_number_matcher = _NEGATIVE

    def parse_known_args(self, *arguments: Any, **options: Any) -> Any:
        """Refuse what is left over in the name of the command whose help lists its options, not of asympk."""
        found, left = super().parse_known_args(*arguments, **options)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return found, left

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {_one_line(message)}; see {self.prog} --help\n")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line, with a sub-command for each of ``COMMANDS``."""
    whole = _Parser(
        prog="asympk",
        description="Verified asymptotics for mechanical systems with dry friction. Without a command: rederive the "
        "paper of the Painlevé-Klein example, check its claims, write its tables, and summarise them.",
    )
    whole.set_defaults(debug=False, root=".")
    whole.add_argument("--version", action="version", version=f"asympk {__version__}")
    whole.add_argument("--debug", action="store_true", help="show the traceback of an error")
    _add(whole, "everything")
    commands = whole.add_subparsers(title="commands", metavar="COMMAND")
    for name in COMMANDS:
        _add(commands.add_parser(name, help=import_module(f"asympk.cli.{name}").HELP), name)
    return whole


def _add(part: argparse.ArgumentParser, name: str) -> None:
    command = import_module(f"asympk.cli.{name}")
    command.arguments(part)
    part.set_defaults(run=command.run)
