"""Trials that several processes on one study share: each is held by a lock that goes with the process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from prnav.locks import FolderLock, held


class TrialClaims:
    """Claims on the trials of a study by their numbers, one locked file each in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        """Claims in ``folder``, which is made where it is missing."""
        self._folder = folder
        self._held: dict[int, FolderLock] = {}
        folder.mkdir(parents=True, exist_ok=True)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Context in which no other process takes trials."""
        with held(self._folder, wait=True):
            yield

    def take(self, number: int) -> bool:
        """Claim a trial; False where it is held by another worker."""
        lock = FolderLock(self._folder, str(number))
        if not lock.acquire():
            return False
        self._held[number] = lock
        return True

    def let_go(self, number: int) -> None:
        """Give a trial back, whether it is done or not."""
        lock = self._held.pop(number)
        lock.path.unlink(missing_ok=True)
        lock.release()

    def close(self) -> None:
        """Give all back, and leave nothing where no other process is at the study."""
        for number in list(self._held):
            self.let_go(number)
        with suppress(OSError):
            if not any(path.name != ".claim" for path in self._folder.iterdir()):
                (self._folder / ".claim").unlink(missing_ok=True)
                self._folder.rmdir()
