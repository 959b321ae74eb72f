# PYTHON_ARGCOMPLETE_OK
"""``python -m asympk``: the command line; its commands are the files of ``asympk.cli``."""

import sys


def main(arguments: list[str] | None = None) -> int:
    """Run ``asympk.cli.main`` and return its exit status, 130 also where its loading is interrupted."""
    try:
        from asympk.cli.main import main as run

        return run(arguments)
    except KeyboardInterrupt:
        print("asympk: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
