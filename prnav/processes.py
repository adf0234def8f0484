"""Worker processes that leave nothing behind: they start deaf to Ctrl-C and end when their parent does.

Worker processes are spawned, never forked: a fork copies the locks of threads that do not exist in the child.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing.reduction import ForkingPickler

from prnav.aliases import Untyped

WATCH_SECONDS = 0.5
"""How often a process that :mod:`multiprocessing` did not start looks whether its parent still lives [s]."""


@contextlib.contextmanager
def deaf_children() -> Iterator[None]:
    """Context in which processes are started that Ctrl-C does not reach: their parent hears it and ends them.

    The signal is held back meanwhile, and children inherit that from their first instruction on. A Ctrl-C that comes
    in between is delivered to this process when the context ends.
    """
    if sys.platform == "win32":
        yield
        return
    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)


def become_worker() -> None:
    """Make this process a worker: Ctrl-C is its parent's affair, and it ends within moments of its parent's end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True, name="prnav-parent").start()


def worker_process(context: Untyped, target: Callable[..., None], *arguments: Untyped) -> Untyped:
    """A process of a multiprocessing ``context``, not started, that calls ``target`` as a worker.

    It watches its parent before it loads the modules that ``target`` and its arguments need.
    """
    return context.Process(target=_begin, args=(_Sealed((target, arguments)),), daemon=True)


def end_processes(processes: list[Untyped]) -> None:
    """Terminate what still runs, and wait until all are gone."""
    for process in processes:
        if process.pid is not None:
            process.terminate()
    for process in processes:
        if process.pid is not None:
            process.join(5.0)
            if process.exitcode is None:
                process.kill()
                process.join()


class _Sealed:
    """What is unpickled only when it is opened."""

    def __init__(self, content: Untyped) -> None:
        self.content = content

    def __reduce__(self) -> tuple[Untyped, tuple[bytes]]:
        return _Sealed, (bytes(ForkingPickler.dumps(self.content)),)

    def open(self) -> Untyped:
        return pickle.loads(self.content)


def _begin(sealed: _Sealed) -> None:
    become_worker()
    target, arguments = sealed.open()
    target(*arguments)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
    else:
        first = os.getppid()
        while os.getppid() == first and first != 1:
            time.sleep(WATCH_SECONDS)
    os._exit(1)
