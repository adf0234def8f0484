"""Many navigation meshes as one, so that a single call serves agents in any mix of scenes.

Before: :mod:`.navmesh`. After: :mod:`.goal_fields` and the simulator.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Untyped
from prnav.errors import NavMeshError
from prnav.navmesh import queries
from prnav.navmesh.navmesh import NavMesh
from prnav.navmesh.pairs import pair_distances
from prnav.navmesh.scratch import ScratchPool
from prnav.navmesh.surface import concatenate_surfaces


class NavMeshSet:
    """Navigation meshes of several scenes; row i of a query is about scene ``scene_ids[i]`` (an index).

    Answers equal those of the single :class:`NavMesh`, bit for bit, whatever else is in the batch.
    """

    def __init__(self, navmeshes: Sequence[NavMesh]):
        if not navmeshes:
            raise NavMeshError("a NavMeshSet of no scenes cannot answer anything; give at least one NavMesh")
        self.navmeshes = tuple(navmeshes)
        self.surface = concatenate_surfaces([navmesh.surface for navmesh in self.navmeshes])
        self._pool = ScratchPool(self.surface)

    def __deepcopy__(self, memo: dict[int, Untyped]) -> NavMeshSet:
        """Nothing in it ever changes: copies share it."""
        return self

    def __len__(self) -> int:
        return len(self.navmeshes)

    def snap(self, scene_ids: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
        """:meth:`NavMesh.snap`, (N, 3); NaN rows where no floor is in reach."""
        return self.find(scene_ids, points)[0]

    def island_of(self, scene_ids: ArrayLike, points: ArrayLike) -> NDArray[np.int32]:
        """:meth:`NavMesh.island_of`, (N,); -1 where no floor is in reach."""
        return queries.island_of(self.surface, self.find(scene_ids, points)[1])

    def step(
        self, scene_ids: ArrayLike, starts: ArrayLike, ends: ArrayLike, sliding: bool = True
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """:meth:`NavMesh.step`: positions (N, 3), collided (N,)."""
        starts, ends = queries.as_pairs(starts, ends, ("starts", "ends"))
        return queries.move(self.surface, self._scenes(scene_ids, len(starts)), starts, ends, sliding)

    def distances(self, scene_ids: ArrayLike, a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
        """:meth:`NavMesh.distances` of pairs (N, 3), (N,) [m]; inf between islands."""
        a, b = queries.as_pairs(a, b, ("a", "b"))
        return pair_distances(self._pool, self._scenes(scene_ids, len(a)), a, b)

    def clearance(self, scene_ids: ArrayLike, points: ArrayLike, max_radius: float = 2.0) -> NDArray[np.float64]:
        """:meth:`NavMesh.clearance`, (N,) [m]; inf where no floor is in reach."""
        points = queries.as_points(points)
        return queries.clearance(self.surface, self._scenes(scene_ids, len(points)), points, max_radius)

    def find(self, scene_ids: ArrayLike, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Points on the floor (N, 3) and their polygons in :attr:`surface` (N,); NaN and -1 on a miss."""
        points = queries.as_points(points)
        return queries.find(self.surface, self._scenes(scene_ids, len(points)), points)

    def _scenes(self, scene_ids: ArrayLike, count: int) -> NDArray[np.int64]:
        return queries.as_scenes(scene_ids, count, len(self.navmeshes))
