"""The rays of a view in the order in which they are best traced: neighbours in the picture after one another."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.render.sampling import Sampling

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RayTable:
    """Rays of a view with grid x grid patches, R of them, along a Morton curve over the picture.

    Eight rays that come together lie in about 2 x 4 neighbouring pixels, and what the tracer has just visited is at
    hand for the next ones.
    """

    a: Float64
    """Right coordinate on the image plane, -1 to 1, (R,)."""
    b: Float64
    """Up coordinate on the image plane, -1 to 1, (R,)."""
    patch: NDArray[np.int32]
    """Patch of each ray, row by row from the top left, (R,)."""
    weight: NDArray[np.float32]
    """Weight of each ray in its patch's mean, 1 in the mean, (R,)."""

    @property
    def fields(self) -> tuple[Float64, Float64, NDArray[np.int32], NDArray[np.float32]]:
        """All four, as compiled loops take them."""
        return self.a, self.b, self.patch, self.weight

    def __len__(self) -> int:
        return len(self.a)


@functools.lru_cache(maxsize=64)
def ray_table(grid: int, sampling: Sampling) -> RayTable:
    """The rays of :func:`prnav.render.rays.view_rays`, in the order of tracing."""
    offsets, count = sampling.offsets, sampling.count
    row, column = np.divmod(np.arange(grid * grid), grid)
    x = (column[:, None] + offsets[:, 0]).ravel()
    y = (row[:, None] + offsets[:, 1]).ravel()
    order = np.argsort(_morton(x * sampling.side, y * sampling.side), kind="stable")
    step = 2.0 / grid
    return RayTable(
        a=(x * step - 1.0)[order],
        b=(1.0 - y * step)[order],
        patch=np.repeat(np.arange(grid * grid, dtype=np.int32), count)[order],
        weight=np.tile(sampling.weights.astype(np.float32), grid * grid)[order],
    )


def _morton(x: Float64, y: Float64) -> NDArray[np.uint64]:
    """Place along the curve of the pixel that a point lies in: the bits of its row and column, interleaved."""
    key = np.zeros(len(x), dtype=np.uint64)
    for bit in range(24):
        for shift, coordinate in ((0, x), (1, y)):
            key |= (coordinate.astype(np.uint64) >> np.uint64(bit) & np.uint64(1)) << np.uint64(2 * bit + shift)
    return key
