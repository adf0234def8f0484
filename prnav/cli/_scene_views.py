"""Pictures of a scene: views from inside, maps of its floors, and both on one sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array
from prnav.scene import SceneMesh

if TYPE_CHECKING:
    from prnav.navmesh import NavMesh

_EYE = 1.25
_FOV = math.radians(90.0)


def views(scene: SceneMesh, navmesh: NavMesh, count: int, size: int, seed: int) -> NDArray[np.uint8]:
    """Views (count, size, size, 3) from places spread over the islands that matter, each towards the most open side.

    Those indoors come first, then the others, large ones before small ones; see :func:`island_views`.
    """
    from prnav.navmesh.cover import indoor_floors
    from prnav.render import Renderer

    renderer = Renderer([scene])
    points = navmesh.random_points(max(4000, 8 * count), seed)
    islands = navmesh.island_of(points)
    wanted = island_views(navmesh, indoor_floors(navmesh, scene).islands, count)
    chosen = [_spread(points[islands == island], number) for island, number in wanted if (islands == island).any()]
    places = np.concatenate(chosen)
    yaws = np.arange(12) * (2.0 * math.pi / 12.0)
    pose = np.array([0.0, _EYE, 0.0, 0.0, math.radians(-8.0), 0.0, _FOV])
    # the open side is the one with the largest median depth in a small picture
    tries = len(places) * len(yaws)
    depth = renderer.depth(
        np.zeros(tries, dtype=np.int64),
        np.repeat(places, len(yaws), axis=0),
        np.tile(yaws, len(places)),
        np.broadcast_to(pose, (tries, 1, 7)),
        size=8,
    )
    capped = np.median(np.minimum(depth, 30.0).reshape(len(places), len(yaws), -1), axis=2)
    best = yaws[np.argmax(capped, axis=1)]
    designs = np.broadcast_to(pose, (len(places), 1, 7))
    images = renderer.read(np.zeros(len(places), dtype=np.int64), places, best, designs, grid=size)
    return np.rint(images[:, 0] * 255.0).astype(np.uint8)


def island_views(navmesh: NavMesh, indoors: NDArray[np.bool_], count: int) -> list[tuple[int, int]]:
    """Islands to photograph and how often, those indoors first, then by area: one each, the rest by area.

    An island matters where episodes may be on it: from a radius of 1.5 m on; where there is none, the largest does.
    """
    islands = navmesh.islands
    by_area = sorted(range(len(islands)), key=lambda k: (not indoors[k], -islands[k].area))
    order = [k for k in by_area if islands[k].radius >= 1.5] or by_area[:1]
    order = order[:count]
    inside = [k for k in order if indoors[k]] or order
    views = dict.fromkeys(order, 1)
    for _ in range(count - len(order)):
        most = max(inside, key=lambda k: islands[k].area / views[k])
        views[most] += 1
    return list(views.items())


def _spread(places: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """``count`` places far from each other: each the farthest from those before it."""
    chosen = [0]
    distance = np.linalg.norm(places - places[0], axis=1)
    while len(chosen) < min(count, len(places)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return places[chosen]


def floor_levels(navmesh: NavMesh) -> list[float]:
    """Heights of the floors [m], lowest first: levels that hold at least a twelfth of the walkable area each."""
    heights = navmesh.random_points(4000, 0)[:, 1]
    bins = np.floor((heights - heights.min()) / 0.2).astype(np.int64)
    counts = np.bincount(bins)
    levels: list[float] = []
    for k in np.flatnonzero(counts >= len(heights) / 12):
        level = float(np.median(heights[bins == k]))
        if not levels or level - levels[-1] > 1.0:
            levels.append(level)
    return levels or [float(np.median(heights))]


def floor_map(navmesh: NavMesh, level: float, size: int) -> NDArray[np.uint8]:
    """The walkable floor near a height [m], white on grey, (size, size, 3)."""
    low, high = navmesh.bounds
    scale = float(max(high[0] - low[0], high[2] - low[2])) / (size - 8)
    walkable = navmesh.topdown(level, scale)
    picture = np.full((size, size, 3), 70, dtype=np.uint8)
    rows, columns = min(walkable.shape[0], size), min(walkable.shape[1], size)
    top, left = (size - rows) // 2, (size - columns) // 2
    picture[top : top + rows, left : left + columns][walkable[:rows, :columns]] = 245
    return picture


def contact_sheet(cells: Sequence[Array], gap: int = 4) -> NDArray[np.uint8]:
    """Pictures of one size side by side in a grid that is wider than tall."""
    columns = math.ceil(math.sqrt(len(cells) * 4 / 3))
    rows = math.ceil(len(cells) / columns)
    height, width = cells[0].shape[:2]
    sheet = np.zeros((rows * (height + gap) + gap, columns * (width + gap) + gap, 3), dtype=np.uint8)
    for k, cell in enumerate(cells):
        y, x = gap + k // columns * (height + gap), gap + k % columns * (width + gap)
        sheet[y : y + height, x : x + width] = cell
    return sheet
