"""Work that several processes share: a folder is held by a lock, which the system lets go of when its holder dies."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


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
