"""The picture of ``prnav-scenes preview --navmesh``: a row per storey with its islands, and distances to a goal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Untyped
from prnav.domains.navigation.maps import floor_heights
from prnav.files import atomic_path
from prnav.navmesh import GoalFields, NavMesh, NavMeshSet
from prnav.navmesh.surface import triangle_areas

SAMPLES = 2000  #: floor points that storeys, goal and start are chosen among
CELLS = 400  #: of the distance field along the longer side of a storey
SIDE = 5.2  #: side of a storey's map if it were square [inches]
SMALL = 0.02  #: storeys with less than this share of the floor are drawn on the one nearest to them


def save_navmesh_picture(navmesh: NavMesh, title: str, path: Path, seed: int = 0) -> int:
    """Draw every storey and write a PNG; how many storeys there are.

    The goal is a random point of the largest island, the path comes from the point farthest from it.
    """
    from matplotlib.figure import Figure

    points = navmesh.random_points(SAMPLES, seed)
    storeys = _storeys(points[:, 1])
    islands = navmesh.island_of(points)
    largest = int(np.argmax([island.area for island in navmesh.islands]))
    reachable = points[islands == largest]
    goal = reachable[0]
    fields = GoalFields(NavMeshSet([navmesh]), 1)
    fields.prepare([0], [0], goal)
    distances, _ = fields.query(np.zeros(len(reachable), np.int64), reachable)
    way = navmesh.path(reachable[np.argmax(distances)], goal)
    low, high = navmesh.bounds[:, [0, 2]]
    span = high - low
    width, height = np.clip(SIDE * span / np.sqrt(span[0] * span[1]), 3.0, 12.0)
    furthest = float(distances.max())
    figure = Figure(figsize=(2 * width + 1.8, height * len(storeys) + 1.2), layout="constrained", dpi=110)
    figure.suptitle(
        f"{title}\n{navmesh.area:,.1f} m² on {len(navmesh.islands)} islands, {navmesh.mesh.num_polygons:,} polygons, "
        f"longest way {furthest:.1f} m",
        fontsize=10,
    )
    axes = figure.subplots(len(storeys), 2, squeeze=False, sharex=True, sharey=True)
    for (left, right), number in zip(axes, reversed(range(len(storeys))), strict=True):
        _draw_islands(left, navmesh, storeys, number)
        image = _draw_field(right, navmesh, fields, storeys, number, furthest)
        _draw_way(right, way, goal, storeys, number)
        left.set(ylabel="z [m]", title=f"islands on the storey at {storeys[number]:.1f} m")
        right.set_title("way and distance to the goal")
        for ax in (left, right):
            ax.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]), aspect="equal")
    for ax in axes[-1]:
        ax.set_xlabel("x [m]")
    figure.colorbar(image, ax=axes[:, 1], label="geodesic distance [m]", shrink=0.8)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png")
    return len(storeys)


def _storeys(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Heights of the storeys [m], lowest first."""
    found = np.array(floor_heights(heights))
    share = np.bincount(_storey(heights, found), minlength=len(found)) / len(heights)
    return found[share >= min(SMALL, float(share.max()))]


def _storey(heights: NDArray[np.float64], storeys: NDArray[np.float64]) -> NDArray[np.int64]:
    """The storey that is nearest in height, (N,)."""
    return np.abs(heights[:, None] - storeys).argmin(axis=1)


