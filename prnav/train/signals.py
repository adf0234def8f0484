"""Ending a run politely: a signal asks, the loop finishes its update, saves, and returns."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType, TracebackType

from prnav.aliases import Untyped

SIGNALS: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM)
if sys.platform != "win32":
    SIGNALS += (signal.SIGUSR1,)


class StopRequest:
    """Context in which SIGINT, SIGTERM and SIGUSR1 set a flag instead of ending the process.

    A second Ctrl-C interrupts at once: the last checkpoint stands, since checkpoints are written whole or not at all.
    Outside the main thread, where Python lets no one handle signals, nothing is asked and nothing is caught.
    """

    def __init__(self) -> None:
        self.name: str | None = None
        """Name of the signal that asked to stop, or None."""
        self._former: dict[int, Untyped] = {}

    def __bool__(self) -> bool:
        return self.name is not None

    def __enter__(self) -> StopRequest:
        if threading.current_thread() is threading.main_thread():
            self._former = {number: signal.signal(number, self._handle) for number in SIGNALS}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._former.items():
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.name is not None and number == signal.SIGINT:
            raise KeyboardInterrupt
        self.name = signal.Signals(number).name
