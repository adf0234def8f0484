"""Textures of a MuJoCo model as pyramids of ever coarser levels, all in one array of bytes.

A ray stands for a whole patch of texture; it reads the level whose texels are about as large as that patch. Levels are
halved by exact area averages, down to one texel. Row 0 of a plane's texture lies at v = 0; cube maps have their six
faces in OpenGL's order (+x, -x, +y, -y, +z, -z) one after another.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.domains.control.engine import mujoco
from prnav.errors import RenderError

Float64 = NDArray[np.float64]

LEVELS = 16
"""Most levels of a pyramid: enough for 32,768 texels a side."""


class TexturePyramids(NamedTuple):
    """Pyramids of T textures."""

    texels: NDArray[np.uint8]
    """Red, green, blue of all texels of all levels, row by row, shape (bytes,)."""
    table: NDArray[np.int64]
    """Where in ``texels`` each level begins, and its width and height, (T, LEVELS, 3)."""
    levels: NDArray[np.int64]
    """Levels of each texture, (T,)."""


def build_textures(model: mujoco.MjModel) -> TexturePyramids:
    """Pyramids of all textures of a model, in its order.

    Raises:
        RenderError: a texture has other than 3 or 4 channels.
    """
    parts: list[NDArray[np.uint8]] = []
    table = np.zeros((max(model.ntex, 1), LEVELS, 3), np.int64)
    count = np.zeros(max(model.ntex, 1), np.int64)
    offset = 0
    for texture in range(model.ntex):
        faces = _faces(model, texture)
        for level in range(LEVELS):
            table[texture, level] = offset, faces.shape[2], faces.shape[1]
            data = np.rint(faces).astype(np.uint8).ravel()
            parts.append(data)
            offset += len(data)
            count[texture] = level + 1
            if faces.shape[1] == 1 and faces.shape[2] == 1:
                break
            faces = halved(faces)
    return TexturePyramids(np.concatenate(parts) if parts else np.zeros(3, np.uint8), table, count)


def _faces(model: mujoco.MjModel, texture: int) -> Float64:
    """Pictures (faces, height, width, 3) of a texture, 0 to 255."""
    width, height, channels = (int(x[texture]) for x in (model.tex_width, model.tex_height, model.tex_nchannel))
    if channels not in (3, 4):
        raise RenderError(f"texture {model.texture(texture).name!r} has {channels} channels; it must have 3 or 4")
    start = int(model.tex_adr[texture])
    data = model.tex_data[start : start + width * height * channels].astype(np.float64)
    if model.tex_type[texture] == mujoco.mjtTexture.mjTEXTURE_2D:
        return data.reshape(1, height, width, channels)[..., :3]
    faces = data.reshape(-1, width, width, channels)[..., :3]
    return np.broadcast_to(faces, (6, *faces.shape[1:])) if len(faces) == 1 else faces


def halved(pictures: Float64) -> Float64:
    """Pictures (n, h, w, c) at half the size, rounded down but at least 1: each new texel is the mean of its area."""
    for axis in (1, 2):
        pictures = np.moveaxis(_halved_along(np.moveaxis(pictures, axis, 0)), 0, axis)
    return pictures


def _halved_along(rows: Float64) -> Float64:
    size = len(rows)
    if size == 1:
        return rows
    if size % 2 == 0:
        return 0.5 * (rows[0::2] + rows[1::2])
    fewer = size // 2
    weights = np.zeros((fewer, size))
    edges = np.arange(fewer + 1) * (size / fewer)
    for new in range(fewer):
        cells = np.arange(size)
        weights[new] = np.clip(np.minimum(cells + 1, edges[new + 1]) - np.maximum(cells, edges[new]), 0.0, 1.0)
    return np.asarray(np.tensordot(weights * (fewer / size), rows, axes=1))
