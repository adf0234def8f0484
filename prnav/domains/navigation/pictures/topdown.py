"""Top-down maps with trajectories: the path coloured by time, collisions in red, start and goal marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from prnav import style
from prnav.aliases import JSON
from prnav.contracts.records import Evaluation, Trace, pick_episodes, pick_pairs
from prnav.domains.navigation.maps import HALF_STOREY, FloorMap, floor_of


def draw_floor(axes: Axes, floor: FloorMap) -> None:
    """Draw where one can walk, with the walls' outline; axes in metres, equal scale, z downwards."""
    walkable = np.pad(floor.walkable, 1)
    size = floor.metres_per_pixel
    left, right, bottom, top = floor.extent
    extent = (left - size, right + size, bottom + size, top - size)
    axes.imshow(walkable, cmap=ListedColormap([style.PAPER, style.FLOOR]), extent=extent, interpolation="nearest")
    if walkable.any():
        rows, columns = walkable.shape
        x = extent[0] + size * (np.arange(columns) + 0.5)
        z = extent[3] + size * (np.arange(rows) + 0.5)
        axes.contour(x, z, walkable, levels=[0.5], colors=style.WALL, linewidths=0.9)
    _scale_bar(axes, extent)
    axes.set_aspect("equal")
    axes.set_anchor("NW")  # titles start at the left of their cell, and have all of it
    axes.grid(False)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def draw_trajectory(
    axes: Axes,
    trajectory: Trace,
    floor: FloorMap,
    goal: ArrayLike | None = None,
    color: str | None = None,
    norm: Normalize | None = None,
    line_width: float = 2.0,
    collision_size: float = 16.0,
    markers: bool = True,
) -> None:
    """Draw the part of a trajectory on this floor.

    Args:
        axes: where :func:`draw_floor` has drawn.
        trajectory: what is drawn.
        floor: the floor; steps higher or lower by half a storey or more are left out.
        goal: (3,) position, marked where it is on this floor.
        color: of the path; by time where it is None.
        norm: scale of time in steps; the trajectory's own length where it is None.
        line_width: in points.
        collision_size: area of a collision's dot in square points; 0 draws none.
        markers: whether start and goal are marked.
    """
    here = np.abs(trajectory["positions"][:, 1] - floor.height) < HALF_STOREY
    plane = trajectory["positions"][:, [0, 2]]
    segments = np.stack([plane[:-1], plane[1:]], axis=1)
    drawn = here[:-1] & here[1:] & np.any(plane[:-1] != plane[1:], axis=1)
    lines = LineCollection(list(segments[drawn]), linewidths=line_width, capstyle="round", zorder=3)
    if color is None:
        lines.set_array(np.flatnonzero(drawn).astype(float))
        lines.set_cmap(style.TIME)
        lines.set_norm(norm or Normalize(0, max(len(segments), 1)))
    else:
        lines.set_color(color)
    axes.add_collection(lines)
    hits = plane[1:][trajectory["collisions"] & here[1:]]
    if collision_size and len(hits):
        axes.scatter(hits[:, 0], hits[:, 1], s=collision_size, color=style.COLLISION, linewidths=0, zorder=4)
    if not markers:
        return
    if here[0]:
        _mark(axes, plane[0], "o", style.START, 52)
    if goal is not None and abs(float(np.asarray(goal)[1]) - floor.height) < HALF_STOREY:
        point = np.asarray(goal, dtype=np.float64)[[0, 2]]
        axes.scatter(
            point[0], point[1], s=150, marker="*", color=style.GOAL, edgecolors="white", linewidths=1.0, zorder=6
        )
    if here[-1]:
        axes.scatter(
            plane[-1, 0], plane[-1, 1], s=56, facecolors="none", edgecolors=style.INK, linewidths=1.6, zorder=7
        )


def _scale_bar(axes: Axes, extent: tuple[float, float, float, float]) -> None:
    left, right, bottom, top = extent
    length = 1.0 if right - left < 8.0 else 2.0 if right - left < 25.0 else 5.0
    below = bottom + 0.045 * (bottom - top)
    axes.plot([left, left + length], [below, below], color=style.MUTED, linewidth=2.0, solid_capstyle="butt")
    axes.annotate(f"{length:g} m", (left + length, below), (4, 0), textcoords="offset points", va="center", fontsize=8)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom + 0.09 * (bottom - top), top)


