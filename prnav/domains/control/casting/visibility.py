"""What a strip of an image shows first: shape by shape, over all of its samples at once.

The loops over a line of samples have no branches, so that the compiler runs several samples side by side; where a ray
misses, numbers that are not finite fall through comparisons.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from prnav.domains.control.casting.solids import CAPSULE, PLANE, SPHERE, enter


@njit(nogil=True, error_model="numpy", forceinline=True)
def _span(values, low, high):
    """The part of ascending ``values`` that lies between two bounds: from, to."""
    first, last = 0, len(values)
    while first < last and values[first] < low:
        first += 1
    while last > first and values[last - 1] > high:
        last -= 1
    return first, last


@njit(nogil=True, error_model="numpy")
def scan(scene, views, order, seen, across, down, depth, shape):
    """Write the depth of what each sample of a strip shows first and its number, -1 for none.

    Args:
        scene: what is seen.
        views: the camera in the shapes' frames.
        order: shapes that may be seen.
        seen: how many.
        across: samples' a, ascending, (W,).
        down: minus samples' b, ascending, (H,).
        depth: (H, W) [m].
        shape: (H, W).
    """
    near = scene.near
    for i in range(len(down)):
        for j in range(len(across)):
            depth[i, j], shape[i, j] = scene.far, -1
    for turn in range(seen):
        s = order[turn]
        x0, x1 = _span(across, views[s, 13], views[s, 14])
        y0, y1 = _span(down, -views[s, 16], -views[s, 15])
        kind = scene.shapes[s].kind
        for i in range(y0, y1):
            if kind == CAPSULE:
                _scan_capsule(scene.shapes[s], views[s], s, across, x0, x1, -down[i], near, depth[i], shape[i])
            elif kind == PLANE:
                _scan_plane(scene.shapes[s], views[s], s, across, x0, x1, -down[i], near, depth[i], shape[i])
            elif kind == SPHERE:
                _scan_sphere(scene.shapes[s], views[s], s, across, x0, x1, -down[i], near, depth[i], shape[i])
            else:
                _scan_other(scene.shapes[s], views[s], s, across, x0, x1, -down[i], near, depth[i], shape[i])


@njit(nogil=True, error_model="numpy", forceinline=True)
def _scan_plane(solid, row, s, across, x0, x1, b, near, depth, shape):
    ox, oy, oz, sx, sy = row[0], row[1], row[2], solid.sx, solid.sy
    rx, ry, rz = row[3], row[4], row[5]
    fx, fy, fz = row[9] + b * row[6], row[10] + b * row[7], row[11] + b * row[8]
    for j in range(x0, x1):
        a = across[j]
        t = -oz / (fz + a * rz)
        x, y = abs(ox + t * (fx + a * rx)), abs(oy + t * (fy + a * ry))
        hit = (x <= sx) & (y <= sy) & (t >= near) & (t < depth[j])
        depth[j] = t if hit else depth[j]
        shape[j] = s if hit else shape[j]


@njit(nogil=True, error_model="numpy", forceinline=True)
def _scan_sphere(solid, row, s, across, x0, x1, b, near, depth, shape):
    ox, oy, oz = row[0], row[1], row[2]
    rx, ry, rz = row[3], row[4], row[5]
    fx, fy, fz = row[9] + b * row[6], row[10] + b * row[7], row[11] + b * row[8]
    c = ox * ox + oy * oy + oz * oz - solid.sx * solid.sx
    for j in range(x0, x1):
        a = across[j]
        dx, dy, dz = fx + a * rx, fy + a * ry, fz + a * rz
        square, along = dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz
        t = (-along - np.sqrt(along * along - square * c)) / square
        hit = (t >= near) & (t < depth[j])
        depth[j] = t if hit else depth[j]
        shape[j] = s if hit else shape[j]


@njit(nogil=True, error_model="numpy", forceinline=True)
def _scan_capsule(solid, row, s, across, x0, x1, b, near, depth, shape):
    ox, oy, oz, half = row[0], row[1], row[2], solid.sy
    rx, ry, rz = row[3], row[4], row[5]
    fx, fy, fz = row[9] + b * row[6], row[10] + b * row[7], row[11] + b * row[8]
    c = ox * ox + oy * oy - solid.sx * solid.sx
    for j in range(x0, x1):
        a = across[j]
        dx, dy, dz = fx + a * rx, fy + a * ry, fz + a * rz
        square, along = dx * dx + dy * dy, ox * dx + oy * dy
        side = (-along - np.sqrt(along * along - square * c)) / square
        z = oz + side * dz if square > 0.0 else -dz  # along its axis a ray enters by the end that faces it
        end = oz - (half if z > 0.0 else -half)
        square, reach = square + dz * dz, along + end * dz
        cap = (-reach - np.sqrt(reach * reach - square * (c + end * end))) / square
        t = side if abs(z) <= half else cap
        hit = (t >= near) & (t < depth[j])
        depth[j] = t if hit else depth[j]
        shape[j] = s if hit else shape[j]


@njit(nogil=True, error_model="numpy")
def _scan_other(solid, row, s, across, x0, x1, b, near, depth, shape):
    for j in range(x0, x1):
        a = across[j]
        t = enter(
            solid,
            row[0],
            row[1],
            row[2],
            row[9] + a * row[3] + b * row[6],
            row[10] + a * row[4] + b * row[7],
            row[11] + a * row[5] + b * row[8],
        )
        if near <= t < depth[j]:
            depth[j], shape[j] = t, s
