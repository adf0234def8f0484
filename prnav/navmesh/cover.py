"""Which floor of a scene is a roof: nothing above it, nothing around it, and rooms elsewhere.

Nobody gets onto a roof or the top of a ceiling from inside, so that episodes there are of no use. An island counts as a
roof if rays from it meet neither a ceiling nor walls and a fair part of the scene's floor is indoors; in a scene that
is all outdoors nothing is a roof. Where the rooms have a ceiling throughout, single points without one are roofs too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.cache import cache_key, cached_arrays
from prnav.navmesh.navmesh import NavMesh
from prnav.scene import SceneMesh

COVER_VERSION = 1
SAMPLES = 64
"""Points that are looked at on each island."""

EYE = 1.0
"""Height above the floor that rays start from [m]: above a parapet, below a ceiling."""

SIDEWAYS = 8
"""Rays to the sides from each point."""

FAR = 60.0
"""How far a wall may be [m]."""


def island_covers(navmesh: NavMesh, scene: SceneMesh, least_radius: float = 1.5) -> NDArray[np.float64]:
    """How much of each island lies under something, and how much of the view to the sides meets something, (n, 2).

    Args:
        navmesh: the floor.
        scene: its mesh.
        least_radius: islands of smaller radius are not looked at; their rows are NaN [m].
    """
    origins = np.zeros((0, 3))
    owners: list[int] = []
    points = navmesh.random_points(20_000, 0)
    islands = navmesh.island_of(points)
    for number, island in enumerate(navmesh.islands):
        own = points[islands == number][:SAMPLES]
        if island.radius >= least_radius and len(own):
            origins = np.concatenate([origins, own])
            owners += [number] * len(own)
    result = np.full((len(navmesh.islands), 2), np.nan)
    if not owners:
        return result
    angles = np.arange(SIDEWAYS) * (2.0 * math.pi / SIDEWAYS) + 0.1
    directions = np.stack([np.cos(angles), np.zeros(SIDEWAYS), np.sin(angles)], axis=1)
    directions = np.concatenate([[[0.0, 1.0, 0.0]], directions])
    hits = np.zeros((len(origins), len(directions)), bool)
    _cast(scene.vertices, scene.faces, origins + [0.0, EYE, 0.0], directions, FAR, hits)
    owner = np.array(owners)
    for number in np.unique(owner):
        own = hits[owner == number]
        result[number] = own[:, 0].mean(), own[:, 1:].mean()
    return result


ROOF_COVER, ROOF_WALLS = 0.5, 0.25
"""A roof has less than this share of ceiling above it, and of walls around it."""

INDOOR_SHARE = 0.2
"""Least share of a scene's floor that is indoors where it is asked for roofs at all."""

CEILING_SHARE = 0.75
"""Least share of the floor that is no roof and has something above it where the scene is said to have a ceiling."""


@dataclass(frozen=True, eq=False)
class IndoorFloors:
    """What floor of a scene episodes are drawn on.

    Attributes:
        islands: whether an island is no roof, (n,).
        open: whether single points of an island may have no ceiling where they must have one, (n,).
        scene: the mesh, for single points.
    """

    islands: NDArray[np.bool_]
    open: NDArray[np.bool_]
    scene: SceneMesh

    def fit(self, points: NDArray[np.float64], islands: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Whether points (N, 3) on islands (N,) are no roof, (N,)."""
        good = self.islands[islands]
        rows = np.flatnonzero(good & self.open[islands])
        if len(rows):
            hits = np.zeros((len(rows), 1), bool)
            up = np.array([[0.0, 1.0, 0.0]])
            _cast(self.scene.vertices, self.scene.faces, points[rows] + [0.0, EYE, 0.0], up, np.inf, hits)
            good[rows] = hits[:, 0]
        return good


def indoor_floors(navmesh: NavMesh, scene: SceneMesh) -> IndoorFloors:
    """What floor of a scene is no roof; the covers of its islands are kept in the cache."""
    areas = np.array([island.area for island in navmesh.islands])
    key = cache_key(COVER_VERSION, scene.hash, areas.tolist(), navmesh.bounds.tolist())
    covers = cached_arrays("cover", key, lambda: {"covers": island_covers(navmesh, scene)})["covers"]
    return IndoorFloors(*roofless(areas, covers), scene)


def roofless(areas: NDArray[np.float64], covers: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Islands that are no roof, and those of which single points are held against a ceiling, (n,) both.

    Args:
        areas: of the islands, (n,) [m2].
        covers: from :func:`island_covers`, (n, 2).
    """
    above, around = covers.T
    known = np.isfinite(above)
    indoor = known & ((above >= ROOF_COVER) | (around >= ROOF_COVER))
    roof = known & (above < ROOF_COVER) & (around < ROOF_WALLS)
    if areas[indoor].sum() < INDOOR_SHARE * areas[known].sum():
        roof[:] = False  # a scene outdoors
    kept = known & ~roof
    ceiling = (areas * np.nan_to_num(above))[kept].sum() >= CEILING_SHARE * areas[kept].sum() > 0.0
    return ~roof, kept & (above < 1.0) if ceiling else np.zeros(len(areas), bool)


@njit(cache=True, nogil=True, error_model="numpy")
def _cast(vertices, faces, origins, directions, far, hits):
    """Mark rays (points x directions) that meet a triangle within ``far``."""
    for face in faces:
        ax, ay, az = vertices[face[0]]
        ux, uy, uz = vertices[face[1], 0] - ax, vertices[face[1], 1] - ay, vertices[face[1], 2] - az
        vx, vy, vz = vertices[face[2], 0] - ax, vertices[face[2], 1] - ay, vertices[face[2], 2] - az
        least, most = ay + min(0.0, uy, vy), ay + max(0.0, uy, vy)
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for p in range(len(origins)):
            x, y, z = origins[p, 0] - ax, origins[p, 1] - ay, origins[p, 2] - az
            if origins[p, 1] > most:
                continue
            for d in range(len(directions)):
                if hits[p, d] or (d > 0 and origins[p, 1] < least):
                    continue
                dx, dy, dz = directions[d]
                slope = dx * nx + dy * ny + dz * nz
                if slope == 0.0:
                    continue
                t = -(x * nx + y * ny + z * nz) / slope
                if t <= 0.0 or t > far:
                    continue
                # where it meets the plane, in the triangle's own coordinates
                qx, qy, qz = x + t * dx, y + t * dy, z + t * dz
                cx, cy, cz = uy * qz - uz * qy, uz * qx - ux * qz, ux * qy - uy * qx
                length = nx * nx + ny * ny + nz * nz
                s2 = (cx * nx + cy * ny + cz * nz) / length
                cx, cy, cz = qy * vz - qz * vy, qz * vx - qx * vz, qx * vy - qy * vx
                s1 = (cx * nx + cy * ny + cz * nz) / length
                if s1 >= 0.0 and s2 >= 0.0 and s1 + s2 <= 1.0:
                    hits[p, d] = True
