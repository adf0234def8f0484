"""What a design sees in a home, for ``prnav-design show``: where to look from, and what is seen from there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from prnav.navmesh import NavMesh
from prnav.render import Renderer
from prnav.report.designs import Sight
from prnav.sensors import Design

EYE_HEIGHT = 1.25
"""Height of the camera that tells how much there is to see [m]."""


def see(renderer: Renderer, design: Design, position: NDArray[np.float64], yaw: float, size: int = 256) -> Sight:
    """Pictures of about ``size`` pixels and readings of a design on a body at ``position`` (3,) [m]."""
    size = max(1, round(size / design.grid)) * design.grid  # whole pixels to a patch
    scene, places, headings, sensors = np.array([0]), position[None], np.array([yaw]), design.sensors[None]
    pictures = renderer.image(scene, places, headings, sensors, size)
    readings = renderer.read(scene, places, headings, sensors, design.grid)
    return Sight(np.clip(pictures[0], 0.0, 1.0), np.clip(readings[0], 0.0, 1.0))  # rounding may pass 1 by a bit


def telling_pose(
    renderer: Renderer, navmesh: NavMesh, seed: int = 0, tries: int = 96
) -> tuple[NDArray[np.float64], float]:
    """A position (3,) [m] and yaw with much to see and room around: the best of ``tries`` drawn from a seed.

    The best has the most varied picture of a wide camera at eye height, among poses at least 0.4 m from any wall.
    """
    points = navmesh.random_points(tries, seed)
    yaws = np.random.Generator(np.random.PCG64(seed)).uniform(-math.pi, math.pi, tries)
    roomy = navmesh.clearance(points) >= 0.4
    if roomy.any():
        points, yaws = points[roomy], yaws[roomy]
    camera = np.zeros((len(points), 1, 7))
    camera[:, 0] = [0.0, EYE_HEIGHT, -0.1, 0.0, 0.0, 0.0, math.radians(90.0)]
    scenes = np.zeros(len(points), np.int64)
    pictures = renderer.image(scenes, points, yaws, camera, size=24)[:, 0]
    depths = renderer.depth(scenes, points, yaws, camera, size=24)[:, 0].reshape(len(points), -1)
    spread = pictures.reshape(len(points), -1, 3).std(axis=1).mean(axis=1)
    far = np.median(np.minimum(depths, 6.0), axis=1)
    best = int(np.argmax(spread * np.clip(far / 3.0, 0.2, 1.0)))
    return points[best], float(yaws[best])
