"""Trials of a study that several processes work on: each is held by a lock, which goes with its process."""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class TrialClaims:
    """Which trials of a study somebody is at: a lock on one byte of a file each, which goes with the process."""

    def __init__(self, path: Path) -> None:
        """Claims in a file beside the study; made where it is missing."""
        self._file = open(path, "a+b")  # noqa: SIM115 (as long as the study is worked on; closing drops all locks)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Context in which no other process takes trials."""
        self._lock(_TABLE, wait=True)
        try:
            yield
        finally:
            self._unlock(_TABLE)

    def take(self, number: int) -> bool:
        """Claim a trial; False where it is held by another worker."""
        return self._lock(number, wait=False)

    def let_go(self, number: int) -> None:
        """Give a trial back, whether it is done or not."""
        self._unlock(number)

    def close(self) -> None:
        """Give all back."""
        self._file.close()

    def _lock(self, byte: int, wait: bool) -> bool:
        try:
            self._set(_LOCK, byte, wait)
        except OSError:
            return False
        return True

    def _unlock(self, byte: int) -> None:
        self._set(_UNLOCK, byte, False)

    def _set(self, kind: int, byte: int, wait: bool) -> None:
        """Set a lock of the open file, or of the process where the system has no other; nothing on Windows."""
        if sys.platform == "win32":
            return
        import fcntl

        if sys.platform == "linux":
            request = struct.pack("hhqqi4x", fcntl.F_WRLCK if kind == _LOCK else fcntl.F_UNLCK, 0, byte, 1, 0)
            fcntl.fcntl(self._file, fcntl.F_OFD_SETLKW if wait else fcntl.F_OFD_SETLK, request)
        else:
            held = fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB
            fcntl.lockf(self._file, held if kind == _LOCK else fcntl.LOCK_UN, 1, byte)


_LOCK, _UNLOCK = 1, 2
_TABLE = 1 << 40  #: byte that is locked while trials are taken
