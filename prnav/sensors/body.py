"""The body that sensors sit on, and its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import DesignError

ON_SURFACE = 1e-9
"""Points this close to the side [m] count as on it and stay as they are: rounding must not move a sensor twice."""


@dataclass(frozen=True)
class Body:
    """Upright cylinder, feet at the origin; sensors may sit on its side and on its top, not on its sole."""

    radius: float = 0.1
    """Radius [m]."""
    height: float = 1.5
    """Height [m]."""

    def __post_init__(self) -> None:
        for name in ("radius", "height"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise DesignError(f"body: {name} is {value!r}; it must be a positive number of metres")

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Closest points of the surface (side and top), shape (..., 3); points on it stay as they are.

        A point outside goes to the closest point of the cylinder; one below the sole to the lower rim of the side
        next to it. A point inside goes straight out through the side or the top, whichever is nearer, through the
        side if both are as near; from the axis it goes ahead (-z).
        """
        p = np.asarray(points, dtype=np.float64)
        x, y, z = p[..., 0], p[..., 1], p[..., 2]
        reach = np.hypot(x, z)
        on_axis = reach == 0.0
        safe = np.where(on_axis, 1.0, reach)
        level = np.clip(y, 0.0, self.height)
        above = y >= self.height  # over the top: onto it, or onto its rim
        inside = (y > 0.0) & ~above & (reach < self.radius)
        to_top = above | (inside & (self.height - y < self.radius - reach))
        new_reach = np.where(to_top, np.minimum(reach, self.radius), self.radius)
        factor = np.where(np.abs(new_reach - reach) <= ON_SURFACE, 1.0, new_reach / safe)
        ahead = on_axis & ~to_top
        return np.stack(
            [
                np.where(ahead, 0.0, x * factor),
                np.where(to_top, self.height, level),
                np.where(ahead, -self.radius, z * factor),
            ],
            axis=-1,
        )

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Distance to the surface [m], shape (...), never negative."""
        p = np.asarray(points, dtype=np.float64)
        return np.linalg.norm(self.project(p) - p, axis=-1)

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points lie strictly inside, shape (...)."""
        p = np.asarray(points, dtype=np.float64)
        return (np.hypot(p[..., 0], p[..., 2]) < self.radius) & (p[..., 1] > 0.0) & (p[..., 1] < self.height)
