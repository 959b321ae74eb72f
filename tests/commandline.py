"""The command line, run within a test."""

from asympk.__main__ import main


def run(capsys, *arguments):
    """Return (exit status, what is printed, what is printed as errors) of ``asympk ARGUMENTS``."""
    try:
        status = main([*arguments])
    except SystemExit as stop:
        status = stop.code
    out, err = capsys.readouterr()
    return status, out, err
