"""A process that answers one kind of question, and is ended where an answer takes too long."""

import signal
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from importlib import import_module
from multiprocessing import get_context
from threading import Lock
from time import monotonic
from typing import Any

from asympk.errors import AsympkError
from asympk.sweep.executors import uninterrupted_children

Answer = Callable[[Any, Any], Any]  # (what the worker is given, question) -> answer
PATIENCE = 2  # seconds that a computation goes on although nobody waits for it: to start a process takes as long
SLICE = 0.1  # seconds between two looks at whether somebody waits


class TimedOut(AsympkError, TimeoutError):
    """An answer took too long, or longer than it was waited for, and its process was ended."""


class Broken(AsympkError, RuntimeError):
    """The process met an error of its own, or died."""


class Worker:
    """One process with one function, ``answer(given, question)``, started at the first question or before.

    The process may start before ``given`` is known, and imports ``modules`` meanwhile. Questions from several threads
    are answered one by one. Functions that a process has compiled are kept until it ends.
    """

    def __init__(self, answer: Answer, given: Future[Any], seconds: float, modules: tuple[str, ...] = ()):
        self._answer, self._given, self._seconds, self._modules = answer, given, seconds, modules
        self._lock = Lock()
        self._process: Any = None
        self._announced = False

    def start(self) -> None:
        """Start the process before there is a question."""
        with self._lock:
            if self._process is None:
                self._start()

    def ask(self, question: Any, wanted: Callable[[], bool] = lambda: True) -> Any:
        """Return the answer; raises the ``AsympkError`` of the function ``answer``, ``TimedOut`` and ``Broken``.

        A question that is no longer ``wanted`` after ``PATIENCE`` seconds is dropped: its process is ended.
        """
        self._given.result()
        with self._lock:
            if self._process is None or not self._process.is_alive():
                self._start()
            try:
                answer = self._reply(question, wanted)
            except (EOFError, OSError):
                self.close()
                answer = Broken("the computing process died; ask again")
        if isinstance(answer, AsympkError):
            raise answer
        return answer

    def _reply(self, question: Any, wanted: Callable[[], bool]) -> Any:
        if not self._announced:
            self._pipe.send(self._given.result())
            self._announced = True
        self._pipe.send(question)
        end, wait = monotonic() + self._seconds, min(PATIENCE, self._seconds)
        while not self._pipe.poll(wait):
            if monotonic() >= end:
                self.close()
                return TimedOut(f"no answer within {self._seconds:g} s: the computation was ended; ask for less")
            if not wanted():
                self.close()
                return TimedOut("nobody waits for the answer any more: the computation was ended")
            wait = max(0.0, min(SLICE, end - monotonic()))
        return self._pipe.recv()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = None

    def _start(self) -> None:
        self.close()
        context = get_context("spawn")  # a copy of a process with threads may hang
        self._pipe, other = context.Pipe()
        process = context.Process(target=_serve, args=(other, self._answer, self._modules), daemon=True)
        with uninterrupted_children():
            process.start()
        self._process, self._announced = process, False
        other.close()


def _serve(pipe: Any, answer: Answer, modules: tuple[str, ...]) -> None:
    """Answer questions until the pipe is closed; Ctrl-C interrupts the parent process alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for module in modules:
        import_module(module)
    with suppress(EOFError, OSError):
        given = pipe.recv()
        while True:
            question = pipe.recv()
            try:
                found = answer(given, question)
            except AsympkError as error:
                found = type(error)(str(error))
            except Exception as error:
                found = Broken(f"an error of asympk itself, {type(error).__name__}: {str(error)[:200]}")
            pipe.send(found)
