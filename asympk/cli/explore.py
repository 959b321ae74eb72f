"""``asympk explore``: a page in the browser on which one changes a scene and sees its motion."""

from argparse import ArgumentParser, Namespace

from asympk.cli.options import meter, whole_number

HELP = "open a page on which to drag the start of a scene and change its parameters"
HEARD = 0.5  # seconds: the longest delay of Ctrl-C


def arguments(parser: ArgumentParser) -> None:
    parser.add_argument("scene", nargs="?", help="a scene that ships, a system of the catalogue, or a TOML file "
                                                 "(all scenes that ship)")
    parser.add_argument("--port", type=whole_number, default=0, help="listen on this port (any that is free)")
    parser.add_argument("--no-browser", action="store_true", help="print the address and open no browser")


def run(options: Namespace) -> None:
    """Serve the page until Ctrl-C; a file is read before, and the page opens while the catalogue is being derived."""
    import webbrowser
    from contextlib import suppress
    from threading import Thread

    from asympk.explore.choice import chosen_scenes
    from asympk.explore.server import Server
    from asympk.numbers import whole as require_whole

    port = require_whole("--port", options.port, 0, 65535)
    with meter("deriving the equations"):
        scenes = chosen_scenes(options.scene)
    with Server(port) as server, suppress(KeyboardInterrupt):
        serving = Thread(target=server.serve_forever, daemon=True)
        serving.start()
        print(server.address, flush=True)
        if not options.no_browser:
            webbrowser.open(server.address)
        server.show(scenes)
        print("Ctrl-C ends it.", flush=True)
        while serving.is_alive():
            serving.join(HEARD)  # an interrupt that comes just before a wait does not end it
