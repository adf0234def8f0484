"""Textures that do not simply repeat: mirrored, ended at their border, or with levels of their own.

Everything that renders repeats textures. So a mirrored one becomes a picture of twice the size that repeats, and of
triangles under one that is clamped, the pieces beyond its border look up the border's texel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.scene.images import EncodedImage, reduced_texels
from prnav.scene.parts import Part, Textures

MODES = ("repeat", "clamp", "mirror")


class Wrap(NamedTuple):
    """How a texture goes on beyond its border to the sides (u) and up and down (v); each one of :data:`MODES`."""

    u: str = "repeat"
    v: str = "repeat"


REPEAT, CLAMP = Wrap(), Wrap("clamp", "clamp")


@dataclass(frozen=True, eq=False)
class AlteredImage(EncodedImage):
    """A picture whose texels are changed as it is decoded.

    Attributes:
        mirror: whether a mirrored copy is put to its right, and under it.
        levels: added to texels 0..1, and the factor on them before.
    """

    mirror: tuple[bool, bool] = (False, False)
    levels: tuple[float, float] = (0.0, 1.0)

    @property
    def alteration(self) -> bytes:
        """Tells pictures with the same data apart."""
        return repr((self.mirror, self.levels)).encode()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, the mirrored copies included."""
        width, height = EncodedImage(self.data, self.where).size
        return width * (1 + self.mirror[0]), height * (1 + self.mirror[1])

    def decode(self, factor: int = 1) -> NDArray[np.uint8]:
        """See :meth:`EncodedImage.decode`."""
        texels = EncodedImage(self.data, self.where).decode()
        base, gain = self.levels
        if (base, gain) != (0.0, 1.0):
            texels = texels.copy()
            texels[..., :3] = np.floor(np.clip(texels[..., :3] * gain + 255.0 * base, 0.0, 255.0) + 0.5)
        if self.mirror[0]:
            texels = np.concatenate([texels, texels[:, ::-1]], axis=1)
        if self.mirror[1]:
            texels = np.concatenate([texels, texels[::-1]], axis=0)
        return reduced_texels(texels, self.size, factor)


def wrap_part(part: Part, wrap: Wrap, textures: Textures) -> Part:
    """A part that looks under a repeated texture as it does under one that wraps otherwise."""
    if wrap == REPEAT or part.uvs is None or not part.texture:
        return part
    uvs = part.uvs
    if not np.isfinite(uvs).all() or ((uvs >= 0.0) & (uvs <= 1.0)).all():
        return part  # what is not finite is refused with the mesh
    mirror = wrap.u == "mirror", wrap.v == "mirror"
    if any(mirror):
        image = textures.images[part.texture - 1]
        levels = image.levels if isinstance(image, AlteredImage) else (0.0, 1.0)
        texture = textures.add(AlteredImage(image.data, image.where, mirror, levels))
        halved = uvs * np.array([0.5 if both else 1.0 for both in mirror], np.float32)
        part = Part(part.vertices, part.faces, halved, part.colors, texture)
    sides = [axis for axis, mode in enumerate(wrap) if mode == "clamp"]
    return _clamped(part, sides, textures.images[part.texture - 1].size) if sides else part


def _clamped(part: Part, sides: list[int], size: tuple[int, int]) -> Part:
    """Triangles cut along the texture's border; those beyond it look up the middle of the border's texels."""
    assert part.uvs is not None
    rows = part.faces.ravel()
    colors = np.broadcast_to(part.colors, (len(part.vertices), 3))[rows]
    corners = np.concatenate([part.vertices[rows], part.uvs[rows], colors], axis=1, dtype=np.float64).reshape(-1, 3, 8)
    for axis in sides:
        for border in (0.0, 1.0):
            corners = _cut(corners, 3 + axis, border)
        middle = corners[:, :, 3 + axis].mean(axis=1)
        inset = 0.5 / size[axis]
        values = np.clip(corners[:, :, 3 + axis], 0.0, 1.0)
        values[middle < 0.0] = inset
        values[middle > 1.0] = 1.0 - inset
        corners[:, :, 3 + axis] = values
    flat = corners.reshape(-1, 8)
    faces = np.arange(len(flat)).reshape(-1, 3)
    return Part.of(flat[:, :3], faces, flat[:, 3:5], flat[:, 5:] / 255.0, part.texture)


def _cut(corners: NDArray[np.float64], column: int, border: float) -> NDArray[np.float64]:
    """Triangles (F, 3, C) of which none reaches across a value of a column."""
    beyond = corners[:, :, column] > border
    across = beyond.any(axis=1) & ~beyond.all(axis=1) & (corners[:, :, column] < border).any(axis=1)
    cut, sides = corners[across], beyond[across]
    if not len(cut):
        return corners
    alone = np.argmax(sides == (sides.sum(axis=1) == 1)[:, None], axis=1)
    a, b, c = (cut[np.arange(len(cut)), (alone + k) % 3] for k in range(3))
    ab, ac = _meeting(a, b, column, border), _meeting(a, c, column, border)
    pieces = np.concatenate([np.stack(piece, axis=1) for piece in ((a, ab, ac), (ab, b, c), (ab, c, ac))])
    spans = np.linalg.norm(np.cross(pieces[:, 1, :3] - pieces[:, 0, :3], pieces[:, 2, :3] - pieces[:, 0, :3]), axis=1)
    return np.concatenate([corners[~across], pieces[spans > 0.0]])


def _meeting(a: NDArray[np.float64], b: NDArray[np.float64], column: int, border: float) -> NDArray[np.float64]:
    """Where lines from a to b meet a value of a column."""
    share = ((border - a[:, column]) / (b[:, column] - a[:, column]))[:, None]
    point = a + share * (b - a)
    point[:, column] = border
    return point
