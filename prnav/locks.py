"""One lock for a folder that several processes share: the system lets go of it when its holder dies.

Where the system has no advisory locks (Windows), the lock is always had: one process at a time is the user's affair.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import IO

from prnav.errors import PrnavError


class FolderLock:
    """A lock on a folder, taken by :meth:`acquire` or as a context manager that yields whether it is held."""

    def __init__(self, folder: str | Path, name: str = ".lock") -> None:
        """Lock of ``folder`` that is not held yet, by a file of this ``name`` in it."""
        self.path = Path(folder) / name
        self._file: IO[str] | None = None

    def acquire(self, wait: bool = False) -> bool:
        """Whether this process holds the folder now; the folder is made where it is missing.

        Args:
            wait: wait for another process to let go of it.
        """
        if self._file is not None:
            return True
        self.path.parent.mkdir(parents=True, exist_ok=True)
        file = open(self.path, "a")  # noqa: SIM115 (closed in release)
        if sys.platform != "win32":
            import fcntl

            try:
                fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
            except (BlockingIOError, PermissionError):  # which of them depends on the system
                file.close()
                return False
            except BaseException:
                file.close()
                raise
        self._file = file
        return True

    def release(self) -> None:
        """Let other processes have the folder; nothing where it is not held."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


@contextmanager
def held(folder: Path, wait: bool = False) -> Iterator[bool]:
    """Whether this process holds a folder of work that several share, until the block ends.

    Args:
        folder: made where it is missing.
        wait: wait for another process to let go of it, and hold it then.
    """
    lock = FolderLock(folder, ".claim")
    try:
        yield lock.acquire(wait)
    finally:
        lock.release()


@contextmanager
def held_folder(folder: Path, error: type[PrnavError], message: str) -> Iterator[None]:
    """Hold a folder against other processes until the block ends.

    Raises:
        error: another process holds it; with this message.
    """
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    lock = FolderLock(folder)
    if not lock.acquire():
        raise error(message)
    try:
        yield
    except BaseException:
        if made and not any(path.name != ".lock" for path in folder.iterdir()):
            (folder / ".lock").unlink(missing_ok=True)
            for place in made:  # nothing came of it: leave nothing
                with suppress(OSError):
                    place.rmdir()
        raise
    finally:
        lock.release()