def _mark(axes: Axes, point: NDArray[np.float64], symbol: str, color: str, size: float) -> None:
    axes.scatter(point[0], point[1], s=size, marker=symbol, color=color, edgecolors="white", linewidths=1.0, zorder=6)


def caption(row: Mapping[str, JSON]) -> str:
    """Scene, score and cost of an episode in two short lines."""
    words = [f"SPL {float(row['spl']):.2f}"] if "spl" in row else []
    words.append(f"{int(row['steps'])} steps")
    hits = int(row.get("collisions", 0))
    words.append("no collision" if hits == 0 else f"{hits} collision{'s' * (hits > 1)}")
    return f"{row['scene_id']} · {row['episode_id']}\n" + " · ".join(words)


@dataclass(frozen=True, eq=False)
class _Panel:
    """One floor of one episode."""

    title: str
    row: Mapping[str, JSON]
    trajectory: Trace
    floor: FloorMap


COLUMNS = 3
"""Maps side by side: more would be too small to read on a page 1,280 pixels wide."""


def draw_episodes(
    evaluation: Evaluation, trajectories: Sequence[Trace], maps: Sequence[FloorMap], each: int = 3
) -> Figure:
    """Worst, best and random episodes of an evaluation; one map for each floor that an episode touches."""
    panels = []
    for name, chosen in pick_episodes(evaluation.rows, each).items():
        for index in chosen:
            row, trajectory = evaluation.rows[index], trajectories[index]
            title = f"{name.capitalize()}: {caption(row)}"
            panels += _panels(title, row, trajectory, floors_of(maps, row, trajectory))
    figure = _draw_panels(panels, min(COLUMNS, len(panels)))
    figure.suptitle(f"{evaluation.label}: worst, best and random episodes", fontsize=12, x=0.01, ha="left")
    return figure


def draw_pairs(
    evaluations: tuple[Evaluation, Evaluation],
    trajectories: tuple[Sequence[Trace], Sequence[Trace]],
    maps: Sequence[FloorMap],
    names: tuple[str, str],
) -> Figure:
    """The same episodes as two evaluations played them, side by side: where each did better most, and one at random.

    Both must have the same episodes in the same order.
    """
    one, two = evaluations
    panels = []
    for index in pick_pairs(one.rows, two.rows).values():
        tracks = [trajectories[k][index] for k in (0, 1)]
        rows = [one.rows[index], two.rows[index]]
        floors = [floors_of(maps, row, track) for row, track in zip(rows, tracks, strict=True)]
        heights = sorted({floor.height for shown in floors for floor in shown})
        for height in heights:
            for name, row, track, shown in zip(names, rows, tracks, floors, strict=True):
                of_height = [floor for other in floors for floor in other if floor.height == height]
                floor = next((floor for floor in shown if floor.height == height), of_height[0])
                panels += _panels(f"{name}\n{caption(row)}", row, track, [floor], len(heights) > 1)
    figure = _draw_panels(panels, 2, width=5.4)
    figure.suptitle("The same episodes, side by side", fontsize=12, x=0.01, ha="left")
    return figure


def floors_of(maps: Sequence[FloorMap], row: Mapping[str, JSON], trajectory: Trace) -> list[FloorMap]:
    """Floors that an episode's path or goal is on, lowest first; a blank one where no map is at hand."""
    heights = list(trajectory["positions"][:, 1])
    heights += [] if row.get("goal") is None else [float(row["goal"][1])]
    floors = {id(floor): floor for y in heights if (floor := floor_of(maps, str(row["scene_id"]), float(y)))}
    return sorted(floors.values(), key=lambda floor: floor.height) or [_empty(row, trajectory)]


def _panels(
    title: str, row: Mapping[str, JSON], track: Trace, floors: Sequence[FloorMap], tell: bool = False
) -> list[_Panel]:
    tell = tell or len(floors) > 1
    return [
        _Panel(f"{title}{f' · floor at {floor.height:.1f} m' if tell else ''}", row, track, floor) for floor in floors
    ]


