"""Plane geometry of the queries, and the tolerances they all share.

**The plane.** Queries see the floor from above. ``cross(a, b) = a_z b_x - a_x b_z`` is positive where b lies to the
left of a for someone looking down, so that the interior of a polygon lies to the left of its edges (the orientation
of :class:`~prnav.navmesh.polymesh.PolyMesh`).

**Tolerances.** Everything is float64. There are four lengths, and no other epsilon decides what touches what:

- ``TOUCH`` [m]: a point this close to an edge or a corner is on it. Well above the rounding of float64 at the size of
  a building (1e-14), well below anything a body notices.
- ``JOIN`` [m]: a shortest path that starts this close to a corner starts at the corner: the directions from one to the
  other would be rounding.
- ``NARROW`` [m]: windows and slivers thinner than this are dropped, window ends this close to a corner are the corner.
- ``BETTER`` [m]: a path must be shorter by this to replace another; what is longer by this is pruned.

Before: nothing. After: all compiled queries.
"""

from __future__ import annotations

import math

from numba import njit

TOUCH = 1e-7
JOIN = 1e-6
NARROW = 1e-9
BETTER = 1e-9


@njit(cache=True, nogil=True, inline="always")
def cross(ax, az, bx, bz):
    """Signed area spanned by two ground vectors; positive where b lies to the left of a."""
    return az * bx - ax * bz


@njit(cache=True, nogil=True, inline="always")
def length(x, z):
    """Length of a ground vector."""
    return math.sqrt(x * x + z * z)


@njit(cache=True, nogil=True, inline="always")
def nearest_on_segment(px, pz, ax, az, bx, bz):
    """Parameter in [0, 1] of the point of segment a-b nearest to p in the ground plane, and its squared distance."""
    dx, dz = bx - ax, bz - az
    squared = dx * dx + dz * dz
    t = 0.0
    if squared > 0.0:
        t = min(1.0, max(0.0, ((px - ax) * dx + (pz - az) * dz) / squared))
    ex, ez = ax + t * dx - px, az + t * dz - pz
    return t, ex * ex + ez * ez


@njit(cache=True, nogil=True)
def bend(rx, rz, lx, lz, ex, ez, qx, qz):
    """Ground distance from a root through the window l-e (left, right end) to q, and where it bends.

    0: straight; 1: over the left end; 2: over the right end. A point within TOUCH of the outermost line of sight is
    still seen, or else a point on the window's own edge might be sent round over its far end.
    """
    straight = length(qx - rx, qz - rz)
    side = cross(ex - rx, ez - rz, qx - rx, qz - rz)
    if side < 0.0:
        out = length(ex - rx, ez - rz)
        if side < -TOUCH * out:
            return out + length(qx - ex, qz - ez), 2
        return straight, 0
    side = cross(lx - rx, lz - rz, qx - rx, qz - rz)
    if side > 0.0:
        out = length(lx - rx, lz - rz)
        if side > TOUCH * out:
            return out + length(qx - lx, qz - lz), 1
    return straight, 0
