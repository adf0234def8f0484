"""Arrays in ``.npz`` files, read like a stranger's: sizes are checked before anything is allocated.

An archive of a megabyte can hold gigabytes of zeros, and a header can promise more than there is. What is read has
been compared with the archive's own list of sizes and with a limit first. Pickles are never read.
"""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.lib import format as npy

from prnav.aliases import Array, Untyped

Arrays = dict[str, Array]

FREE_BYTES, RATIO = 64 << 20, 100
"""An archive may unpack to 64 MB, and to a hundred times its size where that is more."""

BROKEN = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    TypeError,
    SyntaxError,
    IndexError,
    RuntimeError,  # an encrypted archive; NotImplementedError, a compression that is not known
    OverflowError,
    MemoryError,
    struct.error,
    zlib.error,
    zipfile.BadZipFile,
    tokenize.TokenError,
)
"""What reading a damaged archive raises."""


@dataclass(frozen=True)
class Like:
    """What an array must be: kinds of type as NumPy's letters ("f", "iu", "b", "U"), dimensions, finite or not."""

    kinds: str
    ndim: int
    finite: bool = True

    def check(self, name: str, array: Array) -> None:
        """Raise a ``ValueError`` for an array that is of another kind."""
        if array.dtype.kind not in self.kinds or array.ndim != self.ndim:
            raise ValueError(
                f"{name!r} is of type {array.dtype} with {array.ndim} dimensions; valid: kind {self.kinds}, {self.ndim}"
            )
        if self.finite and array.dtype.kind == "f" and not np.isfinite(array).all():
            raise ValueError(f"{name!r} is not finite")


def read_arrays(path: str | Path, need: Mapping[str, Like] | None = None, limited: bool = True) -> Arrays:
    """The arrays of an archive by name.

    Args:
        path: the file.
        need: what must be there, and how; None takes all that is there.
        limited: whether to hold the unpacked size to the file's; an archive of ours that may be as empty as it likes
            is read without.

    Raises:
        One of :data:`BROKEN`: the file is missing or damaged, unpacks to too much, or lacks what is needed.
    """
    with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
        size = file.seek(0, 2)
        total = sum(entry.file_size for entry in archive.infolist())
        if limited and total > max(FREE_BYTES, RATIO * size):
            raise ValueError(f"it unpacks to {total} bytes, which its {size} bytes cannot mean")
        names = {entry.filename.removesuffix(".npy"): entry for entry in archive.infolist()}
        result: Arrays = {}
        for name in names if need is None else need:
            if name not in names:
                raise ValueError(f"it lacks {name!r}")
            with archive.open(names[name]) as member:
                result[name] = _read(member, name, names[name].file_size)
    for name, like in (need or {}).items():
        like.check(name, result[name])
    return result


def check_lengths(**groups: tuple[int, Mapping[str, Array]]) -> None:
    """Hold arrays to the lengths that others say they have: per group the rows, and the arrays by name.

    Raises:
        ValueError: one has another number of rows.
    """
    for group, (rows, arrays) in groups.items():
        for name, array in arrays.items():
            if len(array) != rows:
                raise ValueError(f"{name!r} has {len(array)} rows where there are {rows} {group}")


def _read(member: Untyped, name: str, size: int) -> Array:
    stream: BinaryIO = member
    version = npy.read_magic(stream)
    if version == (1, 0):
        shape, fortran, dtype = npy.read_array_header_1_0(stream)
    elif version == (2, 0):
        shape, fortran, dtype = npy.read_array_header_2_0(stream)
    else:
        raise ValueError(f"{name!r} is of .npy version {version}")
    if dtype.hasobject or dtype.names is not None:
        raise ValueError(f"{name!r} is of type {dtype}, which is not read")
    count = int(np.prod(shape, dtype=object)) if shape else 1
    left = size - member.tell()
    if min(shape, default=0) < 0 or count * dtype.itemsize != left:
        raise ValueError(f"{name!r} promises {count} x {dtype.itemsize} bytes where there are {left}")
    array = np.frombuffer(bytearray(member.read()), dtype) if count and dtype.itemsize else np.zeros(count, dtype)
    return array.reshape(shape, order="F" if fortran else "C")