def _draw_panels(panels: Sequence[_Panel], columns: int, width: float = 3.7) -> Figure:
    lines = -(-len(panels) // columns)
    shape = float(np.clip(np.median([_ratio(panel.floor) for panel in panels]), 0.5, 1.1))
    figure = style.new_figure(width * columns, (width * shape + 0.55) * lines + 0.5)
    with style.styled():
        grid = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        for axes, panel in zip(grid, panels, strict=False):
            draw_floor(axes, panel.floor)
            draw_trajectory(axes, panel.trajectory, panel.floor, panel.row.get("goal"))
            axes.set_title(panel.title, fontsize=9)
        figure.legend(handles=_legend(), loc="outside lower center", ncols=5)
    return figure


def draw_house(
    evaluation: Evaluation, trajectories: Sequence[Trace], maps: Sequence[FloorMap], limit: int = 50
) -> Figure:
    """Up to ``limit`` trajectories in the scene with the most episodes, coloured by time, one map per floor."""
    counts: dict[str, int] = {}
    for row in evaluation.rows:
        counts[row["scene_id"]] = counts.get(row["scene_id"], 0) + 1
    scene = max(counts, key=lambda name: counts[name])
    chosen = [i for i, row in enumerate(evaluation.rows) if row["scene_id"] == scene][:limit]
    first = chosen[0]
    floors = [m for m in maps if m.scene_id == scene] or [_empty(evaluation.rows[first], trajectories[first])]
    longest = max(len(trajectories[i]["actions"]) for i in chosen)
    norm = Normalize(0, max(longest, 1))
    width = 6.2
    figure = style.new_figure(width * len(floors) + 0.8, width * _ratio(floors[0]) + 0.9)
    with style.styled():
        grid = figure.subplots(1, len(floors), squeeze=False)[0]
        for axes, floor in zip(grid, floors, strict=True):
            draw_floor(axes, floor)
            for i in chosen:
                draw_trajectory(
                    axes, trajectories[i], floor, norm=norm, line_width=1.2, collision_size=7, markers=False
                )
            if len(floors) > 1:
                axes.set_title(f"floor at {floor.height:.1f} m")
        bar = figure.colorbar(ScalarMappable(norm, style.TIME), ax=list(grid), shrink=0.6)
        bar.set_label("step of the episode")
        bar.outline.set_visible(False)
        title = f"{evaluation.label}: {len(chosen)} trajectories in {scene}, collisions in red"
        figure.suptitle(title, fontsize=12, x=0.01, ha="left")
    return figure


def _legend() -> list[Line2D]:
    def mark(symbol: str, color: str, size: float, label: str) -> Line2D:
        return Line2D([], [], marker=symbol, color=color, linestyle="none", markersize=size, label=label)

    path = Line2D([], [], color=style.TIME(0.4), linewidth=2.5, label="path, dark to light in time")
    end = mark("o", "none", 7, "end")
    end.set_markeredgecolor(style.INK)
    end.set_markeredgewidth(1.6)
    return [
        mark("o", style.START, 7, "start"),
        mark("*", style.GOAL, 11, "goal"),
        Line2D(
            [], [], marker="o", color="none", markeredgecolor=style.INK, markeredgewidth=1.6, markersize=7, label="end"
        ),
        mark("o", style.COLLISION, 4.5, "collision"),
        path,
    ]


def _ratio(floor: FloorMap) -> float:
    rows, columns = floor.walkable.shape
    return rows / max(columns, 1)


def _empty(row: Mapping[str, JSON], trajectory: Trace) -> FloorMap:
    """A map that knows no floor, as large as the trajectory."""
    points = trajectory["positions"]
    if row.get("goal") is not None:
        points = np.concatenate([points, np.asarray(row["goal"], dtype=np.float64)[None]])
    low, high = points.min(axis=0)[[0, 2]] - 1.0, points.max(axis=0)[[0, 2]] + 1.0
    shape = np.maximum(np.ceil((high - low) / 0.05), 1).astype(int)
    blank = np.zeros((shape[1], shape[0]), dtype=np.bool_)
    return FloorMap(str(row["scene_id"]), float(trajectory["positions"][0, 1]), (low[0], low[1]), 0.05, blank)
