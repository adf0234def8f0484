"""Drawings of sensor designs: the body with its sensors' frusta, and what each sensor's receptors see."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from prnav import frames, style
from prnav.aliases import Untyped
from prnav.sensors import Body, Design

REACH = 0.45
"""Length of a drawn frustum's edges [m]."""

_BODY = "#c9ced6"
_LIGHT = np.array([0.5, 0.6, 0.62])
_CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


@dataclass(frozen=True, eq=False)
class Sight:
    """What a design sees at one place: pictures and readings of each sensor."""

    pictures: NDArray[np.float32]
    """(K, S, S, 3), 0 to 1."""
    readings: NDArray[np.float32]
    """(K, B, B, 3), 0 to 1."""


def draw_design(design: Design, sight: Sight | None = None, place: str = "") -> Figure:
    """The design on its body, and beside it what it sees where ``sight`` is given (``place`` says where that is)."""
    count = design.num_sensors
    blocks, lines, columns = sight_layout(design)
    shown = 0 if sight is None else lines
    cell = float(np.clip(6.0 / max(shown, 1), 1.7, 2.5))
    width = blocks * (columns * cell + 0.6)
    figure = style.new_figure(5.4 + (width if shown else 0.0), max(7.0, (cell + 0.12) * shown + 1.1))
    with style.styled():
        left: Untyped = figure
        right: Untyped = None
        if shown:
            halves: Untyped = figure.subfigures(1, 2, width_ratios=(5.2, width))
            left, right = halves
        grid = left.add_gridspec(2, 1, height_ratios=(3.0, 1.25))
        body = left.add_subplot(grid[0], projection="3d")
        assert isinstance(body, Axes3D)
        draw_body(body, design)
        plan = left.add_subplot(grid[1])
        draw_plan(plan, design)
        if right is not None and sight is not None:
            _draw_sight(right, design, sight)
            right.suptitle(f"what it sees {place}".rstrip(), fontsize=10, color=style.MUTED, x=0.02, ha="left")
        title = f"{design.name}: {count} sensor{'s' * (count > 1)} of {design.grid} x {design.grid} receptors"
        figure.suptitle(title, fontsize=13, fontweight="bold", x=0.012, ha="left")
    return figure


def draw_body(axes: Axes3D, design: Design) -> None:
    """The body with each sensor's field of view, seen from ahead and to the side; metres."""
    vertices, faces = design.body.outline()
    shape = _drawn(vertices)
    light = np.abs(_facing(shape[faces])) if len(faces) else np.zeros(0)
    shades = np.array(to_rgb(_BODY)) * (0.72 + 0.28 * light[:, None])
    axes.add_collection3d(
        Poly3DCollection(shape[faces], facecolors=shades, edgecolors=shades, linewidth=0.3, alpha=0.9)
    )
    if isinstance(design.body, Body):
        ring = shape[:48]
        for edge in (0.0, design.body.height):
            axes.plot(*np.append(ring, ring[:1], axis=0)[:, :2].T, edge, color=style.WALL, linewidth=0.8)
    points = [shape]
    for index, (apex, corners, axis) in enumerate(frusta(design)):
        color = style.SERIES[index % len(style.SERIES)]
        sides = [np.stack([apex, corners[i], corners[(i + 1) % 4]]) for i in range(4)]
        axes.add_collection3d(Poly3DCollection(sides, facecolor=color, edgecolor=color, alpha=0.16, linewidth=0.9))
        axes.add_collection3d(Poly3DCollection([corners], facecolor=color, edgecolor=color, alpha=0.30, linewidth=1.2))
        axes.plot(*np.stack([apex, apex + 0.6 * REACH * axis]).T, color=color, linewidth=1.0, linestyle=(0, (3, 2)))
        axes.scatter(*apex, color=color, s=22, depthshade=False)
        label = axes.text(*(apex + 1.05 * REACH * axis), f"{index}", color=color, fontweight="bold", zorder=100)
        label.set_path_effects([withStroke(linewidth=3, foreground=style.PAPER)])
        points.append(corners)
    span = np.concatenate(points)
    low, high = span.min(axis=0), span.max(axis=0)
    ahead = max(0.55, float(high[1]) + 0.05)
    front = float(shape[:, 1].max())
    axes.quiver(0, front, 0, 0, ahead - front, 0, color=style.MUTED, linewidth=1.5, arrow_length_ratio=0.15)
    axes.text(0.0, ahead + 0.04, 0.0, "ahead", color=style.MUTED, fontsize=9)
    middle, reach = 0.5 * (low + high), 0.5 * (high - low) + 0.05
    axes.set_xlim(middle[0] - reach[0], middle[0] + reach[0])
    axes.set_ylim(middle[1] - reach[1], max(middle[1] + reach[1], ahead + 0.1))
    axes.set_zlim(0.0, max(high[2], design.body.height) + 0.02)
    axes.set_aspect("equal")
    axes.view_init(elev=18, azim=38)
    axes.set_zlabel("height [m]")
    axes.set_xticklabels([])
    axes.set_yticklabels([])
    axes.set_zticks(np.arange(0.0, axes.get_zlim()[1] + 1e-9, 0.5))
    for side in (axes.xaxis, axes.yaxis, axes.zaxis):
        side.set_pane_color((1.0, 1.0, 1.0, 0.0))


