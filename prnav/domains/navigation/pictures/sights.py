"""What the receptors saw along an episode: its map, moments of it, and every receptor over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from prnav import style
from prnav.aliases import JSON, Untyped
from prnav.contracts import Trace
from prnav.domains.navigation.maps import FloorMap
from prnav.domains.navigation.pictures.frame import sensors_side_by_side
from prnav.domains.navigation.pictures.topdown import caption, draw_floor, draw_trajectory, floors_of

MOMENTS = 8
ACTION_NAMES = ("stop", "forward", "left", "right")
ACTION_COLORS = ("#1f2933", "#c9ced6", "#e0a53f", "#7a5ea8")


def draw_sight(
    row: Mapping[str, JSON], track: Trace, readings: NDArray[np.uint8], maps: Sequence[FloorMap], title: str
) -> Figure:
    """One episode as the agent saw it.

    Args:
        row: its record.
        track: its trajectory of T steps.
        readings: what receptors read before each step and after the last, (T + 1, K, B, B, 3) in 0..255.
        maps: floor plans.
        title: of the figure.
    """
    steps, sensors = len(track["actions"]), readings.shape[1]
    moments = np.unique(np.linspace(0, steps, MOMENTS).round().astype(int))
    figure = style.new_figure(11.0, 3.6 + 0.75 * sensors + 1.0)
    with style.styled():
        halves: Untyped = figure.subfigures(2, 1, height_ratios=(3.4, 0.75 * sensors + 1.0))
        top, bottom = halves
        area = top.add_gridspec(2, 1 + MOMENTS // 2, width_ratios=(1.7, *[1.0] * (MOMENTS // 2)))
        plan = top.add_subplot(area[:, 0])
        floor = floors_of(maps, row, track)[0]
        draw_floor(plan, floor)
        draw_trajectory(plan, track, floor, row.get("goal"))
        plan.set_title(caption(row), fontsize=9)
        for place, step in enumerate(moments):
            axes = top.add_subplot(area[place // (MOMENTS // 2), 1 + place % (MOMENTS // 2)])
            axes.imshow(sensors_side_by_side(readings[step]), interpolation="nearest")
            action = ACTION_NAMES[track["actions"][step]] if step < steps else "end"
            axes.set_title(f"step {step}: {action}", fontsize=8.5, fontweight="normal")
            _bare(axes)
        lines = bottom.subplots(sensors + 1, 1, sharex=True, height_ratios=[1.0] * sensors + [0.35])
        for sensor, axes in enumerate(lines[:-1]):
            strip = readings[:, sensor].reshape(len(readings), -1, 3).transpose(1, 0, 2)
            axes.imshow(strip, aspect="auto", interpolation="nearest", extent=(-0.5, steps + 0.5, 0, 1))
            axes.set_ylabel(f"sensor {sensor + 1}", rotation=0, ha="right", va="center", fontsize=9)
            axes.set_yticks([])
            axes.tick_params(bottom=False)
            axes.grid(False)
        _draw_actions(lines[-1], track)
        bottom.suptitle("every receptor over time, top row first", fontsize=9, color=style.MUTED, x=0.01, ha="left")
        figure.suptitle(title, fontsize=12, x=0.01, ha="left")
    return figure


def _draw_actions(axes: Axes, track: Trace) -> None:
    steps = np.arange(len(track["actions"]))
    for action, (name, color) in enumerate(zip(ACTION_NAMES, ACTION_COLORS, strict=True)):
        chosen = steps[track["actions"] == action]
        if len(chosen):
            axes.bar(chosen, 1.0, width=1.0, align="edge", color=color, label=name)
    hits = steps[track["collisions"]]
    if len(hits):
        axes.bar(hits, 0.5, width=1.0, align="edge", color=style.COLLISION, label="collision")
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.grid(False)
    axes.set_ylabel("action", rotation=0, ha="right", va="center", fontsize=9)
    axes.set_xlabel("step of the episode")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.6), fontsize=8, handlelength=1.0)


def _bare(axes: Axes) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
