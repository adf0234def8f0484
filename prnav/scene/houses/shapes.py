"""Integer rectangles and frames on the floor plan. Lengths are millimetres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

SIDES = (0, 1, 2, 3)
"""Sides of a room: 0 at low z, 1 at high x, 2 at high z, 3 at low x."""


@dataclass(frozen=True)
class Rect:
    """Axis-aligned rectangle on the ground plane."""

    x0: int
    z0: int
    x1: int
    z1: int

    @property
    def width(self) -> int:
        """Extent along x."""
        return self.x1 - self.x0

    @property
    def depth(self) -> int:
        """Extent along z."""
        return self.z1 - self.z0

    @property
    def area(self) -> int:
        """Area in square millimetres."""
        return self.width * self.depth

    def inset(self, margin: int) -> Rect:
        """The rectangle shrunk by ``margin`` on all sides."""
        return Rect(self.x0 + margin, self.z0 + margin, self.x1 - margin, self.z1 - margin)

    def contains(self, x: int, z: int) -> bool:
        """Whether a point lies strictly inside."""
        return self.x0 < x < self.x1 and self.z0 < z < self.z1

    def length(self, side: int) -> int:
        """Length of a side."""
        return self.width if side % 2 == 0 else self.depth

    def frame(self, side: int) -> Frame:
        """Frame of a side: x runs along it, z points into the rectangle, y up."""
        corner = ((self.x0, self.z0), (self.x1, self.z0), (self.x1, self.z1), (self.x0, self.z1))[side]
        return Frame(corner[0], 0, corner[1], side)

    def along(self, side: int, low: int, high: int) -> tuple[int, int]:
        """An interval of world coordinates along a side, in that side's frame."""
        if side == 0:
            return low - self.x0, high - self.x0
        if side == 1:
            return low - self.z0, high - self.z0
        if side == 2:
            return self.x1 - high, self.x1 - low
        return self.z1 - high, self.z1 - low


class Frame(NamedTuple):
    """A position and a number of quarter turns about y (each takes local z to world -x, x to z)."""

    x: int
    y: int
    z: int
    turns: int

    def point(self, x: int, y: int, z: int) -> tuple[int, int, int]:
        """World coordinates of a local point."""
        turns = self.turns & 3
        if turns == 0:
            return self.x + x, self.y + y, self.z + z
        if turns == 1:
            return self.x - z, self.y + y, self.z + x
        if turns == 2:
            return self.x - x, self.y + y, self.z - z
        return self.x + z, self.y + y, self.z - x

    def at(self, x: int, y: int, z: int, turns: int = 0) -> Frame:
        """A frame inside this one."""
        return Frame(*self.point(x, y, z), (self.turns + turns) & 3)

    def rect(self, x0: int, z0: int, x1: int, z1: int) -> Rect:
        """World rectangle of a local one."""
        ax, _, az = self.point(x0, 0, z0)
        bx, _, bz = self.point(x1, 0, z1)
        return Rect(min(ax, bx), min(az, bz), max(ax, bx), max(az, bz))
