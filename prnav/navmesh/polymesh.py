"""The walkable floor as convex polygons: what the builder and the file reader hand to the queries.

**Orientation.** Polygons are counter-clockwise seen from above (looking along -y, with x to the right and -z up the
page): the signed area ``0.5 * sum(z[k] * x[k+1] - x[k] * z[k+1])`` over the corners is positive, and so a polygon's
normal by the right-hand rule points up. Recast and Detour order their polygons the same way.

Before: :mod:`.build` or :mod:`.detour`. After: :mod:`.surface`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array

FLAG_WALK = 1  #: the polygon can be walked (Habitat's ``POLYFLAGS_WALK``)


@dataclass(frozen=True, eq=False)
class PolyMesh:
    """Convex polygons with their neighbours, and a finer triangulation of each that carries the floor's height.

    Rows of CSR arrays: those of polygon p are ``start[p]:start[p + 1]``.
    """

    vertices: NDArray[np.float64]  #: corners shared between polygons, (V, 3) [m]
    polygon_start: NDArray[np.int32]  #: CSR offsets into polygon_vertices and neighbours, (P + 1,)
    polygon_vertices: NDArray[np.int32]  #: vertex index per corner, (C,)
    neighbours: NDArray[np.int32]  #: polygon across the edge from corner k to the next, (C,); -1 at a wall
    flags: NDArray[np.uint16]  #: Detour's polygon flags, (P,); bit 0 = can be walked
    detail_vertices: NDArray[np.float64]  #: extra vertices of the height detail, grouped by polygon, (D, 3) [m]
    detail_vertex_start: NDArray[np.int32]  #: CSR offsets into detail_vertices, (P + 1,)
    detail_triangles: NDArray[np.int32]  #: indices into :attr:`all_vertices`, (T, 3); same orientation as polygons
    detail_flags: NDArray[np.uint8]  #: Detour's edge flags per triangle, (T,): bits 0, 2, 4 = edge 01, 12, 20 is on the
    #: polygon's outline
    detail_start: NDArray[np.int32]  #: CSR offsets into detail_triangles, (P + 1,)
    bounds: NDArray[np.float64]  #: lower and upper corner of the mesh built from, (2, 3) [m]

    @property
    def num_polygons(self) -> int:
        """Number of polygons P."""
        return len(self.flags)

    @property
    def all_vertices(self) -> NDArray[np.float64]:
        """Corners, then detail vertices, (V + D, 3) [m]: what detail_triangles index."""
        return np.concatenate([self.vertices, self.detail_vertices])

    def polygon(self, index: int) -> NDArray[np.float64]:
        """Corners of one polygon, (n, 3) [m]."""
        first, last = self.polygon_start[index], self.polygon_start[index + 1]
        return self.vertices[self.polygon_vertices[first:last]]

    def polygon_areas(self) -> NDArray[np.float64]:
        """Area of each polygon in the ground plane, (P,) [m2]."""
        x, _, z = self.vertices[self.polygon_vertices].T
        corners = len(self.polygon_vertices)
        following = np.arange(1, corners + 1)
        following[self.polygon_start[1:] - 1] = self.polygon_start[:-1]
        cross = z * x[following] - x * z[following]
        areas = 0.5 * np.bincount(self.polygon_of_corner(), weights=cross, minlength=self.num_polygons)
        return areas.astype(np.float64)

    def polygon_of_corner(self) -> NDArray[np.int32]:
        """Polygon that each entry of polygon_vertices belongs to, (C,)."""
        return np.repeat(np.arange(self.num_polygons, dtype=np.int32), np.diff(self.polygon_start))

    def to_arrays(self) -> dict[str, Array]:
        """The fields by name, as :class:`PolyMesh` takes them."""
        return dict(vars(self))

    @classmethod
    def empty(cls, bounds: NDArray[np.float64]) -> PolyMesh:
        """A mesh of no polygons."""
        return cls(
            vertices=np.zeros((0, 3)),
            polygon_start=np.zeros(1, np.int32),
            polygon_vertices=np.zeros(0, np.int32),
            neighbours=np.zeros(0, np.int32),
            flags=np.zeros(0, np.uint16),
            detail_vertices=np.zeros((0, 3)),
            detail_vertex_start=np.zeros(1, np.int32),
            detail_triangles=np.zeros((0, 3), np.int32),
            detail_flags=np.zeros(0, np.uint8),
            detail_start=np.zeros(1, np.int32),
            bounds=bounds,
        )
