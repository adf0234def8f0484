"""The navigation mesh of one scene, and all one can ask of it.

Before: :mod:`.queries` and :mod:`.pairs`. After: :mod:`.navmesh_set`, and all that asks where one can go.
"""

from __future__ import annotations

import dataclasses
import math
import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.arguments import number, whole
from prnav.cache import cache_key, cached_arrays
from prnav.errors import NavMeshError
from prnav.files import write_bytes
from prnav.navmesh import queries
from prnav.navmesh.detour import read_navmesh
from prnav.navmesh.detour_write import navmesh_bytes
from prnav.navmesh.pairs import located_distances, pair_distances, shortest_path
from prnav.navmesh.polymesh import PolyMesh
from prnav.navmesh.scratch import ScratchPool
from prnav.navmesh.settings import NavMeshSettings
from prnav.navmesh.surface import Surface, build_surface, triangle_areas

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

BUILDER_VERSION = 2  #: raised when the builder's result changes: part of the key of whatever is derived from it


MOST_POINTS = 100_000_000  #: that are drawn at once: 2.4 GB
MOST_CELLS = 1 << 26  #: of a map: 1.6 GB of points


class Island(NamedTuple):
    """A connected part of the floor."""

    area: float  #: [m2]
    radius: float  #: largest distance of its corners from their mean, as Habitat measures it [m]


class FloorPoints(NamedTuple):
    """Points and where on the floor they are, from :meth:`NavMesh.locate`."""

    points: NDArray[np.float64]  #: as given, (N, 3) [m]
    positions: NDArray[np.float64]  #: where paths to them end, (N, 3) [m]; NaN where no floor is in reach
    polygons: NDArray[np.int32]  #: (N,); -1 where no floor is in reach
    islands: NDArray[np.int32]  #: (N,); -1 where no floor is in reach

    def take(self, rows: NDArray[np.int64]) -> FloorPoints:
        """Some of the points."""
        return FloorPoints(self.points[rows], self.positions[rows], self.polygons[rows], self.islands[rows])


