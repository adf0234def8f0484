"""Batched queries on a :class:`~prnav.navmesh.surface.Surface`: arrays in, arrays out, rows independent of each other.

:class:`~prnav.navmesh.navmesh.NavMesh` and :class:`~prnav.navmesh.navmesh_set.NavMeshSet` are both thin layers on
these functions, which is why they give the same answers. ``scenes`` (N,) says which scene each row belongs to.

Before: :mod:`.locate` and :mod:`.step`. After: :mod:`.navmesh` and :mod:`.navmesh_set`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.arguments import floats, has_fractions
from prnav.errors import NavMeshError
from prnav.navmesh import locate, step
from prnav.navmesh.planar import TOUCH
from prnav.navmesh.surface import Surface

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

COLLISION = 1e-5  #: Habitat's: squared lengths differing by less are no collision [m2]
BESIDE = 1e-3  #: farther from the floor in the ground plane, a start is beside it and no rounding error [m]
NUDGE = 1e-4  #: Habitat's: how far a move that ends on an infinitely thin wall is moved off it [m]


def as_points(points: ArrayLike, name: str = "points") -> Floats:
    """Points as a C-contiguous float64 array (N, 3); a single point becomes one row.

    Raises:
        NavMeshError: no numbers, or the last dimension is not 3.
    """
    array = np.ascontiguousarray(floats(points, name, NavMeshError))
    if array.ndim == 1 and array.size == 0:
        return array.reshape(0, 3)
    if array.ndim == 0 or array.shape[-1] != 3 or array.ndim > 2:
        raise NavMeshError(f"{name} have shape {array.shape}; valid: (N, 3), x y z in metres")
    return array.reshape(-1, 3)


def as_scenes(scenes: ArrayLike, count: int, number: int) -> NDArray[np.int64]:
    """Scene indices as an int64 array (N,).

    Raises:
        NavMeshError: another length, or an index out of range.
    """
    array = np.asarray(scenes)
    if has_fractions(array):
        raise NavMeshError(
            f"scene indices are {array.dtype} with fractions; valid: whole numbers from 0 to {number - 1}"
        )
    array = np.ascontiguousarray(array, dtype=np.int64).reshape(-1)
    if len(array) != count:
        raise NavMeshError(f"{len(array)} scene indices for {count} rows; there must be one per row")
    if len(array) and (array.min() < 0 or array.max() >= number):
        raise NavMeshError(f"scene index {array.min()}..{array.max()} out of range; valid: 0 to {number - 1}")
    return array


def as_pairs(a: ArrayLike, b: ArrayLike, names: tuple[str, str]) -> tuple[Floats, Floats]:
    """Two arrays of points with as many rows; where one is a single point, it stands for as many.

    Raises:
        NavMeshError: they have other numbers of rows.
    """
    one, two = as_points(a, names[0]), as_points(b, names[1])
    if len(one) != len(two) and 1 not in (len(one), len(two)):
        raise NavMeshError(f"{names[0]} are {len(one)} points and {names[1]} are {len(two)}; there must be as many")
    one, two = np.broadcast_arrays(one, two)
    return np.ascontiguousarray(one), np.ascontiguousarray(two)


def find(surface: Surface, scenes: NDArray[np.int64], points: Floats) -> tuple[Floats, Ints]:
    """Points on the floor (N, 3) and their polygons (N,); NaN and -1 where no floor is in reach."""
    positions = np.empty_like(points)
    polygons = np.empty(len(points), np.int32)
    locate.locate_points(surface, scenes, points, positions, polygons)
    return positions, polygons


def find_ends(surface: Surface, scenes: NDArray[np.int64], points: Floats) -> tuple[Floats, Ints]:
    """Ends of shortest paths (N, 3) and their polygons (N,).

    As in Habitat, a point straight above or below its polygon keeps its own height: its path starts there. Any other
    starts on the polygon's own nearest edge, whose height the detail mesh may differ from.
    """
    positions, polygons = find(surface, scenes, points)
    offset = np.abs(positions - points)
    over = (offset[:, 0] <= TOUCH) & (offset[:, 2] <= TOUCH)  # False on NaN
    positions[over, 1] = points[over, 1]
    locate.place_on_edges(surface, np.where(over, -1, polygons), positions)
    return positions, polygons


def island_of(surface: Surface, polygons: Ints) -> Ints:
    """Island of polygons (N,), -1 for polygon -1."""
    return np.where(polygons >= 0, surface.island[polygons], -1) if len(surface.island) else polygons


def in_sight(surface: Surface, p: Ints, a: Floats, q: Ints, b: Floats) -> NDArray[np.bool_]:
    """Whether straight segments between floor points a and b (N, 3) in polygons p and q stay on the floor, (N,)."""
    reached, last = np.empty_like(a), np.empty(len(a), np.int32)
    step.walk_straight(surface, p, a, b, reached, last)
    return (last >= 0) & (last == q)


def clearance(surface: Surface, scenes: NDArray[np.int64], points: Floats, radius: float) -> Floats:
    """Distance to the nearest wall (N,) [m], at most ``radius``; inf where no floor is in reach."""
    positions, polygons = find(surface, scenes, points)
    distances = np.empty(len(points))
    locate.wall_distances(surface, polygons, positions, float(radius), distances)
    return distances


def move(
    surface: Surface, scenes: NDArray[np.int64], starts: Floats, ends: Floats, sliding: bool
) -> tuple[Floats, NDArray[np.bool_]]:
    """Where moves end (N, 3) and whether something was in the way (N,).

    As in Habitat, a start with no floor in reach stays where it is, and so does one that meets a wall while its
    wanted end lies nearest to another island. Without sliding, one beside the floor is put on the floor's edge and
    goes no farther in this step.
    """
    origins, polygons = find(surface, scenes, starts)
    positions = starts.copy()
    last = np.empty(len(starts), np.int32)
    if step.walk_straight(surface, polygons, origins, ends, positions, last):
        rows = np.flatnonzero(last < -1)
        last[rows] = -2 - last[rows]
        _, beyond = find(surface, scenes[rows], ends[rows])
        stuck = (beyond < 0) | (surface.island[beyond] != surface.island[polygons[rows]])
        positions[rows[stuck]] = starts[rows[stuck]]
        last[rows[stuck]] = -1
        rows = rows[~stuck]
        if sliding:
            step.slide(surface, rows, polygons, origins, ends, positions, last)
        locate.place_on_floor(surface, last, positions)
        _, found = find(surface, scenes[rows], positions[rows])
        again = np.full(len(starts), -1, np.int32)
        again[rows] = found
        step.nudge(surface, rows, last, again, positions, NUDGE)
    if not sliding:
        beside = (last >= 0) & (np.hypot(*(starts - origins)[:, [0, 2]].T) > BESIDE)
        positions[beside], last[beside] = origins[beside], polygons[beside]
    locate.place_on_floor(surface, last, positions)
    wanted, moved = ends - starts, positions - starts
    collided = np.einsum("ij,ij->i", moved, moved) + COLLISION < np.einsum("ij,ij->i", wanted, wanted)
    return positions, collided
