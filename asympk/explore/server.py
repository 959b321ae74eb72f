"""The server of the page: it listens on this machine only, and answers only requests with the token in the address.

Every address is ``/TOKEN/NAME``. The page and its parts are read from the package when the server starts, and the
questions of ``asympk.explore.questions`` are posted as JSON. Any other request is refused in one line.
"""

import json
from collections.abc import Callable
from concurrent.futures import Future
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from secrets import compare_digest, token_urlsafe
from select import select
from socket import MSG_PEEK
from threading import Thread
from typing import Any, NoReturn

from asympk.errors import AsympkError, InputError
from asympk.explore.knobs import knobs_of
from asympk.explore.questions import QUESTIONS, as_json
from asympk.explore.worker import Broken, TimedOut, Worker
from asympk.scene import Scene

HOST = "127.0.0.1"
LARGEST = 65536  # bytes of a question
PAGE = {"": ("index.html", "html"), "explore.css": ("explore.css", "css"), "explore.js": ("explore.js", "javascript")}
SCENES = "scenes"  # the part of the page with the knobs of its scenes
GUARDS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class BadRequest(Exception):
    """A request is refused, with an HTTP status and one line as arguments."""


class Server(ThreadingHTTPServer):
    """The server of a page with some scenes, at ``address``; closing the server ends its processes.

    The page can be opened before ``show`` has derived the scenes.
    """

    daemon_threads = True
    request_queue_size = 128  # of five, the tabs that load at once fill the queue, and the next one waits for a second

    def __init__(self, port: int = 0):
        self.token = token_urlsafe(24)
        self.scenes: Future[tuple[Scene, ...]] = Future()
        page = files("asympk").joinpath("explore", "page")
        self.parts = {name: (page.joinpath(file).read_bytes(), f"text/{kind}; charset=utf-8")
                      for name, (file, kind) in PAGE.items()}
        self.workers = {name: Worker(q, self.scenes, q.seconds, q.modules) for name, q in QUESTIONS.items()}
        try:
            super().__init__((HOST, port), _Handler)
        except OSError as reason:
            raise InputError(f"port {port} cannot be used ({reason.strerror}); give another --port, or none") from None

    def show(self, scenes: Callable[[], tuple[Scene, ...]]) -> None:
        """Derive the scenes of the page, while the process of the motion starts; raises what ``scenes`` raises."""
        Thread(target=self.workers["motion"].start).start()  # Ctrl-C does not interrupt a thread
        try:
            self.scenes.set_result(scenes())
        except AsympkError as error:
            self.scenes.set_exception(error)
            raise

    def part(self, name: str) -> tuple[bytes, str]:
        """Return a part of the page as (bytes, kind); raises ``KeyError`` where there is none of this name."""
        if name == SCENES:
            return as_json([knobs_of(scene) for scene in self.scenes.result()]), "application/json"
        return self.parts[name]

    @property
    def address(self) -> str:
        """The address of the page, with its token."""
        return f"http://{HOST}:{self.server_port}/{self.token}/"

    def server_close(self) -> None:
        """Stop listening and end the processes."""
        super().server_close()
        for worker in self.workers.values():
            worker.close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print nothing where a browser closes the connection in the middle of an answer."""


class _Handler(BaseHTTPRequestHandler):
    server: Server
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "asympk", ""
    error_message_format, error_content_type = "%(code)d %(message)s\n", "text/plain; charset=utf-8"
    disable_nagle_algorithm = True
    wbufsize = -1
    timeout = 60

    def do_GET(self) -> None:
        """Send a part of the page."""
        self._answer(self.server.part, self.server.workers)

    def do_POST(self) -> None:
        """Answer a question."""
        self._answer(self._asked, (*self.server.parts, SCENES))

    def _answer(self, found: Callable[[str], tuple[bytes, str]], others: Any) -> None:
        status = 200
        try:
            name = self._name()
            if name in others:
                raise BadRequest(405, f"{self.command} is not for this address")
            body, kind = found(name)
        except KeyError:
            status, body, kind = 404, *_as_error("there is nothing at this address")
        except BadRequest as refused:
            status, body, kind = refused.args[0], *_as_error(refused.args[1])
            self.close_connection = True
        except (AsympkError, RecursionError) as error:
            status = 503 if isinstance(error, TimedOut) else 500 if isinstance(error, Broken) else 400
            body, kind = _as_error(" ".join(str(error).split()))
        self._send(status, body, kind)

    def _name(self) -> str:
        """Return NAME of the address; raises ``BadRequest`` where the host or the token is not that of the server."""
        if self.headers.get("Host") not in {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}:
            raise BadRequest(421, "this server is known by its address alone; open the address that it printed")
        token, slash, name = self.path.removeprefix("/").partition("/")
        if not compare_digest(token.encode("utf-8", "replace"), self.server.token.encode()):
            raise BadRequest(403, "the token in the address is missing or wrong; open the address that was printed")
        if not slash:
            raise BadRequest(404, "an address has a / after its token")
        return name

    def _asked(self, name: str) -> tuple[bytes, str]:
        return self.server.workers[name].ask(self._question(), self._waits), "application/json"

    def _waits(self) -> bool:
        """Return whether the page still waits, which closes the connection where it does not."""
        try:
            return not select([self.connection], [], [], 0)[0] or self.connection.recv(1, MSG_PEEK) != b""
        except OSError:
            return False

    def _question(self) -> Any:
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()) or "Transfer-Encoding" in self.headers:
            raise BadRequest(411, "a question needs a Content-Length")
        if len(length) > 9 or int(length) > LARGEST:
            raise BadRequest(413, f"a question has at most {LARGEST} bytes")
        body = self.rfile.read(int(length))
        if len(body) < int(length):
            raise BadRequest(400, "the question is shorter than its Content-Length")
        try:
            return json.loads(body, parse_constant=_refuse_constant)
        except (ValueError, RecursionError):
            raise BadRequest(400, "the question is not JSON of finite numbers") from None

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse a malformed request; an unknown method has the status 405, method not allowed."""
        super().send_error(405 if code == 501 else code, message, explain)

    def _send(self, status: int, body: bytes, kind: str) -> None:
        self.send_response(status)
        for name, value in (("Content-Type", kind), ("Content-Length", str(len(body))), *GUARDS.items()):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Keep the terminal quiet."""


def _as_error(line: str) -> tuple[bytes, str]:
    return as_json({"error": line}), "application/json"


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number")
