"""Where chunks are computed: in this process, in worker processes that may die, or on a dask cluster."""

import os
import re
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from asympk.errors import InputError, MissingPackage
from asympk.numbers import short

_AT_REST = threading.Lock()  # held by a worker while it does not compute
_PATIENCE = 2.5  # seconds to wait for the answer of a dask scheduler
_ADDRESS = re.compile(r"(?:(?:tcp|tls|ws|wss|ucx)://)?([^/\s:]+|\[[0-9a-fA-F:.]+\]):(\d{1,5})", re.ASCII)


@contextmanager
def uninterrupted_children() -> Iterator[None]:
    """Keep Ctrl-C, where signals can be masked, from the processes that the block starts: also while they import."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # its start, which is a part of that of the first process, unmasks Ctrl-C
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class InProcess(Executor):
    """An executor that computes in this process, during ``submit``."""

    def submit(self, function: Callable, /, *arguments: Any, **named: Any) -> Future:
        """Return a ``Future`` that is done."""
        future: Future = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future


class Processes(Executor):
    """An executor of worker processes; when a worker is killed, a new pool takes the place of the broken one.

    Workers ignore Ctrl-C, which their parent process handles. They exit at once when the parent process is gone, or
    when the block of this context ends with an exception.
    """

    def __init__(self, workers: int):
        self._workers, self._pool = workers, None

    def __exit__(self, kind: Any, *_: object) -> None:
        if kind and self._pool:
            self._held.close()
        self.shutdown(cancel_futures=True)

    @uninterrupted_children()
    def submit(self, function: Callable, /, *arguments: Any, **named: Any) -> Future:
        """Return the ``Future`` of a call in a worker; it ends in ``BrokenProcessPool`` when a worker is killed."""
        try:
            return self._running().submit(_compute, function, *arguments, **named)
        except BrokenProcessPool:
            self.shutdown()
            return self._running().submit(_compute, function, *arguments, **named)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Stop the workers."""
        if self._pool:
            self._pool.shutdown(wait, cancel_futures=cancel_futures)
            self._held.close()
            self._awaited.close()
            self._pool = None

    def _running(self):
        if self._pool is None:
            from multiprocessing import get_context

            context = get_context("spawn")
            self._awaited, self._held = context.Pipe(duplex=False)
            self._pool = ProcessPoolExecutor(self._workers, context, _start_worker, (self._awaited,))
        return self._pool


def _start_worker(awaited):
    """Ignore Ctrl-C, and leave when the parent process is gone or closes the other end of ``awaited``."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _AT_REST.acquire()
    threading.Thread(target=_leave, args=(awaited,), daemon=True).start()


def _compute(function, /, *arguments, **named):
    _AT_REST.release()
    try:
        return function(*arguments, **named)
    finally:
        _AT_REST.acquire()


def _leave(awaited):
    """Exit once asked to, but not in the middle of a result, for whose rest the parent process would wait for ever."""
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process().sentinel
    while parent not in wait([parent, awaited]) and not _AT_REST.acquire(timeout=1):
        pass
    os._exit(1)


@contextmanager
def executor(workers: int | None = None, dask: str | None = None) -> Iterator[Executor]:
    """Yield the ``Executor`` of some worker processes, of the dask cluster at an address, or by default this process.

    Raises ``InputError`` where there is no such cluster, ``MissingPackage`` without dask.
    """
    if workers is not None and dask is not None:
        raise InputError("either --workers or --dask: a cluster has its own workers")
    if dask is not None:
        with _client(dask) as client:
            yield client.get_executor(pure=False)
        return
    if workers is not None and not 1 <= workers <= 1024:
        raise InputError(f"workers = {workers}: it must be from 1 to 1024")
    with Processes(workers) if workers else InProcess() as pool:
        yield pool


def _client(address):
    if not find_spec("distributed"):
        raise MissingPackage("--dask needs dask.distributed: pip install 'asympk[sweep]'")
    if not address.startswith("inproc://"):
        _knock(address)
    found = []
    asking = threading.Thread(target=_ask, args=(address, found), daemon=True)
    asking.start()
    asking.join(_PATIENCE + 1.5)  # any server may listen there, and may never answer
    answer = found[0] if found else "the server there does not answer as a scheduler"
    if isinstance(answer, Exception | str):
        raise InputError(f"--dask {short(address)}: there is no dask scheduler ({str(answer)[:80]})") from None
    return answer


def _ask(address, found):
    from distributed import Client

    try:
        found.append(Client(address, timeout=_PATIENCE, set_as_default=False))
    except Exception as error:
        found.append(error)


def _knock(address):
    """Raise ``InputError`` unless a server listens at ``address``: without one, a dask client waits and warns."""
    found = _ADDRESS.fullmatch(address)
    if not found or not 0 < int(found[2]) < 2**16:
        raise InputError(f"--dask {short(address)}: give the address of a scheduler, such as tcp://localhost:8786")
    try:
        socket.create_connection((found[1].strip("[]"), int(found[2])), timeout=_PATIENCE).close()
    except (OSError, ValueError) as error:
        raise InputError(f"--dask {short(address)}: there is no dask scheduler ({str(error)[:80]})") from None
