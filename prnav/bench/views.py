"""Scenes, poses and sensors that the rendering benchmarks share."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.navmesh import load_navmesh
from prnav.scene import SceneMesh, load_scene

Poses = tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Scene ids (N,), feet (N, 3), yaws (N,), designs (N, K, 7), as a renderer takes them."""

REAL_SCENES = {
    "small_house": ("aws_small_house", "small_house.glb"),
    "hospital": ("aws_hospital", "hospital_two_floors.glb"),
    "bookstore": ("aws_bookstore", "bookstore.glb"),
}


def real_scene(name: str) -> SceneMesh | None:
    """One of :data:`REAL_SCENES` where ``PRNAV_REAL_DATA`` is set."""
    folder = os.environ.get("PRNAV_REAL_DATA")
    return load_scene(Path(folder, "scenes", *REAL_SCENES[name])) if folder else None


def walking_poses(scene: SceneMesh, agents: int, designs: NDArray[np.float64], seed: int = 0) -> Poses:
    """Agents at random places of a floor, looking anywhere, all with one design (K, 7)."""
    generator = np.random.Generator(np.random.PCG64(seed))
    feet = load_navmesh(scene).random_points(agents, seed)
    yaws = generator.uniform(-np.pi, np.pi, agents)
    return np.zeros(agents, np.int64), feet, yaws, np.broadcast_to(designs, (agents, *designs.shape))


def two_sensors() -> NDArray[np.float64]:
    """The benchmark's sensors (2, 7): 1.25 m up, 30 degrees to the left and right, 90 degrees wide."""
    designs = np.zeros((2, 7))
    designs[:, 1] = 1.25
    designs[:, 3] = np.radians([30.0, -30.0])
    designs[:, 6] = np.radians(90.0)
    return designs
