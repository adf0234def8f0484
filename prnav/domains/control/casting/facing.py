"""Shapes as a camera sees them: poses in its frame, boxes around them in its image, and which of them matter.

A camera is a row of twelve: its place, right and up as long as half its image is wide at depth 1, and forward. A mirror
is a camera too, the mirrored one. Rows of ``views`` (S, 17) hold the camera in each shape's frame, in the same order,
and then 12 the least depth and 13-16 the box: a from, a to, b from, b to.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from prnav.domains.control.casting.solids import CAPSULE, CYLINDER, INF, PLANE

OPAQUE = 0.995
"""Shapes of at least this opacity hide what is behind them."""

BEHIND_ALPHA = 0.3
"""Factor on the opacity of a plane seen from behind."""

_CLOSE = 1e-9
"""Places of less depth than this [m] have no image."""


@njit(nogil=True, error_model="numpy", forceinline=True)
def _ball_range(x, z, radius):
    """Least and largest x / z over a ball; all numbers where it reaches behind the camera."""
    if z <= radius * (1.0 + 1e-6):
        return -INF, INF
    square = z * z - radius * radius
    root = radius * np.sqrt(x * x + square)
    return (x * z - root) / square, (x * z + root) / square


@njit(nogil=True, error_model="numpy", forceinline=True)
def _into(camera, k, x, y, z):
    """Component of a vector along a camera's right (k = 3), up (6) or forward (9)."""
    return camera[k] * x + camera[k + 1] * y + camera[k + 2] * z


@njit(nogil=True, error_model="numpy", forceinline=True)
def write_box(shape, m, camera, half, parallel, box):
    """Write the box around a shape at pose m in a camera's image into ``box`` (4,); parallel rays have no depth.

    It is in units of half the image, and never too small. The least depth is returned.
    """
    cx, cy, cz = m[0] - camera[0], m[1] - camera[1], m[2] - camera[2]
    x, y = _into(camera, 3, cx, cy, cz) / half, _into(camera, 6, cx, cy, cz) / half
    z = _into(camera, 9, cx, cy, cz)
    long = shape.kind == CAPSULE or shape.kind == CYLINDER
    if shape.kind == PLANE:
        px, py, pz = m[3] * shape.sx, m[6] * shape.sx, m[9] * shape.sx
        qx, qy, qz = m[4] * shape.sy, m[7] * shape.sy, m[10] * shape.sy
        pu, pv, pw = (
            _into(camera, 3, px, py, pz) / half,
            _into(camera, 6, px, py, pz) / half,
            _into(camera, 9, px, py, pz),
        )
        qu, qv, qw = (
            _into(camera, 3, qx, qy, qz) / half,
            _into(camera, 6, qx, qy, qz) / half,
            _into(camera, 9, qx, qy, qz),
        )
        least = z - abs(pw) - abs(qw)
        if parallel:
            box[0], box[1] = x - abs(pu) - abs(qu), x + abs(pu) + abs(qu)
            box[2], box[3] = y - abs(pv) - abs(qv), y + abs(pv) + abs(qv)
        elif least <= _CLOSE:
            box[0], box[1], box[2], box[3] = -INF, INF, -INF, INF
        else:
            u, v = (x - pu - qu) / (z - pw - qw), (y - pv - qv) / (z - pw - qw)
            box[0], box[1], box[2], box[3] = u, u, v, v
            for corner in range(1, 4):
                p, q = 1.0 if corner & 1 else -1.0, 1.0 if corner & 2 else -1.0
                w = z + p * pw + q * qw
                u, v = (x + p * pu + q * qu) / w, (y + p * pv + q * qv) / w
                box[0], box[1], box[2], box[3] = min(box[0], u), max(box[1], u), min(box[2], v), max(box[3], v)
    else:
        radius = shape.sx if long else shape.bound
        reach = shape.sy if long else 0.0
        ax, ay, az = m[5] * reach, m[8] * reach, m[11] * reach
        u, v = _into(camera, 3, ax, ay, az) / half, _into(camera, 6, ax, ay, az) / half
        w = _into(camera, 9, ax, ay, az)
        least = z - abs(w) - radius
        if parallel:
            box[0], box[1] = x - abs(u) - radius, x + abs(u) + radius
            box[2], box[3] = y - abs(v) - radius, y + abs(v) + radius
        else:
            low, high = _ball_range(x + u, z + w, radius)
            low2, high2 = _ball_range(x - u, z - w, radius)
            box[0], box[1] = min(low, low2), max(high, high2)
            low, high = _ball_range(y + v, z + w, radius)
            low2, high2 = _ball_range(y - v, z - w, radius)
            box[2], box[3] = min(low, low2), max(high, high2)
    for k in range(4):
        box[k] /= half
    return least


