"""Distances to the outlines of polygons, in float32, as the height detail measures them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def segment_distance(x, y, z, ax, ay, az, bx, by, bz):
    """Squared distance of a point to the segment from a to b."""
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = dx * dx + dy * dy + dz * dz
    t = dx * (x - ax) + dy * (y - ay) + dz * (z - az)
    if length > 0:
        t /= length
    t = min(max(t, np.float32(0)), np.float32(1))
    px, py, pz = ax + t * dx - x, ay + t * dy - y, az + t * dz - z
    return px * px + py * py + pz * pz


@njit(cache=True, nogil=True, error_model="numpy")
def smallest_extent(points, count):
    """Width of a polygon across its narrowest side."""
    flat = np.float32(0)
    smallest = np.float32(np.inf)
    for i in range(count):
        following = (i + 1) % count
        ax, az = points[i, 0], points[i, 2]
        bx, bz = points[following, 0], points[following, 2]
        largest = np.float32(0)
        for j in range(count):
            if j != i and j != following:
                distance = segment_distance(points[j, 0], flat, points[j, 2], ax, flat, az, bx, flat, bz)
                largest = max(largest, distance)
        smallest = min(smallest, largest)
    return math.sqrt(smallest)


@njit(cache=True, nogil=True, error_model="numpy")
def outline_distance(points, count, x, z):
    """Squared distance of a place to a polygon's outline in the ground plane, negative inside."""
    flat = np.float32(0)
    nearest = np.float32(np.inf)
    inside = False
    before = count - 1
    for i in range(count):
        ax, az = points[before, 0], points[before, 2]
        bx, bz = points[i, 0], points[i, 2]
        if (bz > z) != (az > z) and x < (ax - bx) * (z - bz) / (az - bz) + bx:
            inside = not inside
        nearest = min(nearest, segment_distance(x, flat, z, ax, flat, az, bx, flat, bz))
        before = i
    return -nearest if inside else nearest
