"""All textures of a scene in one flat array of texels, with their mip levels.

A flat array takes textures of any size, wraps each one exactly, and is one allocation on whatever device reads it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array

OFFSET, WIDTH, HEIGHT, LEVELS = range(4)
"""Columns of :attr:`TextureAtlas.table`."""


@dataclass(frozen=True, eq=False)
class TextureAtlas:
    """Textures with mip levels; each repeats beyond the unit square.

    Level l of a texture has ``max(1, width >> l) x max(1, height >> l)`` texels, each the exact mean of the area of the
    full texture that it covers. Levels are stored one after another, row by row, the top row first.
    """

    texels: NDArray[np.uint8]  #: RGBA, (T, 4)
    table: NDArray[np.int64]  #: per texture: offset of level 0 in texels, width, height, number of levels, (M, 4)

    @classmethod
    def from_images(cls, images: Sequence[NDArray[np.uint8]]) -> TextureAtlas:
        """Atlas of images (H, W, 3 or 4) uint8; row 0 of the table is a white texel, image i is row i + 1."""
        rgba = [_rgba(image) for image in images]
        return cls.from_stream([image.shape[1::-1] for image in rgba], rgba)

    @classmethod
    def from_stream(cls, sizes: Sequence[tuple[int, ...]], images: Iterable[NDArray[np.uint8]]) -> TextureAtlas:
        """As :meth:`from_images`, of images that come one by one and need not stay in memory.

        Args:
            sizes: width and height of each.
            images: (H, W, 3 or 4) uint8, of these sizes.
        """
        rows: list[tuple[int, int, int, int]] = []
        end = 0
        for width, height in [(1, 1), *sizes]:
            shapes = _level_shapes(height, width)
            rows.append((end, width, height, len(shapes)))
            end += sum(h * w for h, w in shapes)
        texels = np.empty((end, 4), np.uint8)
        texels[0] = 255
        for (offset, width, height, _), image in zip(rows[1:], images, strict=True):
            if image.shape[:2] != (height, width):
                raise ValueError(f"a texture of {width} x {height} texels came as {image.shape}")
            for level in mip_levels(_rgba(image)):
                count = level.shape[0] * level.shape[1]
                texels[offset : offset + count] = level.reshape(-1, 4)
                offset += count
        return cls(texels, np.array(rows, np.int64))

    @property
    def num_textures(self) -> int:
        """Number of textures M, the white one included."""
        return len(self.table)

    def image(self, texture: int, level: int = 0) -> NDArray[np.uint8]:
        """One level of one texture, (h, w, 4), a view."""
        offset, width, height, levels = (int(value) for value in self.table[texture])
        if not 0 <= level < levels:
            raise IndexError(f"texture {texture} has {levels} levels, not level {level}")
        for _ in range(level):
            offset += width * height
            width, height = max(1, width >> 1), max(1, height >> 1)
        return self.texels[offset : offset + width * height].reshape(height, width, 4)

    def to_arrays(self) -> dict[str, Array]:
        """The fields by name."""
        return {"texels": self.texels, "table": self.table}


def mip_levels(image: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """Image (H, W, C) and its smaller copies down to one texel; sides halve, rounded down, at least 1."""
    levels = [image]
    exact = image.astype(np.float32)
    sums: NDArray[np.float64] | None = None
    height, width = image.shape[:2]
    while max(height, width) > 1:
        even = all(side == 1 or side % 2 == 0 for side in (height, width))
        height, width = max(1, height >> 1), max(1, width >> 1)
        if even and sums is None:
            exact = _halve(_halve(exact, 0), 1)
        else:  # texels share texels of the level above: from the full image, once and for all further levels
            if sums is None:
                sums = _running_sums(image.astype(np.float64))
            rows = _stretches(sums, height)
            exact = np.moveaxis(_stretches(_running_sums(np.moveaxis(rows, 1, 0)), width), 0, 1).astype(np.float32)
        levels.append(np.floor(exact + 0.5).astype(np.uint8))
    return levels


def _level_shapes(height: int, width: int) -> list[tuple[int, int]]:
    """Height and width of all levels of a texture."""
    shapes = [(height, width)]
    while max(height, width) > 1:
        height, width = max(1, height >> 1), max(1, width >> 1)
        shapes.append((height, width))
    return shapes


def _halve(image: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """Means of pairs along an axis of even size, or of size 1, which stays."""
    if image.shape[axis] == 1:
        return image
    first = (slice(None),) * axis
    return (image[(*first, slice(0, None, 2))] + image[(*first, slice(1, None, 2))]) * np.float32(0.5)


def _running_sums(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums of the first 0, 1, 2, ... rows, (n + 1, ...)."""
    sums = np.zeros((len(image) + 1, *image.shape[1:]))
    np.cumsum(image, axis=0, out=sums[1:])
    return sums


def _stretches(sums: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Means over ``count`` equal stretches of the rows that were summed, shares of rows at their ends included."""
    size = len(sums) - 1
    row, rest = np.divmod(np.arange(count + 1) * size, count)
    share = (rest / count).reshape(-1, *[1] * (sums.ndim - 1))
    edges = sums[row] + share * (sums[np.minimum(row + 1, size)] - sums[row])
    return np.diff(edges, axis=0) * (count / size)


def _rgba(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] not in (3, 4) or 0 in image.shape:
        raise ValueError(f"a texture must be (H, W, 3 or 4) uint8 and not empty, not {image.shape} {image.dtype}")
    if image.shape[2] == 4:
        return np.ascontiguousarray(image)
    opaque = np.full((*image.shape[:2], 1), 255, np.uint8)
    return np.concatenate([image, opaque], axis=2)
