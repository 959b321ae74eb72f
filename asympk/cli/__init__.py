"""The command line: one file per command, each with ``HELP``, ``arguments(parser)`` and ``run(options)``.

``arguments`` adds the options of the command. ``run`` imports what it needs, so that --help stays instant, and returns
the exit status, None for 0.
``asympk.cli.options`` has what several commands share, ``asympk.cli.main`` the parser and the exit status.
"""

# in the order of --help; asympk without a command runs ``everything``
COMMANDS = ("derive", "claims", "tables", "chart", "paper", "report", "export", "scenes", "solve", "least", "sweep",
            "certify", "mechanism", "explore", "bench")
