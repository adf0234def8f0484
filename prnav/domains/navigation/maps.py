"""Floor plans kept beside the records, so that trajectories can be drawn where neither mesh nor navmesh is at hand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import RecordError
from prnav.files import atomic_path
from prnav.navmesh.polymesh import FLAG_WALK
from prnav.stored_arrays import BROKEN, Like, check_lengths, read_arrays

if TYPE_CHECKING:
    from prnav.navmesh import NavMesh

MAPS = "maps.npz"
_STORED = {
    "scene_id": Like("U", 1),
    "height": Like("f", 1),
    "origin": Like("f", 2),
    "metres_per_pixel": Like("f", 1),
}
STOREY = 1.5
"""Positions whose heights differ by less than this [m] are drawn on one floor."""
HALF_STOREY = 1.0
"""What is higher or lower than a floor by less than this [m] is drawn on it: its half of the stairs."""


@dataclass(frozen=True, eq=False)
class FloorMap:
    """Where one floor of a scene can be walked."""

    scene_id: str
    height: float
    """Height of the floor [m]."""
    origin: tuple[float, float]
    """x and z [m] of the corner of pixel (0, 0)."""
    metres_per_pixel: float
    walkable: NDArray[np.bool_]
    """Cells an agent can stand in, shape (H, W): rows along +z, columns along +x."""

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Sides of the map [m] as matplotlib's ``imshow`` takes them: left, right (x), bottom, top (z)."""
        rows, columns = self.walkable.shape
        x, z = self.origin
        return x, x + columns * self.metres_per_pixel, z + rows * self.metres_per_pixel, z


def floor_heights(heights: ArrayLike) -> list[float]:
    """Heights of the floors that points at these heights [m] stand on, lowest first; the median of each floor's."""
    ordered = np.sort(np.asarray(heights, dtype=np.float64).ravel())
    floors: list[float] = []
    while len(ordered):
        count = int(np.searchsorted(ordered, ordered[0] + STOREY, side="right"))
        floors.append(float(np.median(ordered[:count])))
        ordered = ordered[count:]
    return floors


def make_maps(
    scenes: Iterable[tuple[str, NavMesh, ArrayLike]],
    metres_per_pixel: float = 0.05,
) -> list[FloorMap]:
    """Floor plans of scenes.

    Args:
        scenes: (scene_id, navmesh, heights [m] of the starts and goals in it).
        metres_per_pixel: size of a cell.
    """
    maps = []
    for scene_id, navmesh, heights in scenes:
        low, high = navmesh.bounds
        mesh = navmesh.mesh
        walk = np.repeat((mesh.flags & FLAG_WALK).astype(np.bool_), np.diff(mesh.detail_start))
        triangles = mesh.all_vertices[mesh.detail_triangles[walk]]
        rows, columns = (max(1, math.ceil((high[axis] - low[axis]) / metres_per_pixel)) for axis in (2, 0))
        shape = (rows, columns)
        for height in floor_heights(heights):
            near = np.abs(triangles[..., 1].mean(axis=1) - height) < HALF_STOREY
            walkable = rasterise(triangles[near][..., [0, 2]], (low[0], low[2]), metres_per_pixel, shape)
            maps.append(FloorMap(scene_id, height, (float(low[0]), float(low[2])), metres_per_pixel, walkable))
    return maps


def rasterise(
    triangles: NDArray[np.float64], origin: tuple[float, float], size: float, shape: tuple[int, int]
) -> NDArray[np.bool_]:
    """Cells (H, W) whose centres lie in any of the triangles (T, 3, 2), x and z [m]; ``size`` is a cell's side [m]."""
    cells = np.zeros(shape, dtype=np.bool_)
    for corners in (triangles - origin) / size - 0.5:  # in cells: cell (row, column) has its centre at (column, row)
        first = np.maximum(np.ceil(corners.min(axis=0) - 1e-9).astype(int), 0)
        last = np.minimum(np.floor(corners.max(axis=0) + 1e-9).astype(int) + 1, shape[::-1])
        if (last <= first).any():
            continue
        x, z = np.arange(first[0], last[0])[None, :], np.arange(first[1], last[1])[:, None]
        following = np.roll(corners, -1, axis=0)
        edges = following - corners
        sides = [dx * (z - z0) - dz * (x - x0) for (x0, z0), (dx, dz) in zip(corners, edges, strict=True)]
        inside = np.all([side >= -1e-9 for side in sides], axis=0) | np.all([side <= 1e-9 for side in sides], axis=0)
        cells[first[1] : last[1], first[0] : last[0]] |= inside
    return cells


def save_maps(directory: str | Path, maps: Sequence[FloorMap]) -> None:
    """Write ``maps.npz`` into an evaluation's folder."""
    arrays: dict[str, NDArray[np.generic]] = {
        "scene_id": np.array([m.scene_id for m in maps], dtype=np.str_),
        "height": np.array([m.height for m in maps]),
        "origin": np.array([m.origin for m in maps]).reshape(-1, 2),
        "metres_per_pixel": np.array([m.metres_per_pixel for m in maps]),
    }
    arrays |= {f"walkable_{i}": m.walkable for i, m in enumerate(maps)}
    with atomic_path(Path(directory) / MAPS) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def load_maps(directory: str | Path) -> list[FloorMap]:
    """Floor plans of an evaluation.

    Raises:
        RecordError: the file is missing or broken.
    """
    path = Path(directory) / MAPS
    try:
        stored = read_arrays(path)
        for name, like in _STORED.items():
            like.check(name, stored[name])
        count = len(stored["scene_id"])
        check_lengths(maps=(count, {name: stored[name] for name in _STORED}))
        if stored["origin"].shape[1] != 2 or (stored["metres_per_pixel"] <= 0).any():
            raise ValueError("'origin' has no two columns, or 'metres_per_pixel' is not above 0")
        plans = [stored[f"walkable_{i}"] for i in range(count)]
        for i, plan in enumerate(plans):
            Like("b", 2).check(f"walkable_{i}", plan)
        columns = zip(
            stored["scene_id"], stored["height"], stored["origin"], stored["metres_per_pixel"], plans, strict=True
        )
        return [FloorMap(str(s), float(h), (float(x), float(z)), float(m), plan) for s, h, (x, z), m, plan in columns]
    except BROKEN as error:
        raise RecordError(f"{path}: cannot be read ({error}); evaluate again with prnav-eval") from error


def floor_of(maps: Sequence[FloorMap], scene_id: str, height: float) -> FloorMap | None:
    """The map of a scene whose floor is nearest to ``height`` [m]; None where the scene has none."""
    floors = [m for m in maps if m.scene_id == scene_id]
    return min(floors, key=lambda m: abs(m.height - height)) if floors else None