def draw_plan(axes: Axes, design: Design) -> None:
    """The body from above, ahead is up, with each sensor's field of view as a wedge, and its numbers as a list."""
    vertices, faces = design.body.outline()
    shadow: Untyped = _drawn(vertices)[faces][..., :2]
    axes.add_collection(PolyCollection(shadow, facecolor=_BODY, edgecolor=_BODY, zorder=2))
    for index, (apex, corners, axis) in enumerate(frusta(design)):
        color = style.SERIES[index % len(style.SERIES)]
        axes.fill(*_hull(np.concatenate([apex[None], corners])[:, :2]).T, color=color, alpha=0.25, zorder=3)
        axes.plot(*np.stack([apex, apex + 0.6 * REACH * axis])[:, :2].T, color=color, linewidth=1.2, zorder=4)
        axes.scatter(apex[0], apex[1], color=color, s=20, zorder=5)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title("from above", fontsize=9, color=style.MUTED, fontweight="normal")
    table = [
        f"{i}  height {y:.2f} m   yaw {_degrees(yaw)}   pitch {_degrees(pitch)}   roll {_degrees(roll)}   "
        f"fov {_degrees(fov)}"
        for i, (_, y, _, yaw, pitch, roll, fov) in enumerate(design.sensors)
    ]
    for index, line in enumerate(table):
        color = style.SERIES[index % len(style.SERIES)]
        axes.annotate(
            line,
            (0.5, 0.0),
            (0, -12 - 12 * index),
            xycoords="axes fraction",
            textcoords="offset points",
            fontsize=8,
            color=color,
            ha="center",
            annotation_clip=False,
        )


def frusta(design: Design) -> list[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]:
    """Apex (3,), corners (4, 3) and optical axis (3,) of each sensor as drawn: x right, y ahead, z up."""
    sensors = np.ascontiguousarray(design.sensors.T)
    scale = np.tan(0.5 * sensors[6])[:, None]
    right, up, forward = frames.sensor_axes(*sensors[3:6])
    result = []
    for apex, across, along, ahead in zip(sensors[:3].T, scale * right, scale * up, forward, strict=True):
        rays = ahead + _CORNERS[:, :1] * across + _CORNERS[:, 1:] * along
        corners = apex + REACH * rays / np.linalg.norm(rays, axis=1, keepdims=True)
        result.append((_drawn(apex), _drawn(corners), _drawn(ahead)))
    return result


def _drawn(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Body coordinates (x right, y up, -z ahead) as the drawing's (x right, y ahead, z up)."""
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def _draw_sight(figure: Untyped, design: Design, sight: Sight) -> None:
    blocks, lines, columns = sight_layout(design)
    grid = figure.subplots(lines, blocks * columns, squeeze=False)
    for index in range(blocks * lines):
        block, line = divmod(index, lines)
        cells = grid[line, block * columns : (block + 1) * columns]
        if index >= design.num_sensors:
            for axes in cells:
                axes.set_axis_off()
            continue
        picture, readings = sight.pictures[index], sight.readings[index]
        size = len(picture)
        color = style.SERIES[index % len(style.SERIES)]
        for axes, image in zip(cells, (*[picture] * (columns - 1), readings), strict=True):
            axes.imshow(
                image, extent=(0, size, size, 0), interpolation="nearest" if image is readings else "antialiased"
            )
            axes.grid(False)
            axes.set_xticks([])
            axes.set_yticks([])
            for spine in axes.spines.values():
                spine.set_visible(True)
                spine.set_color(color)
                spine.set_linewidth(1.6)
        for cut in np.linspace(0, size, design.grid + 1)[1:-1]:
            cells[1].axhline(cut, color="white", linewidth=0.9)
            cells[1].axvline(cut, color="white", linewidth=0.9)
        cells[0].set_ylabel(f"sensor {index}", color=color, fontweight="bold")
        if line == 0:
            titles = ("picture", "patches", "readings") if columns == 3 else ("picture", "reading")
            for axes, title in zip(cells, titles, strict=True):
                axes.set_title(title, fontsize=10)


def sight_layout(design: Design) -> tuple[int, int, int]:
    """Blocks side by side, lines in each, and columns of a line; a single receptor needs no column for its patch."""
    blocks = 1 if design.num_sensors <= 4 else 2
    return blocks, -(-design.num_sensors // blocks), 2 if design.grid == 1 else 3


def _facing(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cosine between each triangle's normal and the light, (F,)."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    return normal @ _LIGHT / np.where(length > 0.0, length, 1.0)


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convex hull of points (n, 2) in order (a gift wrap: n is 5)."""
    start = current = int(np.lexsort((points[:, 1], points[:, 0]))[0])
    order = [start]
    for _ in range(len(points)):
        following = (current + 1) % len(points)
        for other in range(len(points)):
            a, b = points[following] - points[current], points[other] - points[current]
            turn = a[0] * b[1] - a[1] * b[0]
            if turn < -1e-15 or (abs(turn) <= 1e-15 and b @ b > a @ a):
                following = other
        if following == start:
            break
        order.append(following)
        current = following
    return points[order]


def _degrees(angle: float) -> str:
    return f"{round(math.degrees(angle)) + 0}°"
