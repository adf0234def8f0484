"""What a design costs: the optional reward r0 of the design action (the paper, section "Joint Optimization")."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.checks import require_at_least
from prnav.sensors import Design


@dataclass(frozen=True)
class CostConfig:
    """Prices in units of the score (SoftSPL, 0 to 1); all 0 is the paper's r0 = 0."""

    sensor: float = 0.0
    """Per sensor that is in use, that is wider than ``unused_fov_deg``."""
    unused_fov_deg: float = 5.0
    """A sensor narrower than this counts as left out [degrees]."""
    fov: float = 0.0
    """Per steradian that the sensors' square views cover, overlaps counted twice: wide optics are dear."""
    power: float = 0.0
    """Per receptor of the sensors in use."""
    distance: float = 0.0
    """Per metre of cable: the shortest tree that joins the sensors, straight lines."""

    def __post_init__(self) -> None:
        require_at_least(self, 0, "sensor", "unused_fov_deg", "fov", "power", "distance")

    @property
    def free(self) -> bool:
        """Whether nothing costs anything."""
        return not (self.sensor or self.fov or self.power or self.distance)


def design_cost(poses: ArrayLike, design: Design, config: CostConfig) -> NDArray[np.float64]:
    """Costs (...) of sensor poses (..., K, 7): r0 is minus this."""
    poses = np.asarray(poses, np.float64)
    fov = poses[..., 6]
    used = fov > np.radians(config.unused_fov_deg)
    cost = (config.sensor + config.power * design.grid**2) * used.sum(axis=-1)
    if config.fov:
        cost = cost + config.fov * solid_angle(fov).sum(axis=-1)
    if config.distance:
        rows = poses.reshape(-1, *poses.shape[-2:])
        length = np.array([tree_length(row[:, :3]) for row in rows]).reshape(poses.shape[:-2])
        cost = cost + config.distance * length
    return np.asarray(cost, np.float64)


def solid_angle(fov: ArrayLike) -> NDArray[np.float64]:
    """Steradians (...) that a square view of full angle ``fov`` (...) [rad] covers."""
    half = np.sin(0.5 * np.asarray(fov, np.float64))
    angle: NDArray[np.float64] = 4.0 * np.arcsin(np.clip(half**2, 0.0, 1.0))
    return angle


def tree_length(points: NDArray[np.float64]) -> float:
    """Length of the shortest tree over points (K, 3), by Prim's algorithm."""
    away = np.linalg.norm(points[:, None] - points[None], axis=2)
    reach, left, total = away[0].copy(), set(range(1, len(points))), 0.0
    while left:
        nearest = min(left, key=lambda i: (reach[i], i))
        total += float(reach[nearest])
        left.remove(nearest)
        reach = np.minimum(reach, away[nearest])
    return total
