"""Top-down maps with trajectories: the path coloured by time, collisions in red, start and goal marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from prnav.evaluate.evaluator import Trajectory
from prnav.evaluate.maps import HALF_STOREY, FloorMap, floor_of
from prnav.evaluate.records import Evaluation
from prnav.report import style


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
    axes.grid(False)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def draw_trajectory(
    axes: Axes,
    trajectory: Trajectory,
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
    here = np.abs(trajectory.positions[:, 1] - floor.height) < HALF_STOREY
    plane = trajectory.positions[:, [0, 2]]
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
    hits = plane[1:][trajectory.collisions & here[1:]]
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


def pick_episodes(rows: Sequence[Mapping[str, Any]], each: int = 3) -> dict[str, list[int]]:
    """Indices of the worst, middle and best episodes by SPL.

    Equals are ordered by SoftSPL, then by how far from the goal they ended, then by the length of the shortest path,
    so that the best are hard episodes done well and the worst are the farthest misses. No episode appears twice.
    """

    def rank(index: int) -> tuple[float, ...]:
        row = rows[index]
        remaining = row.get("distance_to_goal")
        return (
            float(row.get("spl", row.get("success", 0.0))),
            round(float(row.get("soft_spl", 0.0)), 3),
            -float(np.inf if remaining is None else remaining),
            float(row.get("geodesic_distance") or 0.0),
        )

    order = sorted(range(len(rows)), key=rank)
    each = min(each, max(1, len(order) // 3))
    middle = max(each, (len(order) - each) // 2)
    picks = {"best": order[::-1][:each], "median": order[middle : middle + each], "worst": order[:each]}
    best, median = set(picks["best"]), set(picks["median"])
    return {
        "best": picks["best"],
        "median": [i for i in picks["median"] if i not in best],
        "worst": [i for i in picks["worst"] if i not in best | median],
    }


def caption(row: Mapping[str, Any]) -> str:
    """Scene, score and cost of an episode in two short lines."""
    words = [f"SPL {float(row['spl']):.2f}"] if "spl" in row else []
    words.append(f"{int(row['steps'])} steps")
    hits = int(row.get("collisions", 0))
    words.append("no collision" if hits == 0 else f"{hits} collision{'s' * (hits > 1)}")
    return f"{row['scene_id']} · {row['episode_id']}\n" + " · ".join(words)


def draw_episodes(
    evaluation: Evaluation, trajectories: Sequence[Trajectory], maps: Sequence[FloorMap], each: int = 3
) -> Figure:
    """Best, median and worst episodes of an evaluation, one row of maps each."""
    picks = {name: chosen for name, chosen in pick_episodes(evaluation.rows, each).items() if chosen}
    columns = max(map(len, picks.values()))
    shapes = [_aspect(maps, evaluation.rows[i]) for chosen in picks.values() for i in chosen]
    cell = 3.7
    figure = style.new_figure(cell * columns, (cell * float(np.clip(np.median(shapes), 0.6, 1.1)) + 0.55) * len(picks))
    with style.styled():
        grid = figure.subplots(len(picks), columns, squeeze=False)
        for line, (name, chosen) in zip(grid, picks.items(), strict=True):
            for axes in line[len(chosen) :]:
                axes.set_axis_off()
            for axes, index in zip(line, chosen, strict=False):
                draw_episode(axes, evaluation.rows[index], trajectories[index], maps)
                axes.set_title(f"{name.capitalize()}: {caption(evaluation.rows[index])}", fontsize=9)
        figure.suptitle(f"{evaluation.label}: best, median and worst episodes by SPL", fontsize=12, x=0.01, ha="left")
        figure.legend(handles=_legend(), loc="outside lower center", ncols=5)
    return figure


def draw_episode(
    axes: Axes, row: Mapping[str, Any], trajectory: Trajectory, maps: Sequence[FloorMap], color: str | None = None
) -> None:
    """One episode on the floor it starts on (or, where no map is at hand, on nothing)."""
    floor = floor_of(maps, str(row["scene_id"]), float(trajectory.positions[0, 1])) or _empty(row, trajectory)
    draw_floor(axes, floor)
    draw_trajectory(axes, trajectory, floor, row.get("goal"), color=color)


def draw_house(
    evaluation: Evaluation, trajectories: Sequence[Trajectory], maps: Sequence[FloorMap], limit: int = 50
) -> Figure:
    """Up to ``limit`` trajectories in the scene with the most episodes, coloured by time, one map per floor."""
    counts: dict[str, int] = {}
    for row in evaluation.rows:
        counts[row["scene_id"]] = counts.get(row["scene_id"], 0) + 1
    scene = max(counts, key=lambda name: counts[name])
    chosen = [i for i, row in enumerate(evaluation.rows) if row["scene_id"] == scene][:limit]
    first = chosen[0]
    floors = [m for m in maps if m.scene_id == scene] or [_empty(evaluation.rows[first], trajectories[first])]
    longest = max(len(trajectories[i].actions) for i in chosen)
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


def _aspect(maps: Sequence[FloorMap], row: Mapping[str, Any]) -> float:
    floors = [m for m in maps if m.scene_id == row["scene_id"]]
    return _ratio(floors[0]) if floors else 1.0


def _empty(row: Mapping[str, Any], trajectory: Trajectory) -> FloorMap:
    """A map that knows no floor, as large as the trajectory."""
    points = trajectory.positions
    if row.get("goal") is not None:
        points = np.concatenate([points, np.asarray(row["goal"], dtype=np.float64)[None]])
    low, high = points.min(axis=0)[[0, 2]] - 1.0, points.max(axis=0)[[0, 2]] + 1.0
    shape = np.maximum(np.ceil((high - low) / 0.05), 1).astype(int)
    blank = np.zeros((shape[1], shape[0]), dtype=np.bool_)
    return FloorMap(str(row["scene_id"]), float(trajectory.positions[0, 1]), (low[0], low[1]), 0.05, blank)
