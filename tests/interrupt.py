"""A command line that hears Ctrl-C, also where the tests run in the background and every child is deaf to it."""

import sys

_HEARING = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from asympk.cli.main import main; sys.exit(main(sys.argv[1:]))"
)


def hearing(*arguments):
    """Return the command of ``asympk`` with arguments."""
    return [sys.executable, "-c", _HEARING, *map(str, arguments)]
