"""TensorBoard's event files, which a run can do without: what cannot be written is told once."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from prnav.aliases import Array, Untyped


class Board:
    """Context in which scalars and pictures go to TensorBoard, as long as the disk takes them."""

    def __init__(self, folder: Path, step: int, warn: Callable[[str], None]) -> None:
        """Board in ``folder``; what stands there of steps after ``step`` is hidden."""
        self._folder, self._warn = folder, warn
        self._writer: Untyped = None
        self._former: Callable[[Untyped], Untyped] = threading.excepthook
        self._try(lambda: self._open(step))

    def __enter__(self) -> Board:
        self._former, threading.excepthook = threading.excepthook, self._unheard
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._writer is not None:
            self._try(self._writer.close)
        threading.excepthook = self._former

    def add_scalar(self, name: str, value: float, step: int) -> None:
        """Add one number."""
        if self._writer is not None:
            self._try(lambda: self._writer.add_scalar(name, value, step))

    def add_image(self, name: str, picture: Array, step: int, dataformats: str) -> None:
        """Add one picture."""
        if self._writer is not None:
            self._try(lambda: self._writer.add_image(name, picture, step, dataformats=dataformats))

    def _open(self, step: int) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._writer = SummaryWriter(self._folder, purge_step=step)

    def _unheard(self, told: Untyped) -> None:
        """Say nothing of the writer's own thread, whose errors come out in the next call."""
        ours = type(told.thread).__module__.startswith("tensorboard.")
        if not (ours and issubclass(told.exc_type, OSError)):
            self._former(told)

    def _try(self, write: Callable[[], Untyped]) -> None:
        try:
            write()
        except OSError as error:  # its own thread's errors come out here as well
            self._writer = None
            self._warn(f"{self._folder}: TensorBoard's files cannot be written ({error}); training continues without")


class NoBoard:
    """Stands for the board where another worker writes."""

    def add_scalar(self, name: str, value: float, step: int) -> None:
        """Nothing."""

    def add_image(self, name: str, picture: Array, step: int, dataformats: str) -> None:
        """Nothing."""