@njit(nogil=True, error_model="numpy", forceinline=True)
def turn_camera(m, camera, row):
    """Write a camera in the frame of a shape at pose m into its row of ``views``."""
    x, y, z = camera[0] - m[0], camera[1] - m[1], camera[2] - m[2]
    for k in range(3):
        row[k] = m[3 + k] * x + m[6 + k] * y + m[9 + k] * z
        for axis in range(3, 12, 3):
            row[axis + k] = m[3 + k] * camera[axis] + m[6 + k] * camera[axis + 1] + m[9 + k] * camera[axis + 2]


@njit(nogil=True, error_model="numpy", forceinline=True)
def aim_headlight(m, camera, beam):
    """Write the direction to the headlight, against where the camera looks, in the frame of a shape at pose m."""
    for k in range(3):
        beam[k] = -(m[3 + k] * camera[9] + m[6 + k] * camera[10] + m[9 + k] * camera[11])


@njit(nogil=True, error_model="numpy")
def face_shapes(shapes, poses, camera, half, near, hidden, views, order):
    """Write the opaque shapes that a camera may see, other than those ``hidden`` (S,), into ``views`` and ``order``.

    Returns:
        How many there are; the first in ``order`` have the least depth.
    """
    seen = 0
    for s in range(len(shapes)):
        if hidden[s]:
            continue
        shape, m = shapes[s], poses[s]
        if shape.kind == PLANE:
            height = m[5] * (camera[0] - m[0]) + m[8] * (camera[1] - m[1]) + m[11] * (camera[2] - m[2])
            if height <= 0.0:
                continue
        row = views[s]
        least = write_box(shape, m, camera, half, False, row[13:17])
        if least + 2.0 * shape.bound < near or row[13] > 1.0 or row[14] < -1.0 or row[15] > 1.0 or row[16] < -1.0:
            continue
        row[12] = least
        turn_camera(m, camera, row)
        at = seen
        while at > 0 and views[order[at - 1], 12] > least:
            order[at] = order[at - 1]
            at -= 1
        order[at] = s
        seen += 1
    return seen


@njit(nogil=True, error_model="numpy", forceinline=True)
def find_veils(scene, poses, camera, alphas, hidden, veils):
    """Write each shape's opacity as a camera sees it, and the transparent ones in the order in which they are blended.

    ``alphas`` (S,) is negative for planes seen from behind; ``hidden`` (S,) marks what is transparent.

    Returns:
        How many are transparent.
    """
    count = 0
    for s in range(len(scene.shapes)):
        shape, m = scene.shapes[s], poses[s]
        x, y, z = camera[0] - m[0], camera[1] - m[1], camera[2] - m[2]
        alpha = shape.alpha
        flat = shape.kind == PLANE
        if flat and m[5] * x + m[8] * y + m[11] * z < 0.0:
            alpha *= -BEHIND_ALPHA
        alphas[s] = alpha
        hidden[s] = abs(alpha) < OPAQUE
        if hidden[s]:
            away = INF if flat else np.sqrt(x * x + y * y + z * z) - shape.bound
            at = count
            while at > 0 and veils.away[at - 1] > away:
                veils.shape[at], veils.away[at] = veils.shape[at - 1], veils.away[at - 1]
                at -= 1
            veils.shape[at], veils.away[at] = s, away
            count += 1
    return count


@njit(nogil=True, error_model="numpy", forceinline=True)
def mirror_camera(camera, m, mirrored):
    """Write the image of a camera in a plane at pose m."""
    nx, ny, nz = m[5], m[8], m[11]
    height = (camera[0] - m[0]) * nx + (camera[1] - m[1]) * ny + (camera[2] - m[2]) * nz
    for k in range(0, 12, 3):
        along = height if k == 0 else camera[k] * nx + camera[k + 1] * ny + camera[k + 2] * nz
        mirrored[k] = camera[k] - 2.0 * along * nx
        mirrored[k + 1] = camera[k + 1] - 2.0 * along * ny
        mirrored[k + 2] = camera[k + 2] - 2.0 * along * nz
