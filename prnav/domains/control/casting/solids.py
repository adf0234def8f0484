"""Where rays enter shapes, which way surfaces face, and what lies inside. All in the shapes' own frames."""

from __future__ import annotations

import numpy as np
from numba import njit

PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 0, 2, 3, 4, 5, 6
"""Kinds of shapes by MuJoCo's own numbers."""

INF = np.inf


@njit(nogil=True, error_model="numpy", forceinline=True)
def _smaller_root(a, b, c):
    """Smaller root of a t^2 + 2 b t + c, inf if there is none."""
    disc = b * b - a * c
    if disc < 0.0 or a <= 0.0:
        return INF
    return (-b - np.sqrt(disc)) / a


@njit(nogil=True, error_model="numpy", forceinline=True)
def enter(shape, ox, oy, oz, dx, dy, dz):
    """Ray parameter where a ray enters a solid, or meets a plane within its borders; inf if it does not.

    It is negative where that lies behind the origin, as it is for a ray that starts inside. Faces seen from inside are
    culled, so nothing else of a solid is ever seen.
    """
    kind, sx, sy = shape.kind, shape.sx, shape.sy
    if kind == PLANE:
        if dz == 0.0:
            return INF
        t = -oz / dz
        if abs(ox + t * dx) > sx or abs(oy + t * dy) > sy:
            return INF
        return t
    if kind == CAPSULE:
        a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - sx * sx
        if a > 0.0:
            disc = b * b - a * c
            if disc < 0.0:
                return INF
            t = (-b - np.sqrt(disc)) / a
            z = oz + t * dz
            if abs(z) <= sy:
                return t
            oz -= sy if z > 0.0 else -sy
        else:
            if c > 0.0:
                return INF
            oz -= sy if dz < 0.0 else -sy
        return _smaller_root(a + dz * dz, b + oz * dz, c + oz * oz)
    if kind == SPHERE:
        return _smaller_root(
            dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz, ox * ox + oy * oy + oz * oz - sx * sx
        )
    if kind == CYLINDER:
        return _enter_cylinder(sx, sy, ox, oy, oz, dx, dy, dz)
    sz = shape.sz
    if kind == ELLIPSOID:
        ox, oy, oz, dx, dy, dz = ox / sx, oy / sy, oz / sz, dx / sx, dy / sy, dz / sz
        return _smaller_root(
            dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz, ox * ox + oy * oy + oz * oz - 1.0
        )
    near, far = _slab(sx, ox, dx, -INF, INF)
    near, far = _slab(sy, oy, dy, near, far)
    near, far = _slab(sz, oz, dz, near, far)
    return near if near < far else INF


@njit(nogil=True, error_model="numpy", forceinline=True)
def _enter_cylinder(radius, half, ox, oy, oz, dx, dy, dz):
    a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - radius * radius
    near, far = -INF, INF
    if a > 0.0:
        disc = b * b - a * c
        if disc < 0.0:
            return INF
        root = np.sqrt(disc)
        near, far = (-b - root) / a, (-b + root) / a
    elif c > 0.0:
        return INF
    near, far = _slab(half, oz, dz, near, far)
    return near if near < far else INF


@njit(nogil=True, error_model="numpy", forceinline=True)
def _slab(half, o, d, near, far):
    """Where a ray is between -half and half along one axis, and within near and far."""
    if d == 0.0:
        return (near, far) if abs(o) <= half else (INF, -INF)
    middle, reach = -o / d, half / abs(d)
    return max(near, middle - reach), min(far, middle + reach)


@njit(nogil=True, error_model="numpy", forceinline=True)
def holds(shape, x, y, z):
    """Whether a place lies inside a solid; a plane holds none."""
    kind, sx, sy = shape.kind, shape.sx, shape.sy
    if kind == PLANE:
        return False
    if kind == CYLINDER:
        return x * x + y * y < sx * sx and abs(z) < sy
    if kind == BOX:
        return abs(x) < sx and abs(y) < sy and abs(z) < shape.sz
    if kind == ELLIPSOID:
        x, y, z = x / sx, y / sy, z / shape.sz
        return x * x + y * y + z * z < 1.0
    if kind == CAPSULE:
        z -= min(max(z, -sy), sy)
    return x * x + y * y + z * z < sx * sx


@njit(nogil=True, error_model="numpy", forceinline=True)
def normal(shape, x, y, z):
    """Outward normal at a place of the surface."""
    kind, sx, sy = shape.kind, shape.sx, shape.sy
    if kind == PLANE:
        return 0.0, 0.0, 1.0
    if kind == CAPSULE:
        z -= min(max(z, -sy), sy)
    elif kind == ELLIPSOID:
        x, y, z = x / (sx * sx), y / (sy * sy), z / (shape.sz * shape.sz)
    elif kind == CYLINDER:
        if abs(z) - sy > np.sqrt(x * x + y * y) - sx:
            x, y = 0.0, 0.0
        else:
            z = 0.0
    elif kind == BOX:
        u, v, w = abs(x) - sx, abs(y) - sy, abs(z) - shape.sz
        if u >= v and u >= w:
            y, z = 0.0, 0.0
        elif v >= w:
            x, z = 0.0, 0.0
        else:
            x, y = 0.0, 0.0
    length = np.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length
