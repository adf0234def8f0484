"""What a strip of an image shows first: shape by shape, over all of its samples at once.

The loops over a line of samples have no branches, so that the compiler runs several samples side by side; where a ray
misses, numbers that are not finite fall through comparisons.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from prnav.domains.control.casting.solids import CAPSULE, PLANE, SPHERE, enter

NARROW = 8
"""Lines of at most so many rays are worked on several at a time, longer ones one by one and only where needed."""


@njit(nogil=True, error_model="numpy", forceinline=True)
def _cells(low, high, begin, width, count):
    """Those of ``count`` cells of a width, the first of which begins at ``begin``, that a range touches: from, to."""
    first = (low - begin) / width
    last = (high - begin) / width
    return int(min(max(first, 0.0), count)), int(min(max(np.ceil(last), 0.0), count))


@njit(nogil=True, error_model="numpy")
def scan(scene, views, order, seen, wide, samples, across, down, depth, shape):
    """Write the depth of what each sample of a strip shows first and its number, -1 for none.

    Args:
        scene: what is seen.
        views: the camera in the shapes' frames.
        order: shapes that may be seen.
        seen: how many.
        wide: rays in a line, equal squares across the image.
        samples: samples of each ray.
        across: samples' a, (M,); those of a ray side by side, then line by line.
        down: minus samples' b, (M,).
        depth: of what is seen [m], (M,).
        shape: its number, (M,).
    """
    for m in range(len(depth)):
        depth[m], shape[m] = scene.far, -1
    width = 2.0 / wide
    line = wide * samples
    lines = len(depth) // line
    top = np.floor(down[0] / width) * width
    for turn in range(seen):
        s = order[turn]
        solid, row = scene.shapes[s], views[s]
        y0, y1 = _cells(-row[16], -row[15], top, width, lines)
        if wide <= NARROW:
            _scan_samples(solid, row, s, scene.near, y0 * line, y1 * line, across, down, depth, shape)
            continue
        x0, x1 = _cells(row[13], row[14], -1.0, width, wide)
        for y in range(y0, y1):
            begin = y * line
            _scan_samples(
                solid, row, s, scene.near, begin + x0 * samples, begin + x1 * samples, across, down, depth, shape
            )


@njit(nogil=True, error_model="numpy")
def _scan_samples(solid, row, s, near, first, last, across, down, depth, shape):
    """The part of :func:`scan` for shape s and samples ``first`` to ``last``."""
    across, down, depth, shape = across[first:last], down[first:last], depth[first:last], shape[first:last]
    if solid.kind == CAPSULE:
        _scan_capsule(solid, row, s, near, across, down, depth, shape)
    elif solid.kind == PLANE:
        _scan_plane(solid, row, s, near, across, down, depth, shape)
    elif solid.kind == SPHERE:
        _scan_sphere(solid, row, s, near, across, down, depth, shape)
    else:
        _scan_other(solid, row, s, near, across, down, depth, shape)


@njit(nogil=True, error_model="numpy", forceinline=True)
def _scan_plane(solid, row, s, near, across, down, depth, shape):
    ox, oy, oz, sx, sy = row[0], row[1], row[2], solid.sx, solid.sy
    rx, ry, rz, ux, uy, uz = row[3], row[4], row[5], row[6], row[7], row[8]
    fx, fy, fz = row[9], row[10], row[11]
    for j in range(len(depth)):
        a, b = across[j], -down[j]
        t = -oz / (fz + a * rz + b * uz)
        x, y = abs(ox + t * (fx + a * rx + b * ux)), abs(oy + t * (fy + a * ry + b * uy))
        hit = (x <= sx) & (y <= sy) & (t >= near) & (t < depth[j])
        depth[j] = t if hit else depth[j]
        shape[j] = s if hit else shape[j]


@njit(nogil=True, error_model="numpy", forceinline=True)
def _scan_sphere(solid, row, s, near, across, down, depth, shape):
    ox, oy, oz = row[0], row[1], row[2]
    rx, ry, rz, ux, uy, uz = row[3], row[4], row[5], row[6], row[7], row[8]
    fx, fy, fz = row[9], row[10], row[11]
    c = ox * ox + oy * oy + oz * oz - solid.sx * solid.sx
    for j in range(len(depth)):
        a, b = across[j], -down[j]
        dx, dy, dz = fx + a * rx + b * ux, fy + a * ry + b * uy, fz + a * rz + b * uz
        square, along = dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz
        t = (-along - np.sqrt(along * along - square * c)) / square
        hit = (t >= near) & (t < depth[j])
        depth[j] = t if hit else depth[j]
        shape[j] = s if hit else shape[j]


@njit(nogil=True, error_model="numpy", forceinline=True)
def _scan_capsule(solid, row, s, near, across, down, depth, shape):
    ox, oy, oz, half = row[0], row[1], row[2], solid.sy
    rx, ry, rz, ux, uy, uz = row[3], row[4], row[5], row[6], row[7], row[8]
    fx, fy, fz = row[9], row[10], row[11]
    c = ox * ox + oy * oy - solid.sx * solid.sx
    for j in range(len(depth)):
        a, b = across[j], -down[j]
        dx, dy, dz = fx + a * rx + b * ux, fy + a * ry + b * uy, fz + a * rz + b * uz
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
def _scan_other(solid, row, s, near, across, down, depth, shape):
    for j in range(len(depth)):
        a, b = across[j], -down[j]
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
