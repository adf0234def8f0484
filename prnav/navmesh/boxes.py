"""Bounding boxes of polygons in Detour's whole units, which decide what its searches see.

Detour measures a polygon's box on its detail mesh, where Recast has put the polygon's own corners one cell height
higher than they are in the polygon itself; it counts in cells from the tile's lower corner, in float32. Searching
with the same boxes finds the same polygons at the rim of the search box.

Before: :mod:`.polymesh`. After: :mod:`.surface` and :mod:`.detour_write`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prnav.navmesh.polymesh import PolyMesh

LARGEST = 0xFFFF  #: Detour stores the units in 16 bits


def coarse_boxes(mesh: PolyMesh, cell_size: float, cell_height: float) -> NDArray[np.int32]:
    """Lower and upper corner of each polygon's box [cells from the mesh's lower corner], (P, 6)."""
    count = mesh.num_polygons
    if not count:
        return np.zeros((0, 6), np.int32)
    side, rise = np.float32(cell_size), np.float32(cell_height)
    origin = mesh.bounds[0].astype(np.float32)
    grid = np.array([side, rise, side], np.float32)
    offset = np.array([origin[0], origin[1] + rise, origin[2]], np.float32)
    corners = np.round((mesh.vertices.astype(np.float32) - origin) / grid) * grid + offset
    own = corners[mesh.polygon_vertices]
    low = np.minimum.reduceat(own, mesh.polygon_start[:-1])
    high = np.maximum.reduceat(own, mesh.polygon_start[:-1])
    extra = np.flatnonzero(np.diff(mesh.detail_vertex_start))
    if len(extra):
        detail = mesh.detail_vertices.astype(np.float32)
        first = mesh.detail_vertex_start[extra]
        low[extra] = np.minimum(low[extra], np.minimum.reduceat(detail, first))
        high[extra] = np.maximum(high[extra], np.maximum.reduceat(detail, first))
    unit = np.float32(1.0) / side
    both = np.concatenate([(low - origin) * unit, (high - origin) * unit], axis=1)
    return np.clip(both, 0, LARGEST).astype(np.int32)
