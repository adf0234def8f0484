"""Work that several processes share: a folder is held by a lock, which the system lets go of when its holder dies."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO


class TrialClaims:
    """Which trials of a study somebody is at: a locked file each, whose lock goes with its holder."""

    def __init__(self, folder: Path) -> None:
        """Claims in a folder beside the study; made where it is missing."""
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._held: dict[int, IO[str]] = {}

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Context in which nobody else takes trials."""
        with open(self._folder / ".all", "w") as lock:
            _lock(lock, wait=True)
            yield

    def take(self, number: int) -> bool:
        """Claim a trial; False where somebody is at it."""
        file = open(self._folder / str(number), "w")  # noqa: SIM115 (held until it is let go)
        if not _lock(file, wait=False):
            file.close()
            return False
        self._held[number] = file
        return True

    def let_go(self, number: int) -> None:
        """Give a trial back, whether it is done or not."""
        (self._folder / str(number)).unlink(missing_ok=True)
        self._held.pop(number).close()

    def close(self) -> None:
        """Give all back, and leave nothing where nobody else is at the study."""
        for number in list(self._held):
            self.let_go(number)
        with suppress(OSError):
            if not any(path.name != ".all" for path in self._folder.iterdir()):
                (self._folder / ".all").unlink(missing_ok=True)
                self._folder.rmdir()


def _lock(file: IO[str], wait: bool) -> bool:
    if sys.platform == "win32":  # no advisory locks: one process at a time
        return True
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


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
