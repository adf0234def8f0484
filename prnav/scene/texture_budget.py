"""How fine the textures of a scene are kept: a longest side, and a number of texels for all of them together.

A receptor sees means over patches, so detail goes first where nobody could tell: in the texture with the most texels on
a square metre of surface. Every texel that is left is the exact mean of those it replaces.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.errors import SceneError
from prnav.scene.atlas import TextureAtlas
from prnav.scene.images import EncodedImage, reduction

MAX_TEXTURE_SIZE = 1024
"""Default of the longest side that a texture keeps [texels]; finer detail than a sensor of some hundred pixels sees."""

TEXTURE_BUDGET = 1 << 26
"""Default of the texels that a scene's textures keep together: 67 million, 358 MB with mip levels."""

FREE_PIXELS = 1 << 28
"""Pixels that the images of any one scene may have together: 268 million, a few seconds of decoding."""

PIXELS_PER_BYTE = 512
"""Pixels that they may have besides, for each of their bytes; a drawing of few colours has some hundred."""


@dataclass(frozen=True)
class TextureLimits:
    """How much of a file's textures is kept.

    Attributes:
        max_texture_size: longest side of one texture [texels].
        texture_budget: texels of all textures together, mip levels not counted.
    """

    max_texture_size: int = MAX_TEXTURE_SIZE
    texture_budget: int = TEXTURE_BUDGET


def build_atlas(
    images: Sequence[EncodedImage],
    limits: TextureLimits,
    vertices: NDArray[np.float32],
    uvs: NDArray[np.float32],
    faces: NDArray[np.int32],
    face_texture: NDArray[np.int32],
) -> TextureAtlas:
    """Atlas of a scene's images within the limits; image i is texture i + 1.

    Images are decoded one after another, so that no more than one stands in memory besides the atlas.
    """
    _check_pixels(images)
    factors = [reduction(image.size, limits.max_texture_size) for image in images]
    if sum(_texels(image, factor) for image, factor in zip(images, factors, strict=True)) > limits.texture_budget:
        surface, repeats = _areas(len(images), vertices, uvs, faces, face_texture)
        factors = budget_factors([image.size for image in images], factors, surface, repeats, limits.texture_budget)
    sizes = [_reduced(image.size, factor) for image, factor in zip(images, factors, strict=True)]
    return TextureAtlas.from_stream(sizes, (image.decode(f) for image, f in zip(images, factors, strict=True)))


def _check_pixels(images: Sequence[EncodedImage]) -> None:
    """Refuse images that are many times bigger than their bytes can account for, before any is decoded.

    Raises:
        SceneError: all together have too many pixels.
    """
    pixels, size = 0, 0
    for image in images:
        width, height = image.size
        pixels, size = pixels + width * height, size + len(image.data)
        if pixels > (most := FREE_PIXELS + PIXELS_PER_BYTE * size):
            raise SceneError(
                f"{image.where} and the images before it have {pixels} pixels in {size} bytes; at most {most} are "
                f"decoded: shrink them"
            )


def budget_factors(
    sizes: Sequence[tuple[int, int]],
    factors: Sequence[int],
    surface: NDArray[np.float64],
    repeats: NDArray[np.float64],
    budget: int,
) -> list[int]:
    """Powers of two to shrink textures by, so that together they have at most ``budget`` texels.

    The texture with the most texels per square metre is halved, again and again; of equals, the one with more texels,
    then the first. Where every texture is down to one texel, that is what it stays at.

    Args:
        sizes: width and height of each.
        factors: what each is to be shrunk by in any case.
        surface: area that each covers [m2], (M,).
        repeats: area that each covers in its own units: 1 where it is seen once, (M,).
        budget: texels in all.
    """
    result = list(factors)
    texels = [_count(size, factor) for size, factor in zip(sizes, result, strict=True)]

    def place(k: int) -> tuple[float, int, int]:
        density = texels[k] * repeats[k] / surface[k] if surface[k] > 0 else np.inf
        return (-density, -texels[k], k)

    queue = [place(k) for k in range(len(sizes)) if texels[k] > 1]
    heapq.heapify(queue)
    total = sum(texels)
    while total > budget and queue:
        k = heapq.heappop(queue)[2]
        result[k] *= 2
        total -= texels[k]
        texels[k] = _count(sizes[k], result[k])
        total += texels[k]
        if texels[k] > 1:
            heapq.heappush(queue, place(k))
    return result


def _areas(
    count: int,
    vertices: NDArray[np.float32],
    uvs: NDArray[np.float32],
    faces: NDArray[np.int32],
    face_texture: NDArray[np.int32],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Area of the surface [m2] and of the texture plane that each texture but the white one covers, (count,) each."""
    surface, plane = np.zeros(count + 1), np.zeros(count + 1)
    with np.errstate(all="ignore"):  # what is not finite is refused with the mesh
        for start in range(0, len(faces), 1 << 18):  # in pieces, for the memory's sake
            rows = faces[start : start + (1 << 18)]
            texture = face_texture[start : start + (1 << 18)]
            a, b, c = (vertices[rows[:, k]].astype(np.float64) for k in range(3))
            surface += np.bincount(texture, np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0, count + 1)
            a, b, c = (uvs[rows[:, k]].astype(np.float64) for k in range(3))
            (ux, uy), (vx, vy) = (b - a).T, (c - a).T
            plane += np.bincount(texture, np.abs(ux * vy - uy * vx) / 2.0, count + 1)
    return np.nan_to_num(surface[1:]), np.nan_to_num(plane[1:])


def _reduced(size: tuple[int, int], factor: int) -> tuple[int, int]:
    return -(-size[0] // factor), -(-size[1] // factor)


def _count(size: tuple[int, int], factor: int) -> int:
    width, height = _reduced(size, factor)
    return width * height


def _texels(image: EncodedImage, factor: int) -> int:
    return _count(image.size, factor)
