"""Light on surfaces: OpenGL's fixed function, and the vertices of planes at which it is computed.

Each light gives ambient, diffuse and specular light, the last by the half vector between light and eye; a spot falls
off with the cosine to its axis. Planes are lit at the vertices of a grid and in between by interpolation, as the
renderer does; on curved shapes, whose vertices lie close, light is computed at each ray.
"""

from __future__ import annotations

import numpy as np
from numba import njit

ALL_LIGHTS, FIRST_PASS = -2, -1
"""Which lights shine: all; those that cast no shadow; or, from 0, one of them alone."""

INNER = 1e-9
"""What rounding may take from a cell's width, as a share."""


@njit(nogil=True, error_model="numpy", forceinline=True)
def power(base, exponent):
    """Power; a whole exponent, the usual case, by squaring."""
    whole = int(exponent)
    if whole != exponent or not 0 <= whole <= 1024:
        return base**exponent
    result = 1.0
    while whole > 0:
        if whole & 1:
            result *= base
        base *= base
        whole >>= 1
    return result


@njit(nogil=True, error_model="numpy", forceinline=True)
def lit(shape, lights, group, beams, px, py, pz, nx, ny, nz, ex, ey, ez, factor):
    """Colour of a place of a shape in the light of ``group``, without its texture, each channel at most 1.

    Args:
        shape: what is lit.
        lights: what shines.
        group: lights that count.
        beams: the lights in the shape's frame, (L + 1, 6): place, or direction to it, and axis.
        px: the place.
        py: of it.
        pz: of it.
        nx: its normal.
        ny: of it.
        nz: of it.
        ex: the eye.
        ey: of it.
        ez: of it.
        factor: on the shape's own colour, not on its highlights.
    """
    dr = dg = db = shape.emission if group < 0 else 0.0
    sr, sg, sb = 0.0, 0.0, 0.0
    first, last = (0, len(lights)) if group < 0 else (group, group + 1)
    for number in range(first, last):
        light = lights[number]
        if group == FIRST_PASS and light.shadows:
            continue
        lx, ly, lz = beams[number, 0], beams[number, 1], beams[number, 2]
        strength = 1.0
        if not light.directional:
            lx, ly, lz = lx - px, ly - py, lz - pz
            away = np.sqrt(lx * lx + ly * ly + lz * lz)
            lx, ly, lz = lx / away, ly / away, lz / away
            along = -(lx * beams[number, 3] + ly * beams[number, 4] + lz * beams[number, 5])
            if along < light.cutoff:
                continue
            if light.cutoff >= -1.0:
                strength = power(max(along, 0.0), light.exponent)
            strength /= light.attenuation0 + away * (light.attenuation1 + away * light.attenuation2)
        facing = nx * lx + ny * ly + nz * lz
        diffuse = max(facing, 0.0)
        dr += strength * (light.ambient_r + diffuse * light.diffuse_r)
        dg += strength * (light.ambient_g + diffuse * light.diffuse_g)
        db += strength * (light.ambient_b + diffuse * light.diffuse_b)
        if facing > 0.0 and shape.gloss > 0.0:
            vx, vy, vz = ex - px, ey - py, ez - pz
            length = np.sqrt(vx * vx + vy * vy + vz * vz)
            if length > 0.0:
                vx, vy, vz = vx / length, vy / length, vz / length
            vx, vy, vz = lx + vx, ly + vy, lz + vz
            across, size = nx * vx + ny * vy + nz * vz, vx * vx + vy * vy + vz * vz
            if across > 0.0 and across * across > shape.faint * size:
                shine = strength * shape.gloss * power(across / np.sqrt(size), shape.exponent)
                sr += shine * light.specular_r
                sg += shine * light.specular_g
                sb += shine * light.specular_b
    return (
        min(dr * shape.red * factor + sr, 1.0),
        min(dg * shape.green * factor + sg, 1.0),
        min(db * shape.blue * factor + sb, 1.0),
    )


@njit(nogil=True, error_model="numpy", forceinline=True)
def _cell(x, half, width, whole):
    """Number and borders of the cell of a plane's grid in which x lies; the outermost take what whole cells leave."""
    left = half - whole > INNER * width
    if left and x < -whole:
        return 0, -half, -whole
    cells = int(2.0 * whole / width + 0.5)
    if left and x >= whole:
        return cells + 1, whole, half
    number = min(max(int((x + whole) / width), 0), cells - 1)
    low = number * width - whole
    return number + 1, low, low + width


@njit(nogil=True, error_model="numpy", forceinline=True)
def plane_cell(shape, x, y):
    """The cell of a plane's grid of vertices in which (x, y) lies.

    Returns:
        Its column and row, where it begins and ends along x and y, and where in it (x, y) lies, 0 to 1. It is cut into
        two triangles, from (low x, high y) to (high x, low y).
    """
    column, x0, x1 = _cell(x, shape.sx, shape.cell_x, shape.whole_x)
    row, y0, y1 = _cell(y, shape.sy, shape.cell_y, shape.whole_y)
    return column, row, x0, x1, y0, y1, (x - x0) / (x1 - x0), (y - y0) / (y1 - y0)
