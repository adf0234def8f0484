"""Geodesic distances to goals that are prepared once and asked about at every step.

Before: :mod:`.navmesh_set`, :mod:`.geodesic`, :mod:`.windows`. After: rewards and the shortest-path follower.
"""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Array, JSONObject
from prnav.arguments import has_fractions, whole
from prnav.errors import NavMeshError
from prnav.navmesh import queries, windows
from prnav.navmesh.navmesh_set import NavMeshSet
from prnav.navmesh.pairs import run_search
from prnav.navmesh.scratch import ROOTS, Scratch, ScratchPool

Floats = NDArray[np.float64]

NOWHERE = np.array([-1.0, 0.0, 0.0])  #: target of a search that goes on until nothing is left


class _Pool:
    """Rows of several arrays in pieces, one piece per slot; a piece that outgrows its place moves to the end."""

    def __init__(self, slots: int, rows: int, *columns: tuple[int, type]):
        self.place = np.zeros(slots, np.int64)
        self.room = np.zeros(slots, np.int64)
        self.arrays: list[Array] = [np.empty((rows, width) if width else rows, kind) for width, kind in columns]
        self.used = 0

    def claim(self, slot: int, rows: int) -> slice:
        """Rows for a slot's new content; its old content is lost."""
        if rows > self.room[slot]:
            room = rows + rows // 4
            if self.used + room > len(self.arrays[0]):
                self._compact(slot, room)
            self.place[slot], self.room[slot] = self.used, room
            self.used += room
        return slice(int(self.place[slot]), int(self.place[slot]) + rows)

    def _compact(self, leaving: int, more: int) -> None:
        """Close the gaps that moved pieces have left, and make room for ``more`` rows."""
        self.room[leaving] = 0
        size = max(len(self.arrays[0]), 2 * (int(self.room.sum()) + more))
        fresh = [np.empty((size, *array.shape[1:]), array.dtype) for array in self.arrays]
        used = 0
        for slot in np.flatnonzero(self.room):
            at, room = int(self.place[slot]), int(self.room[slot])
            for new, old in zip(fresh, self.arrays, strict=True):
                new[used : used + room] = old[at : at + room]
            self.place[slot] = used
            used += room
        self.arrays, self.used = fresh, used


