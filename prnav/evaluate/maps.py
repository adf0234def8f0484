"""Floor plans kept beside the records, so that trajectories can be drawn where neither mesh nor navmesh is at hand."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import RecordError
from prnav.files import atomic_path

if TYPE_CHECKING:
    from prnav.navmesh import NavMesh

MAPS = "maps.npz"
STOREY = 1.5
"""Positions whose heights differ by less than this [m] are drawn on one floor."""


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
        low = navmesh.bounds[0]
        for height in floor_heights(heights):
            walkable = navmesh.topdown(height, metres_per_pixel)
            maps.append(FloorMap(scene_id, height, (float(low[0]), float(low[2])), metres_per_pixel, walkable))
    return maps


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
        with np.load(path, allow_pickle=False) as stored:
            return [
                FloorMap(str(scene), float(height), (float(x), float(z)), float(size), stored[f"walkable_{i}"])
                for i, (scene, height, (x, z), size) in enumerate(
                    zip(stored["scene_id"], stored["height"], stored["origin"], stored["metres_per_pixel"], strict=True)
                )
            ]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise RecordError(f"{path}: cannot be read ({error}); evaluate again with prnav-eval") from error


def floor_of(maps: Sequence[FloorMap], scene_id: str, height: float) -> FloorMap | None:
    """The map of a scene whose floor is nearest to ``height`` [m]; None where the scene has none."""
    floors = [m for m in maps if m.scene_id == scene_id]
    return min(floors, key=lambda m: abs(m.height - height)) if floors else None
