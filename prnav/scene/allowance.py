"""How much a mesh file may ask for, measured by its own size: what a few bytes cannot hold, they cannot promise.

Formats let a file name the same numbers many times over, or promise numbers without giving them. Each kind of thing
has an allowance: an amount that any file may have, and more for every byte that the file brings.
"""

from __future__ import annotations

from typing import NamedTuple

from prnav.errors import SceneError


class _Share(NamedTuple):
    free: int  #: what any file may have
    per_byte: float  #: and for each of its bytes
    noun: str  #: what errors call it


ALLOWANCES = {
    "nodes": _Share(100_000, 0.0, "nodes"),
    "primitives": _Share(100_000, 0.0, "primitives"),
    "empty": _Share(1 << 16, 1.0, "accessor elements without bytes of their own"),
    "indices": _Share(1 << 20, 1.0, "vertex indices, primitives that share them counted one by one"),
    "packed": _Share(1 << 20, 64.0, "vertex indices in compressed meshes"),
    "vertices": _Share(1 << 26, 64.0, "vertices, primitives that share them counted one by one"),
    "triangles": _Share(4_000_000, 4.0, "triangles, instances counted one by one"),
}
"""What is counted. No file without compression has more than one index per byte unless primitives share them."""


class Allowance:
    """Counts what one file asks for."""

    def __init__(self, where: str, size: int) -> None:
        """Of a file of ``size`` bytes, side files included, that errors call ``where``."""
        self._where = where
        self._size = size
        self._spent = dict.fromkeys(ALLOWANCES, 0)

    def spend(self, kind: str, amount: int) -> None:
        """Count ``amount`` more of a kind of :data:`ALLOWANCES`, before anything of that size is allocated.

        Raises:
            SceneError: that is more than the file's size allows.
        """
        free, per_byte, noun = ALLOWANCES[kind]
        most = free + int(per_byte * self._size)
        self._spent[kind] += amount
        if self._spent[kind] > most:
            raise SceneError(
                f"{self._where}: it asks for {self._spent[kind]} {noun}; a file of {self._size} bytes may have "
                f"{most}: export it with each part stored once"
            )