def _draw_islands(ax: Untyped, navmesh: NavMesh, storeys: NDArray[np.float64], number: int) -> None:
    """Triangles coloured by island, lower ones first, with the edges of their polygons."""
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection, PolyCollection

    s = navmesh.surface
    triangles = s.detail.reshape(-1, 3, 3)
    island = np.repeat(s.island, np.diff(s.detail_start))
    heights = triangles[..., 1].mean(axis=1)
    rows = np.flatnonzero((island >= 0) & (_storey(heights, storeys) == number))
    rows = rows[np.argsort(heights[rows], kind="stable")]
    rank = np.empty(len(navmesh.islands), np.int64)
    rank[np.argsort([-i.area for i in navmesh.islands], kind="stable")] = np.arange(len(navmesh.islands))
    colours = colormaps["tab20"](np.arange(20))
    shades = [colours[rank[i] % 10 * 2 + rank[i] // 10 % 2] for i in island[rows]]
    ax.add_collection(
        PolyCollection(list(triangles[rows][..., [0, 2]]), facecolors=shades, edgecolors=shades, linewidths=0.3)
    )
    ends = np.stack([s.corner, s.corner[s.following]], axis=1)
    here = (s.island[s.polygon] >= 0) & (_storey(ends[..., 1].mean(axis=1), storeys) == number)
    for chosen, colour, thickness in ((here & (s.twin >= 0), "0.45", 0.25), (here & (s.twin < 0), "black", 0.7)):
        ax.add_collection(LineCollection(ends[chosen][..., [0, 2]], colors=colour, linewidths=thickness))
    ax.set_facecolor("0.93")
    for i in np.unique(island[rows]):
        mine = rows[island[rows] == i]
        if navmesh.islands[i].area > max(5.0, 0.01 * navmesh.area):
            area = triangle_areas(s.detail[mine])
            x, z = np.average(triangles[mine].mean(axis=1)[:, [0, 2]], axis=0, weights=area + 1e-9)
            ax.text(x, z, f"{navmesh.islands[i].area:.0f} m²", ha="center", va="center", fontsize=8, clip_on=True)


def _draw_field(
    ax: Untyped, navmesh: NavMesh, fields: GoalFields, storeys: NDArray[np.float64], number: int, furthest: float
) -> Untyped:
    """Distances of a storey's cells as a picture with lines of equal distance; white where there is no way."""
    low, high = navmesh.bounds
    size = max(0.03, float(max(high[0] - low[0], high[2] - low[2])) / CELLS)
    x, z = (np.arange(low[axis] + size / 2, high[axis], size) for axis in (0, 2))
    cells = np.stack([*np.meshgrid(x, z)], axis=-1).reshape(-1, 2)
    points = np.insert(cells, 1, storeys[number], axis=1)
    floor = navmesh.snap(points)
    here = np.hypot(*(floor - points)[:, [0, 2]].T) < 1e-6
    here[here] = _storey(floor[here, 1], storeys) == number
    values = np.full(len(points), np.nan)
    distances, _ = fields.query(np.zeros(int(here.sum()), np.int64), floor[here])
    values[here] = np.where(np.isfinite(distances), distances, np.nan)
    blank = np.where(here & np.isnan(values), 1.0, np.nan).reshape(len(z), len(x))
    extent = (x[0] - size / 2, x[-1] + size / 2, z[-1] + size / 2, z[0] - size / 2)
    ax.imshow(blank, extent=extent, cmap="gray", vmin=0.0, vmax=1.0, interpolation="nearest")
    field = values.reshape(len(z), len(x))
    image = ax.imshow(field, extent=extent, cmap="viridis_r", vmin=0.0, vmax=furthest, interpolation="nearest")
    if np.isfinite(field).any():
        every = next((step for step in (0.5, 1.0, 2.0, 5.0) if furthest / step <= 40), furthest / 40)
        ax.contour(x, z, field, levels=np.arange(every, furthest, every), colors="white", linewidths=0.35)
    ax.set_facecolor("0.8")
    return image


def _draw_way(
    ax: Untyped, way: NDArray[np.float64], goal: NDArray[np.float64], storeys: NDArray[np.float64], number: int
) -> None:
    """The part of a path on a storey, with its turning points, its start and the goal."""
    for a, b in zip(way[:-1], way[1:], strict=True):
        if number in _storey(np.array([a[1], b[1]]), storeys):
            ax.plot(*zip(a[[0, 2]], b[[0, 2]], strict=True), color="red", linewidth=1.4, marker=".", markersize=4)
    for point, mark, width in ((way[0], "o", 7), (goal, "*", 13)):
        if _storey(point[1:2], storeys)[0] == number:
            ax.plot(point[0], point[2], mark, color="red", markeredgecolor="white", markersize=width)
