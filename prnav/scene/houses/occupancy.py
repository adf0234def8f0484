"""Which floor cells of a room are taken, and whether one can still walk between its doors.

A grid is one Python integer with a bit per cell of 50 mm, so that growing, filling and comparing whole rooms are a few
exact integer operations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.scene.houses.shapes import Rect

CELL = 50
WALK_RADIUS = 5
"""Cells between the middle of a walkway and the next obstacle: walkways are 0.5 m wide."""
AGENT_RADIUS = 3
"""Cells a body keeps from obstacles: 0.1 m and a margin."""
MAX_POCKET = 60
"""Largest number of cells that a body fits into but cannot walk to."""
_PAD = 6


@dataclass(frozen=True)
class Doorway:
    """Floor in front of a door: the place a body stands, and the rectangle to keep free."""

    landing: tuple[int, int]
    keep: Rect


class Occupancy:
    """The floor of one room."""

    def __init__(self, inner: Rect, doorways: list[Doorway]) -> None:
        self.inner = inner
        self.columns, self.rows = inner.width // CELL, inner.depth // CELL
        self._stride = self.columns + 2 * _PAD
        self._inside = self.mask(inner)
        self.taken = 0
        self._kept = 0
        for doorway in doorways:
            self._kept |= self.mask(doorway.keep)
        self._landings = [self._bit(*doorway.landing) for doorway in doorways]

    def mask(self, rect: Rect) -> int:
        """Cells that a rectangle touches."""
        x0 = max(0, (rect.x0 - self.inner.x0) // CELL)
        z0 = max(0, (rect.z0 - self.inner.z0) // CELL)
        x1 = min(self.columns, -((self.inner.x0 - rect.x1) // CELL))
        z1 = min(self.rows, -((self.inner.z0 - rect.z1) // CELL))
        if x1 <= x0 or z1 <= z0:
            return 0
        row = ((1 << (x1 - x0)) - 1) << (x0 + _PAD)
        result = 0
        for z in range(z0 + _PAD, z1 + _PAD):
            result |= row << (z * self._stride)
        return result

    def _bit(self, x: int, z: int) -> int:
        column = min(max((x - self.inner.x0) // CELL, WALK_RADIUS), self.columns - 1 - WALK_RADIUS)
        row = min(max((z - self.inner.z0) // CELL, WALK_RADIUS), self.rows - 1 - WALK_RADIUS)
        return 1 << ((row + _PAD) * self._stride + column + _PAD)

    def _grow(self, cells: int, radius: int) -> int:
        """Cells within ``radius`` in both directions (a square)."""
        for unit in (1, self._stride):
            for _ in range(radius):
                cells |= (cells << unit) | (cells >> unit)
        return cells

    def _free(self, taken: int, radius: int) -> int:
        everything = (1 << (self._stride * (self.rows + 2 * _PAD))) - 1
        return self._inside & ~self._grow((everything & ~self._inside) | taken, radius)

    def _fill(self, start: int, free: int) -> int:
        """Cells of ``free`` joined to ``start``."""
        stride, seen, edge = self._stride, start & free, start & free
        while edge:
            edge = ((edge << 1) | (edge >> 1) | (edge << stride) | (edge >> stride)) & free & ~seen
            seen |= edge
        return seen

    def is_walkable(self, taken: int) -> bool:
        """Whether all doors stay joined by 0.5 m walkways, and no floor of any size is cut off."""
        wide = self._free(taken, WALK_RADIUS)
        if any(not landing & wide for landing in self._landings):
            return False
        start = self._landings[0] if self._landings else 0
        seen = self._fill(start, wide)
        if any(not landing & seen for landing in self._landings):
            return False
        narrow = self._free(taken, AGENT_RADIUS)
        return (narrow & ~self._fill(start, narrow)).bit_count() <= MAX_POCKET

    def overlaps(self, rect: Rect) -> bool:
        """Whether a rectangle leaves the room, or touches furniture or a door's floor."""
        inner = self.inner
        if rect.x0 < inner.x0 or rect.z0 < inner.z0 or rect.x1 > inner.x1 or rect.z1 > inner.z1:
            return True
        return bool(self.mask(rect) & (self.taken | self._kept))

    def fits(self, *rects: Rect) -> bool:
        """Whether a piece that stands on these rectangles can be put down."""
        if any(self.overlaps(rect) for rect in rects):
            return False
        taken = self.taken
        for rect in rects:
            taken |= self.mask(rect)
        return self.is_walkable(taken)

    def take(self, *rects: Rect) -> None:
        """Put down a piece."""
        for rect in rects:
            self.taken |= self.mask(rect)

    def keep(self, rect: Rect) -> None:
        """Leave a rectangle free of furniture from now on (people walk there)."""
        self._kept |= self.mask(rect)

    def cover(self) -> NDArray[np.float64]:
        """Share of taken cells in a square around each cell, shape (columns, rows)."""
        bits = np.zeros((self.columns, self.rows), dtype=np.int64)
        row_mask = (1 << self.columns) - 1
        for z in range(self.rows):
            row = (self.taken >> ((z + _PAD) * self._stride + _PAD)) & row_mask
            bits[:, z] = [(row >> x) & 1 for x in range(self.columns)]
        radius = 4
        total = np.pad(bits, radius + 1).cumsum(axis=0).cumsum(axis=1)
        w = 2 * radius + 1
        window = total[w:, w:] - total[:-w, w:] - total[w:, :-w] + total[:-w, :-w]
        return window[: self.columns, : self.rows] / (w * w)
