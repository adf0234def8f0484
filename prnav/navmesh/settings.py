"""What a navigation mesh is built for: the body, and the fineness of the result.

Before: nothing. After: :mod:`.build`, which follows them.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NavMeshSettings:
    """Settings of the builder, with Habitat-sim's names, meaning and defaults (``habitat_sim.NavMeshSettings``).

    Quotients are taken in float32, as Habitat does: 0.6 m are 3 cells of 0.2 m, not 2.9999999999999996.
    """

    cell_size: float = 0.05  #: side of a grid cell in the ground plane [m]
    cell_height: float = 0.2  #: height of a grid cell [m]
    agent_height: float = 1.5  #: free height needed above the floor [m]
    agent_radius: float = 0.1  #: the walkable area keeps this distance from walls [m]
    agent_max_climb: float = 0.2  #: highest step that can be climbed [m]
    agent_max_slope: float = 45.0  #: steepest slope that can be walked [degrees]
    region_min_size: float = 20.0  #: islands smaller than the square of this [cells] are dropped
    region_merge_size: float = 20.0  #: regions smaller than the square of this [cells] are merged where possible
    edge_max_len: float = 12.0  #: longest wall edge [m]
    edge_max_error: float = 1.3  #: how far an edge may deviate from the cells' outline [cells]
    verts_per_poly: float = 6.0  #: most corners of a polygon (3 to 6)
    detail_sample_dist: float = 6.0  #: sampling distance of the height detail [cells]; below 0.9 no samples
    detail_sample_max_error: float = 1.0  #: largest height error of the detail mesh [cell heights]
    filter_low_hanging_obstacles: bool = True  #: small obstacles (curbs) can be stepped on
    filter_ledge_spans: bool = True  #: cells at a drop higher than the climb cannot be walked
    filter_walkable_low_height_spans: bool = True  #: floor without free height above it cannot be walked

    def __post_init__(self) -> None:
        """Refuse values that no navigation mesh can be built with.

        Raises:
            ValueError: a value is not finite or out of its range.
        """
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, bool) and not math.isfinite(value):
                raise ValueError(f"{field.name} is {value}; it must be finite")
            if not isinstance(value, bool) and abs(value) > 1e9:
                raise ValueError(f"{field.name} is {value}; it must be at most 1e9")
        for name in ("cell_size", "cell_height", "agent_height"):
            if getattr(self, name) < 1e-4:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least 0.0001 metres")
        for name in ("agent_radius", "agent_max_climb", "region_min_size", "region_merge_size"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be 0 or more")
        for name in ("edge_max_len", "edge_max_error", "detail_sample_dist", "detail_sample_max_error"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be 0 or more")
        if not 0 <= self.agent_max_slope < 90:
            raise ValueError(f"agent_max_slope is {self.agent_max_slope}; it must be in [0, 90) degrees")
        if not 3 <= self.verts_per_poly <= 6 or self.verts_per_poly != int(self.verts_per_poly):
            raise ValueError(f"verts_per_poly is {self.verts_per_poly}; it must be 3, 4, 5 or 6")

    @property
    def walkable_height(self) -> int:
        """Free height needed above the floor [cell heights], rounded up."""
        return math.ceil(np.float32(self.agent_height) / np.float32(self.cell_height))

    @property
    def walkable_climb(self) -> int:
        """Highest step [cell heights], rounded down."""
        return math.floor(np.float32(self.agent_max_climb) / np.float32(self.cell_height))

    @property
    def walkable_radius(self) -> int:
        """Distance kept from walls [cells], rounded up."""
        return math.ceil(np.float32(self.agent_radius) / np.float32(self.cell_size))