@dataclass(frozen=True, eq=False)
class NavMesh:
    """The walkable floor of a scene.

    Points are world positions (N, 3) [m], float64. A point off the floor stands for the floor point nearest to it as
    Habitat finds it (:meth:`snap`); where none is in reach, positions are NaN and distances are inf.
    """

    mesh: PolyMesh
    settings: NavMeshSettings = NavMeshSettings()
    file_tiles: tuple[int, bytes, bytes] | None = None  #: as read from a file: number of tiles, set header, tiles

    def __post_init__(self) -> None:
        """Refuse a mesh that no agent can stand on.

        Raises:
            NavMeshError: no polygon can be walked.
        """
        if not len(self.islands):
            raise NavMeshError("navmesh has no polygon that can be walked; check the scene's up axis and the settings")

    @classmethod
    def build(cls, scene: SceneMesh, settings: NavMeshSettings = NavMeshSettings()) -> NavMesh:  # noqa: B008 (frozen)
        """Navigation mesh of a scene's mesh.

        Raises:
            NavMeshError: the scene has no floor that the settings' body can stand on.
        """
        return cls(_build(scene, settings), settings)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> NavMesh:
        """Navigation mesh from a ``.navmesh`` file as Habitat writes it (MSET version 1 or 2, any number of tiles).

        Raises:
            NavMeshError: the file is missing or broken, or nothing in it can be walked.
        """
        stored = read_navmesh(os.fspath(path))
        try:
            return cls(stored.mesh, stored.settings, (stored.tiles, stored.header, stored.data))
        except NavMeshError as error:
            raise NavMeshError(f"navmesh {os.fspath(path)}: {error}") from error

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write an MSET version 2 file that Habitat reads; tiles that came from a file are written as they were."""
        write_bytes(path, navmesh_bytes(self.mesh, self.settings, self.file_tiles))

    @cached_property
    def surface(self) -> Surface:
        """The arrays that queries read."""
        return build_surface(self.mesh, self.settings)

    @cached_property
    def islands(self) -> tuple[Island, ...]:
        """Connected parts of the floor, numbered as :meth:`island_of` does: in the order of their first polygons."""
        s = self.surface
        areas = self._polygon_areas()
        corner_island = s.island[s.polygon]
        result = []
        for i in range(int(s.island.max(initial=-1)) + 1):
            points = s.corner[corner_island == i]
            radius = np.linalg.norm(points - points.mean(axis=0), axis=1).max()
            result.append(Island(float(areas[s.island == i].sum()), float(radius)))
        return tuple(result)

    @property
    def area(self) -> float:
        """Area of the floor [m2], slopes measured along the slope."""
        return sum(island.area for island in self.islands)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lower and upper corner of the mesh this was built from, (2, 3) [m]."""
        return self.mesh.bounds

    def snap(self, points: ArrayLike) -> NDArray[np.float64]:
        """Nearest points on the floor, (N, 3); NaN rows where none is in a box of half extents 2, 4, 2 m."""
        return self._find(points)[0]

    def island_of(self, points: ArrayLike) -> NDArray[np.int32]:
        """Island that each point is on or snaps to, (N,); -1 where none is in reach."""
        return queries.island_of(self.surface, self._find(points)[1])

    def is_navigable(self, points: ArrayLike, max_y_delta: float = 0.5) -> NDArray[np.bool_]:
        """Whether points are on the floor, (N,): within 1 cm in the ground plane and ``max_y_delta`` [m] in height."""
        points = queries.as_points(points)
        max_y_delta = number(max_y_delta, "max_y_delta", 0.0, math.inf, NavMeshError)
        found = self._find(points)[0]
        offset = found - points
        on_floor = np.hypot(offset[:, 0], offset[:, 2]) <= 1e-2
        return on_floor & (np.abs(offset[:, 1]) <= max_y_delta)  # False on NaN

    def random_points(self, n: int, seed: int | np.random.Generator = 0) -> NDArray[np.float64]:
        """Points uniform by area, (n, 3); the first rows do not depend on ``n``.

        Raises:
            NavMeshError: ``n`` or ``seed`` is not a whole number of at least 0, or ``n`` is beyond :data:`MOST_POINTS`.
        """
        n = whole(n, "n", 0, MOST_POINTS, NavMeshError, "they would take gigabytes")
        if isinstance(seed, np.random.Generator):
            generator = seed
        else:
            generator = np.random.Generator(np.random.PCG64(whole(seed, "seed", 0, 2**128, NavMeshError)))
        return self.place(generator.random((n, 3)))

    def place(self, numbers: NDArray[np.float64]) -> NDArray[np.float64]:
        """Floor points (N, 3) of numbers (N, 3) in [0, 1): uniform numbers give points uniform by area."""
        s, weights = self.surface, self._cumulated_area
        pick, u, v = numbers.T
        triangle = np.minimum(np.searchsorted(weights, pick * weights[-1], side="right"), len(weights) - 1)
        a, b, c = s.detail[triangle].reshape(-1, 3, 3).transpose(1, 0, 2)
        root = np.sqrt(u)[:, None]
        return (1.0 - root) * a + root * (1.0 - v[:, None]) * b + root * v[:, None] * c

    def step(
        self, starts: ArrayLike, ends: ArrayLike, sliding: bool = True
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Move from ``starts`` towards ``ends``: positions (N, 3), and whether something was in the way (N,).

        Without sliding a move ends where it meets a wall; with sliding it goes on along it (:mod:`.step`). As in
        Habitat, collided means that the agent moved less far than it wanted to.
        """
        starts, ends = queries.as_pairs(starts, ends, ("starts", "ends"))
        return queries.move(self.surface, _zeros(len(starts)), starts, ends, sliding)

    def distance(self, a: ArrayLike, b: ArrayLike) -> float:
        """Geodesic distance between two points [m]; inf between islands and where no floor is in reach."""
        return float(self.distances(a, b)[0])

    def distances(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
        """Geodesic distances of pairs, (N,) [m]: ``a`` and ``b`` are (N, 3), or one of them a single point.

        Exact: the way is the shortest in the ground plane, its length the sum of straight segments in space between
        its turning points. An end straight above or below the floor keeps its height, as in Habitat; any other end off
        the floor is where it snaps to. inf between islands and where no floor is in reach.
        """
        a, b = queries.as_pairs(a, b, ("a", "b"))
        return pair_distances(self._pool, _zeros(len(a)), a, b)

    def locate(self, points: ArrayLike) -> FloorPoints:
        """Points found on the floor once, for several questions about their distances."""
        points = queries.as_points(points)
        positions, polygons = queries.find_ends(self.surface, _zeros(len(points)), points)
        return FloorPoints(points, positions, polygons, queries.island_of(self.surface, polygons))

    def located_distances(self, a: FloorPoints, b: FloorPoints) -> NDArray[np.float64]:
        """:meth:`distances` of points that are located, (N,) [m]."""
        scenes = _zeros(len(a.points))
        return located_distances(self._pool, scenes, a.polygons, a.positions, b.polygons, b.positions)

    def in_sight(self, a: FloorPoints, b: FloorPoints) -> NDArray[np.bool_]:
        """Whether the straight segment between located points stays on the floor, (N,)."""
        return queries.in_sight(self.surface, a.polygons, a.positions, b.polygons, b.positions)

    def path(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
        """Turning points of the shortest path from ``a`` to ``b``, both ends included, (M, 3).

        No rows where there is no path.
        """
        start, end = queries.as_points(a, "a"), queries.as_points(b, "b")
        if len(start) != 1 or len(end) != 1:
            raise NavMeshError(f"a path is from one point to one point, not from {len(start)} to {len(end)}")
        return shortest_path(self._pool, 0, start[0], end[0])

    def clearance(self, points: ArrayLike, max_radius: float = 2.0) -> NDArray[np.float64]:
        """Distance to the nearest wall in the ground plane, (N,) [m], at most ``max_radius``; inf off the floor.

        Habitat's ``distance_to_closest_obstacle`` with its default radius.
        """
        points = queries.as_points(points)
        max_radius = number(max_radius, "max_radius", 0.0, 1e6, NavMeshError)
        return queries.clearance(self.surface, _zeros(len(points)), points, max_radius)

    def topdown(self, height: float, metres_per_pixel: float = 0.05, max_y_delta: float = 0.5) -> NDArray[np.bool_]:
        """Which cells of a map are floor near a height [m], (H, W): rows along z, columns along x.

        Pixel (0, 0) is the lower corner of :attr:`bounds`; a cell is its lower corner's answer to
        :meth:`is_navigable`, as Habitat's ``get_topdown_view`` has it (positions add up in float32 as there).
        """
        height = number(height, "height", -1e9, 1e9, NavMeshError)
        low, high = self.bounds.astype(np.float32)
        pixel = np.float32(number(metres_per_pixel, "metres_per_pixel", 0.0, 1e9, NavMeshError))
        if not pixel > 0:
            raise NavMeshError(f"metres_per_pixel is {metres_per_pixel}; it must be above 0")
        with np.errstate(over="ignore"):
            cells = [float((high[axis] - low[axis]) / pixel) for axis in (0, 2)]
        if not (cells[0] + 1) * (cells[1] + 1) <= MOST_CELLS:
            raise NavMeshError(
                f"metres_per_pixel is {metres_per_pixel}; a map of {cells[0]:.3g} x {cells[1]:.3g} cells has more than "
                f"{MOST_CELLS}"
            )
        columns, rows = int(cells[0]), int(cells[1])
        x = np.add.accumulate(np.concatenate([low[:1], np.full(max(columns - 1, 0), pixel)]), dtype=np.float32)
        z = np.add.accumulate(np.concatenate([low[2:], np.full(max(rows - 1, 0), pixel)]), dtype=np.float32)
        x, z = x[:columns], z[:rows]
        points = np.stack(np.broadcast_arrays(x[None, :], np.float32(height), z[:, None]), axis=-1)
        return self.is_navigable(points.reshape(-1, 3), max_y_delta).reshape(rows, columns)

    @cached_property
    def _cumulated_area(self) -> NDArray[np.float64]:
        """Area of the detail triangles that can be walked, added up, (T,) [m2]."""
        s = self.surface
        polygon = np.repeat(np.arange(len(s.island)), np.diff(s.detail_start))
        return np.cumsum(np.where(s.island[polygon] >= 0, triangle_areas(s.detail), 0.0))

    @cached_property
    def _pool(self) -> ScratchPool:
        return ScratchPool(self.surface)

    def _polygon_areas(self) -> NDArray[np.float64]:
        s = self.surface
        polygon = np.repeat(np.arange(len(s.island)), np.diff(s.detail_start))
        areas = np.bincount(polygon, weights=triangle_areas(s.detail), minlength=len(s.island))
        return areas.astype(np.float64)

    def _find(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        points = queries.as_points(points)
        return queries.find(self.surface, _zeros(len(points)), points)


def load_navmesh(scene: SceneMesh, settings: NavMeshSettings = NavMeshSettings()) -> NavMesh:  # noqa: B008 (frozen)
    """:meth:`NavMesh.build`, kept in the cache.

    Raises:
        NavMeshError: the scene has no floor that the settings' body can stand on.
    """
    key = cache_key(BUILDER_VERSION, scene.hash, dataclasses.asdict(settings))
    arrays = cached_arrays("navmesh", key, lambda: _build(scene, settings).to_arrays())
    return NavMesh(PolyMesh(**arrays), settings)


def _build(scene: SceneMesh, settings: NavMeshSettings) -> PolyMesh:
    from prnav.navmesh.build import build_polygons

    try:
        mesh = build_polygons(scene.vertices, scene.faces, settings)
    except NavMeshError as error:
        raise NavMeshError(f"scene {scene.name}: {str(error).removeprefix('navmesh: ')}") from error
    if not mesh.num_polygons:
        raise NavMeshError(
            f"scene {scene.name}: no floor that a body of radius {settings.agent_radius} m and height "
            f"{settings.agent_height} m can stand on; check the up axis and the navmesh settings"
        )
    # coordinates as a file holds them, so that a navmesh saved and loaded is the same to the last bit
    rounded = {
        name: getattr(mesh, name).astype(np.float32).astype(np.float64)
        for name in ("vertices", "detail_vertices", "bounds")
    }
    return dataclasses.replace(mesh, **rounded)


def _zeros(count: int) -> NDArray[np.int64]:
    return np.zeros(count, np.int64)
