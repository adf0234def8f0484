"""Readings of textures: repeated ones on planes, and the cube map of the sky."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(nogil=True, error_model="numpy", forceinline=True)
def _texel(textures, texture, level, u, v, face):
    """Bilinear reading of one level, 0 to 255: of a cube's face, held at its border, or of a repeated one (face -1)."""
    start, width, height = textures.table[texture, level]
    x, y = u * width - 0.5, v * height - 0.5
    left, top = math.floor(x), math.floor(y)
    fx, fy = x - left, y - top
    x0, y0 = int(left), int(top)
    x1, y1 = x0 + 1, y0 + 1
    if face < 0:  # u and v lie within 0 and 1
        x0, y0 = width - 1 if x0 < 0 else x0, height - 1 if y0 < 0 else y0
        x1, y1 = 0 if x1 >= width else x1, 0 if y1 >= height else y1
    else:
        start += face * 3 * width * width
        x0, x1 = max(x0, 0), min(x1, width - 1)
        y0, y1 = max(y0, 0), min(y1, height - 1)
    a, b = start + 3 * (y0 * width + x0), start + 3 * (y0 * width + x1)
    c, d = start + 3 * (y1 * width + x0), start + 3 * (y1 * width + x1)
    wa, wb, wc, wd = (1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy
    texels = textures.texels
    return (
        wa * texels[a] + wb * texels[b] + wc * texels[c] + wd * texels[d],
        wa * texels[a + 1] + wb * texels[b + 1] + wc * texels[c + 1] + wd * texels[d + 1],
        wa * texels[a + 2] + wb * texels[b + 2] + wc * texels[c + 2] + wd * texels[d + 2],
    )


@njit(nogil=True, error_model="numpy", forceinline=True)
def _sample(textures, texture, u, v, footprint, face):
    """Colour, 0 to 1, of a texture at (u, v), mean over about ``footprint`` texels each way."""
    coarsest = textures.levels[texture] - 1
    share, level = math.frexp(max(footprint, 1.0))
    level -= 1  # footprint = 2 share 2^level, and 2 share - 1 is log2(2 share) within 0.09
    share = 2.0 * share - 1.0
    if level >= coarsest:
        level, share = coarsest, 0.0
    red, green, blue = _texel(textures, texture, level, u, v, face)
    if share > 0.0:
        r, g, b = _texel(textures, texture, level + 1, u, v, face)
        red, green, blue = red + share * (r - red), green + share * (g - green), blue + share * (b - blue)
    return red * (1.0 / 255.0), green * (1.0 / 255.0), blue * (1.0 / 255.0)


@njit(nogil=True, error_model="numpy", forceinline=True)
def plane_color(shape, textures, x, y, width):
    """Colour of a plane's texture at (x, y), mean over about ``width`` [m] each way."""
    _, wide, high = textures.table[shape.texture, 0]
    u, v = shape.u * x + shape.u0, shape.v * y + shape.v0
    footprint = width * np.sqrt(abs(shape.u * wide * shape.v * high))
    return _sample(textures, shape.texture, u - np.floor(u), v - np.floor(v), footprint, -1)


@njit(nogil=True, error_model="numpy", forceinline=True)
def sky_color(textures, sky, dx, dy, dz, pixel):
    """Colour of the sky in a direction of the world, for pixels ``pixel`` wide at depth 1; black without a sky."""
    if sky < 0:
        return 0.0, 0.0, 0.0
    x, y, z = dx, dz, -dy  # the cube's y is up
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, major, u, v = (0, ax, -z, -y) if x > 0.0 else (1, ax, z, -y)
    elif ay >= az:
        face, major, u, v = (2, ay, x, z) if y > 0.0 else (3, ay, x, -z)
    else:
        face, major, u, v = (4, az, x, -y) if z > 0.0 else (5, az, -x, -y)
    # texels of a pixel: its solid angle, pixel^2 / |d|^3, over a texel's, (2 / width)^2 (major / |d|)^3
    footprint = 0.5 * textures.table[sky, 0, 1] * pixel / (major * np.sqrt(major))
    return _sample(textures, sky, 0.5 + 0.5 * u / major, 0.5 + 0.5 * v / major, footprint, face)
