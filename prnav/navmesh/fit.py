"""Whether a navmesh belongs to a mesh: rays cast straight down from points of it must meet a floor."""

from __future__ import annotations

import numpy as np
from numba import njit

from prnav.errors import NavMeshError
from prnav.navmesh.navmesh import NavMesh
from prnav.scene import SceneMesh

SAMPLES = 256
"""Points of a navmesh that are held against its mesh."""

REACH = 0.5
"""How far above and below a point its floor is looked for [m]: more than a step's climb and a cell's height."""

LEAST_SHARE = 0.75
"""Least share of points with a floor that a right pair has."""


def floor_share(navmesh: NavMesh, scene: SceneMesh, samples: int = SAMPLES) -> float:
    """Share of points of a navmesh, drawn by area, with a triangle of the mesh straight above or below within REACH."""
    points = navmesh.random_points(samples, 0)
    found = np.zeros(len(points), bool)
    _mark_floors(scene.vertices, scene.faces, points[np.argsort(points[:, 0])], REACH, found)
    return float(found.mean())


def check_fit(navmesh: NavMesh, scene: SceneMesh, name: str) -> None:
    """Refuse a navmesh that does not lie on a mesh's floors.

    Args:
        navmesh: the navmesh.
        scene: the mesh.
        name: of the navmesh's file, for the error.

    Raises:
        NavMeshError: under less than three quarters of it is a floor.
    """
    share = floor_share(navmesh, scene)
    if share < LEAST_SHARE:
        low, high = navmesh.bounds.round(1).tolist(), scene.bounds.astype(np.float64).round(1).tolist()
        raise NavMeshError(
            f"navmesh {name}: scene {scene.name} has a floor under {100.0 * share:.0f} % of it alone (a right pair: "
            f"nearly all); it is from {low[0]} to {low[1]}, the scene from {high[0]} to {high[1]}: they belong to "
            "different scenes, or the up axis is wrong (--up, or the data set's configs)"
        )


@njit(cache=True, nogil=True, error_model="numpy")
def _mark_floors(vertices, faces, points, reach, found):
    """Mark points (N, 3), ordered by x, with a triangle on the vertical through them within ``reach``."""
    xs = points[:, 0]
    for face in faces:
        ax, ay, az = vertices[face[0]]
        bx, by, bz = vertices[face[1]]
        cx, cy, cz = vertices[face[2]]
        first = np.searchsorted(xs, min(ax, bx, cx))
        last = np.searchsorted(xs, max(ax, bx, cx), side="right")
        area = (bx - ax) * (cz - az) - (bz - az) * (cx - ax)
        if first == last or area == 0.0:
            continue
        for k in range(first, last):
            x, y, z = points[k]
            s = ((x - ax) * (cz - az) - (z - az) * (cx - ax)) / area
            t = ((bx - ax) * (z - az) - (bz - az) * (x - ax)) / area
            if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
                height = ay + s * (by - ay) + t * (cy - ay)
                if abs(height - y) <= reach:
                    found[k] = True
