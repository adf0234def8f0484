"""Work that several processes share: a folder is held by a lock, which the system lets go of when its holder dies."""

from __future__ import annotations

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
        """Claim a trial; False where another process is at it."""
        return self._lock(number, wait=False)

    def let_go(self, number: int) -> None:
        """Give a trial back, whether it is done or not."""
        self._unlock(number)

    def close(self) -> None:
        """Give all back."""
        self._file.close()

    def _lock(self, byte: int, wait: bool) -> bool:
        if sys.platform == "win32":
            return True
        import fcntl

        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)
        except OSError:
            return False
        return True

    def _unlock(self, byte: int) -> None:
        if sys.platform != "win32":
            import fcntl

            fcntl.lockf(self._file, fcntl.LOCK_UN, 1, byte)


_TABLE = 1 << 40  #: byte that is locked while trials are taken


@contextmanager
def held(place: Path, wait: bool = False) -> Iterator[bool]:
    """Whether this process holds the folder, until the block ends.

    Args:
        place: the folder; made where it is missing.
        wait: wait for another process to let go of it, and hold it then.
    """
    place.mkdir(parents=True, exist_ok=True)
    with open(place / ".claim", "w") as lock:
        if sys.platform == "win32":  # no advisory locks: one process at a time
            yield True
            return
        import fcntl

        try:
            fcntl.flock(lock, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            yield False
            return
        yield True