class GoalFields:
    """Exact distances to goals, one per slot: prepared once, then answered in about a microsecond per point.

    A prepared goal keeps, per polygon, the windows that shortest paths to it enter through
    (:mod:`prnav.navmesh.geodesic`); a query takes the best of its polygon's. Threads may share it: its calls wait for
    each other.
    """

    def __init__(self, navmesh_set: NavMeshSet, slots: int):
        if isinstance(slots, int) and slots < 1:
            raise NavMeshError(f"GoalFields with {slots} slots hold nothing; valid: 1 or more")
        slots = whole(slots, "slots", 1, 100_000_000, NavMeshError)
        self.navmesh_set = navmesh_set
        self.slots = slots
        self._lock = threading.Lock()
        self._pool = ScratchPool(navmesh_set.surface)
        self._scene = np.full(slots, -1, np.int64)
        self._polygon = np.full(slots, -1, np.int32)
        self._place = np.zeros((slots, 3), np.int64)
        self._start = _Pool(slots, 16, (0, np.int32))
        self._windows = _Pool(slots, 1024, (6, np.float64), (0, np.int32))
        self._roots = _Pool(slots, 1024, (5, np.float64), (2, np.int32))

    def prepare(self, slot_ids: ArrayLike, scene_ids: ArrayLike, goals: ArrayLike) -> None:
        """Set the goals (n, 3) of slots; a goal off the floor is snapped, one with no floor in reach is unreachable.

        Raises:
            NavMeshError: shapes that do not fit, or a slot or scene out of range.
        """
        goals = queries.as_points(goals, "goals")
        if not np.isfinite(goals).all():
            row = int(np.flatnonzero(~np.isfinite(goals).all(axis=1))[0])
            raise NavMeshError(f"goals[{row}] is {goals[row].tolist()}; goals must be finite")
        slots = self._slots(slot_ids, len(goals))
        scenes = queries.as_scenes(scene_ids, len(goals), len(self.navmesh_set))
        surface = self.navmesh_set.surface
        positions, polygons = queries.find_ends(surface, scenes, goals)
        with self._lock:
            scratch = self._pool.take()
            try:
                for i, slot in enumerate(slots.tolist()):
                    scene, polygon = int(scenes[i]), int(polygons[i])
                    self._scene[slot], self._polygon[slot] = scene, -1
                    if polygon >= 0:
                        scratch = self._search(slot, scene, polygon, positions[i], scratch)
                        self._polygon[slot] = polygon
            finally:
                self._pool.give_back(scratch)
                self._place[:, 0] = self._start.place
                self._place[:, 1] = self._windows.place
                self._place[:, 2] = self._roots.place

    def _search(self, slot: int, scene: int, polygon: int, goal: Floats, scratch: Scratch) -> Scratch:
        """Keep the windows of all shortest paths to a floor point in a slot."""
        surface = self.navmesh_set.surface
        count, scratch = run_search(surface, scene, polygon, goal, NOWHERE, scratch)
        polygon_count = int(surface.scene_polygon[scene + 1] - surface.scene_polygon[scene])
        root_count = int(scratch.counts[ROOTS])
        start = self._start.claim(slot, polygon_count + 1)
        rows = self._windows.claim(slot, count)
        roots = self._roots.claim(slot, root_count)
        windows.sort_windows(
            surface, scene, count, scratch,
            self._start.arrays[0][start], self._windows.arrays[0][rows], self._windows.arrays[1][rows],
        )  # fmt: skip
        self._roots.arrays[0][roots] = scratch.roots[:root_count]
        self._roots.arrays[1][roots] = scratch.links[:root_count]
        return scratch

    def query(self, slot_ids: ArrayLike, points: ArrayLike) -> tuple[Floats, Floats]:
        """Distance of points (n, 3) to their slots' goals, (n,) [m], and the next turning point, (n, 3).

        The turning point is the goal itself where it lies in a straight line. A goal on another island, a slot never
        prepared and a point with no floor in reach give inf and NaN. Points off the floor are measured from where
        they snap, those straight above or below it from where they are.
        """
        points = queries.as_points(points)
        slots = self._slots(slot_ids, len(points))
        surface = self.navmesh_set.surface
        distances, corners = np.empty(len(points)), np.empty((len(points), 3))
        with self._lock:
            scenes = np.maximum(self._scene[slots], 0)
            positions, polygons = queries.find_ends(surface, scenes, points)
            windows.query_windows(
                surface, slots, scenes, polygons, positions, self._scene, self._polygon, self._place,
                self._start.arrays[0], self._windows.arrays[0], self._windows.arrays[1],
                self._roots.arrays[0], self._roots.arrays[1], distances, corners,
            )  # fmt: skip
        return distances, corners

    def num_windows(self, slot: int) -> int:
        """How many windows a slot's goal keeps."""
        (slot,) = self._slots(slot, 1).tolist()
        surface = self.navmesh_set.surface
        with self._lock:
            if self._polygon[slot] < 0:
                return 0
            scene = self._scene[slot]
            polygons = int(surface.scene_polygon[scene + 1] - surface.scene_polygon[scene])
            return int(self._start.arrays[0][self._place[slot, 0] + polygons])

    @property
    def nbytes(self) -> int:
        """Memory that prepared goals take [B]."""
        return sum(a.nbytes for pool in (self._start, self._windows, self._roots) for a in pool.arrays)

    def __getstate__(self) -> JSONObject:
        """All but the lock, for copies and pickles."""
        return {name: value for name, value in self.__dict__.items() if name != "_lock"}

    def __setstate__(self, state: JSONObject) -> None:
        """Take over :meth:`__getstate__`'s."""
        self.__dict__.update(state, _lock=threading.Lock())

    def _slots(self, slot_ids: ArrayLike, count: int) -> NDArray[np.int64]:
        slots = np.asarray(slot_ids)
        if has_fractions(slots):
            raise NavMeshError(
                f"slots are {slots.dtype} with fractions; valid: whole numbers from 0 to {self.slots - 1}"
            )
        slots = np.ascontiguousarray(slots, dtype=np.int64).reshape(-1)
        if len(slots) != count:
            raise NavMeshError(f"{len(slots)} slots for {count} points; there must be one per row")
        if len(slots) and (slots.min() < 0 or slots.max() >= self.slots):
            raise NavMeshError(f"slot {slots.min()}..{slots.max()} out of range; valid: 0 to {self.slots - 1}")
        return slots
