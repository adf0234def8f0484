"""Files written whole or not at all, and paths that stay where they belong."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from prnav.errors import PrnavError

_UMASK = os.umask(0)
os.umask(_UMASK)  # it can only be asked for by changing it, which is no business of threads


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` which replaces it when the block ends without an error.

    The data is flushed to disk before the rename, so that a crash leaves the old file or the new one, never a part.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    beginning, end = f".{_short(target.name)}.", ".tmp" + target.suffix[:20]
    handle, name = tempfile.mkstemp(prefix=beginning, suffix=end, dir=target.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        temporary.chmod(0o666 & ~_UMASK)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def read_regular(path: str | os.PathLike[str], most: int | None = None) -> bytes:
    """Content of a file that is one: no pipe that never ends, no device.

    Raises:
        OSError: it is missing, not a regular file, or has more than ``most`` bytes.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with open(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is a device or a pipe, not a file", os.fspath(path))
        if most is not None and status.st_size > most:
            raise OSError(errno.EFBIG, f"it has {status.st_size} bytes where at most {most} are read", os.fspath(path))
        return file.read()


def remove_parts(folder: Path) -> None:
    """Remove what a killed process has left of files in a folder that this process alone writes to."""
    for part in folder.glob(".*.tmp*"):
        part.unlink(missing_ok=True)


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a file that cannot be written, before the work that is to end in it.

    Raises:
        OSError: a folder stands there, its folder cannot be made, or takes no files.
    """
    target = Path(path)
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if len(os.fsencode(target.name)) > 255:
        raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG), os.fspath(path))
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=target.parent):
        pass


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write ``data`` atomically."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write ``text`` atomically as UTF-8."""
    write_bytes(path, text.encode())


def _short(name: str) -> str:
    """A name's beginning, so that what is added to it still makes a name that file systems take."""
    return os.fsdecode(os.fsencode(name)[:180]) if len(os.fsencode(name)) > 180 else name


def resolve_inside(root: str | os.PathLike[str], relative: str, error: type[PrnavError] = PrnavError) -> Path:
    """Path of ``relative`` (found inside a data file) under ``root``, symbolic links included.

    Raises:
        error: the path is absolute or leaves the root.
    """
    base = Path(root).resolve()
    if "\0" in relative:
        raise error(f"path {relative!r} holds a zero byte; valid: a path relative to {base}")
    path = (base / relative).resolve()
    if Path(relative).is_absolute() or not path.is_relative_to(base):
        raise error(f"path {relative!r} leaves its data root {base}; valid: a path relative to that folder")
    return path


def sha256_file(path: str | os.PathLike[str]) -> str:
    """SHA-256 of a file's bytes, in hex."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
