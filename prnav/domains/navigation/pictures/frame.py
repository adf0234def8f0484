"""Frames of films and of ``render()``: the way on the floor plan beside what the agent sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from prnav import style
from prnav.aliases import Untyped
from prnav.domains.navigation.maps import FloorMap
from prnav.domains.navigation.pictures.topdown import draw_floor
from prnav.frames import forward

WIDTH, HEIGHT, PLAN = 1120, 640, 640
"""Size of a frame, and of the floor plan in it [pixels]; all divisible by 16, as encoders like it."""

Frame = NDArray[np.uint8]


class Words(NamedTuple):
    """What stands beside the plan."""

    title: str
    caption: str
    """Below the title, smaller; may have two lines."""
    step: str
    """Which step it is, and what is done."""
    collision: bool
    """Whether that step hit something."""


def compose(plan: Image.Image, seen: NDArray[np.uint8] | None, words: Words) -> Frame:
    """A frame (HEIGHT, WIDTH, 3).

    Args:
        plan: the floor plan with what is on it, PLAN pixels a side.
        seen: what the agent's sensors see, (K, B, B, 3) in 0..255; None for an agent without light.
        words: what stands beside the plan.
    """
    large, small = ImageFont.load_default(size=20), ImageFont.load_default(size=15)
    frame = Image.new("RGB", (WIDTH, HEIGHT), style.PAPER)
    frame.paste(plan, (0, 0))
    pen = ImageDraw.Draw(frame)
    pen.text((PLAN + 16, 20), words.title, fill=style.INK, font=large)
    pen.text((PLAN + 16, 50), words.caption, fill=style.MUTED, font=small)
    if seen is None:
        pen.text((PLAN + 16, 130), "this agent sees nothing", fill=style.MUTED, font=small)
    else:
        _paste_sights(frame, seen)
    pen.text((PLAN + 16, HEIGHT - 76), words.step, fill=style.INK, font=large)
    if words.collision:
        pen.text((PLAN + 16, HEIGHT - 46), "collision", fill=style.COLLISION, font=large)
    return np.asarray(frame, dtype=np.uint8)


def sensors_side_by_side(seen: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Grids of K sensors (K, B, B, 3) as one picture, a white column between them: (B, K * B + K - 1, 3)."""
    gap = np.full((seen.shape[1], 1, 3), 255, np.uint8)
    parts = [part for grid in seen for part in (gap, grid)][1:]
    return np.concatenate(parts, axis=1)


def _paste_sights(frame: Image.Image, seen: NDArray[np.uint8]) -> None:
    """Paste sensors in rows, as large as there is room; each pixel a whole square where it can be one."""
    sensors, grid = seen.shape[0], seen.shape[1]
    columns = min(sensors, 2 if sensors <= 4 else 4)
    lines = -(-sensors // columns)
    room_x, room_y = WIDTH - PLAN - 32, HEIGHT - 110 - 100
    fitting = min(room_x / (columns * grid + columns - 1), room_y / (lines * (grid + 1)))
    cell = float(int(fitting)) if fitting >= 1.0 else fitting
    way = Image.Resampling.NEAREST if fitting >= 1.0 else Image.Resampling.BOX
    for line in range(lines):
        part = sensors_side_by_side(seen[line * columns : (line + 1) * columns])
        size = max(1, round(part.shape[1] * cell)), max(1, round(part.shape[0] * cell))
        frame.paste(Image.fromarray(part).resize(size, way), (PLAN + 16, 110 + round(line * (grid + 1) * cell)))


class Plan:
    """A floor plan as pixels, on which the way so far grows."""

    def __init__(self, floor: FloorMap) -> None:
        """Plan of a floor without any way on it."""
        figure = style.new_figure(PLAN / 100, PLAN / 100)
        with style.styled():
            axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
            draw_floor(axes, floor)
        figure.set_layout_engine("none")
        figure.set_dpi(100)
        figure.canvas.draw()
        self.floor = floor
        self.image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())  # type: ignore[attr-defined]
        self._to_pixels: Untyped = axes.transData.frozen()

    def go(self, stretch: NDArray[np.float64], time: float, collision: bool, image: Image.Image | None = None) -> None:
        """Draw one step's stretch of the way.

        Args:
            stretch: where it began and ended [m], (2, 3).
            time: when, 0 to 1, for its colour.
            collision: whether it hit something: a red dot at its end.
            image: where to draw; the plan itself if not given.
        """
        pen = ImageDraw.Draw(self.image if image is None else image)
        a, b = self.pixels(stretch)
        red, green, blue, _ = style.TIME(time)
        pen.line([*a, *b], fill=(round(255 * red), round(255 * green), round(255 * blue)), width=3)
        if collision:
            pen.ellipse([*(b - 4), *(b + 4)], fill=style.COLLISION)

    def put(self, image: Image.Image, position: NDArray[np.float64], yaw: float, goal: Untyped) -> None:
        """Draw goal and agent: a triangle that points where it looks.

        Args:
            image: where to draw.
            position: of the agent [m], (3,).
            yaw: its heading [rad].
            goal: (3,) [m], or None where there is none on this floor.
        """
        pen = ImageDraw.Draw(image)
        if goal is not None:
            x, z = self.pixels(np.asarray(goal, np.float64)[None])[0]
            pen.ellipse([x - 8, z - 8, x + 8, z + 8], fill=style.GOAL, outline=style.PAPER, width=2)
        here = self.pixels(position[None])[0]
        ahead = forward(yaw)[[0, 2]]  # x to the right, z down, as pixels go
        side = np.array([-ahead[1], ahead[0]])
        corners = [here + 15 * ahead, here - 9 * ahead + 9 * side, here - 9 * ahead - 9 * side]
        pen.polygon([tuple(corner) for corner in corners], fill=style.START, outline=style.PAPER)

    def pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions (n, 3) [m] in pixels from the top left, (n, 2)."""
        x, y = self._to_pixels.transform(points[:, [0, 2]]).T
        return np.stack([x, PLAN - y], axis=1)


def nearest_plan(plans: Sequence[Plan], height: float) -> Plan:
    """The plan whose floor is nearest to ``height`` [m]."""
    return min(plans, key=lambda plan: abs(plan.floor.height - height))
