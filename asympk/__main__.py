# PYTHON_ARGCOMPLETE_OK
"""``python -m asympk``: the command line; its commands are the files of ``asympk.cli``."""

import sys

from asympk.cli.main import main

__all__ = ["main"]

if __name__ == "__main__":
    sys.exit(main())
