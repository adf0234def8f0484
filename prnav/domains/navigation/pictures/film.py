"""Films of episodes as MP4: the way on the floor plan, what the receptors read, and the action, step by step."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from prnav import style
from prnav.contracts.records import Evaluation, Trace, pick_episodes
from prnav.domains.navigation.maps import FloorMap, load_maps
from prnav.domains.navigation.pictures.sights import ACTION_NAMES, sensors_side_by_side
from prnav.domains.navigation.pictures.topdown import caption, draw_floor, floors_of
from prnav.domains.navigation.sights import load_sights
from prnav.errors import PrnavError
from prnav.files import atomic_path
from prnav.frames import forward

WIDTH, HEIGHT, PLAN = 1120, 640, 640
"""Size of a frame, and of the floor plan in it [pixels]; all divisible by 16, as encoders like it."""
SECONDS = 30.0
"""A film runs for about so long, between 6 and 30 steps a second."""

Frame = NDArray[np.uint8]


def write_videos(evaluation: Evaluation, traces: Sequence[Trace], each: int = 1) -> list[Path]:
    """Write films of the worst, best and random episodes into ``videos/`` beside the records.

    Raises:
        PrnavError: the encoder is not installed.
        RecordError: trajectories, floor plans or readings are missing or broken.
    """
    encoder()
    maps, sights = load_maps(evaluation.directory), load_sights(evaluation.directory)
    paths = []
    for name, chosen in pick_episodes(evaluation.rows, each).items():
        for index in chosen:
            row, track = evaluation.rows[index], traces[index]
            path = evaluation.directory / "videos" / f"{name}-{index + 1}.mp4"
            frames = draw_frames(row, track, maps, sights.get(index), f"{evaluation.label} · {name}")
            write_mp4(path, frames, fps=float(np.clip(len(track["actions"]) / SECONDS, 6.0, 30.0)))
            paths.append(path)
    return paths


def encoder() -> Any:
    """The module that encodes films.

    Raises:
        PrnavError: it is not installed.
    """
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise PrnavError(
            "videos need the package imageio-ffmpeg, which is not installed; get it with: pip install 'prnav[video]'"
        ) from error
    return imageio_ffmpeg


def write_mp4(path: Path, frames: Iterator[Frame], fps: float) -> None:
    """Encode frames (HEIGHT, WIDTH, 3) as H.264, whole or not at all."""
    with atomic_path(path) as temporary:
        writer = encoder().write_frames(str(temporary), (WIDTH, HEIGHT), fps=fps, quality=7, macro_block_size=16)
        with contextlib.closing(writer):
            writer.send(None)
            for frame in frames:
                writer.send(np.ascontiguousarray(frame))


def draw_frames(
    row: Mapping[str, Any],
    track: Trace,
    maps: Sequence[FloorMap],
    readings: NDArray[np.uint8] | None,
    title: str,
) -> Iterator[Frame]:
    """One frame for each state of an episode, T + 1 in all.

    Args:
        row: its record.
        track: its trajectory of T steps.
        maps: floor plans.
        readings: what receptors read, (T + 1, K, B, B, 3) in 0..255; None for an agent without light.
        title: stands over the readings.
    """
    floors = floors_of(maps, row, track)
    plans = [_Plan(floor) for floor in floors]
    heights = np.array([floor.height for floor in floors])
    of_step = np.abs(track["positions"][:, 1, None] - heights).argmin(axis=1)
    goal = row.get("goal")
    shown = 0 if goal is None else int(np.abs(float(goal[1]) - heights).argmin())
    large, small = ImageFont.load_default(size=20), ImageFont.load_default(size=15)
    for step in range(len(track["positions"])):
        plan = plans[of_step[step]]
        plan.go(track, step)
        frame = Image.new("RGB", (WIDTH, HEIGHT), style.PAPER)
        frame.paste(plan.picture(track, step, goal if of_step[step] == shown else None), (0, 0))
        pen = ImageDraw.Draw(frame)
        pen.text((PLAN + 16, 20), title, fill=style.INK, font=large)
        pen.text((PLAN + 16, 50), caption(row), fill=style.MUTED, font=small)
        if readings is None:
            pen.text((PLAN + 16, 130), "this agent sees nothing", fill=style.MUTED, font=small)
        else:
            _paste_readings(frame, readings[step])
        action = ACTION_NAMES[track["actions"][step]] if step < len(track["actions"]) else "end"
        hit = step < len(track["actions"]) and bool(track["collisions"][step])
        pen.text((PLAN + 16, HEIGHT - 76), f"step {step}: {action}", fill=style.INK, font=large)
        if hit:
            pen.text((PLAN + 16, HEIGHT - 46), "collision", fill=style.COLLISION, font=large)
        yield np.asarray(frame, dtype=np.uint8)


def _paste_readings(frame: Image.Image, readings: NDArray[np.uint8]) -> None:
    sensors, grid = readings.shape[0], readings.shape[1]
    columns = min(sensors, 2 if sensors <= 4 else 4)
    lines = -(-sensors // columns)
    room_x, room_y = WIDTH - PLAN - 32, HEIGHT - 110 - 100
    cell = max(1, min(room_x // (columns * grid + columns - 1), room_y // (lines * (grid + 1))))
    for line in range(lines):
        part = sensors_side_by_side(readings[line * columns : (line + 1) * columns])
        picture = Image.fromarray(part).resize((part.shape[1] * cell, part.shape[0] * cell), Image.Resampling.NEAREST)
        frame.paste(picture, (PLAN + 16, 110 + line * (grid + 1) * cell))


class _Plan:
    """A floor plan as pixels, on which the way so far grows."""

    def __init__(self, floor: FloorMap) -> None:
        figure = style.new_figure(PLAN / 100, PLAN / 100)
        with style.styled():
            axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
            draw_floor(axes, floor)
        figure.set_layout_engine("none")
        figure.set_dpi(100)
        figure.canvas.draw()
        self.image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())  # type: ignore[attr-defined]
        self._to_pixels: Any = axes.transData.frozen()

    def go(self, track: Trace, step: int) -> None:
        """Draw the last step's stretch of the way, and a red dot where it hit something."""
        if step == 0:
            return
        pen = ImageDraw.Draw(self.image)
        a, b = self.pixels(track["positions"][step - 1 : step + 1])
        red, green, blue, _ = style.TIME(step / max(1, len(track["actions"])))
        pen.line([*a, *b], fill=(round(255 * red), round(255 * green), round(255 * blue)), width=3)
        if track["collisions"][step - 1]:
            pen.ellipse([*(b - 4), *(b + 4)], fill=style.COLLISION)

    def picture(self, track: Trace, step: int, goal: Any) -> Image.Image:
        """The plan with goal and agent at a step; the agent is a triangle that points where it looks."""
        image = self.image.copy()
        pen = ImageDraw.Draw(image)
        if goal is not None:
            x, z = self.pixels(np.asarray(goal, np.float64)[None])[0]
            pen.ellipse([x - 8, z - 8, x + 8, z + 8], fill=style.GOAL, outline=style.PAPER, width=2)
        here = self.pixels(track["positions"][step][None])[0]
        ahead = forward(track["yaws"][step])[[0, 2]]  # x to the right, z down, as pixels go
        side = np.array([-ahead[1], ahead[0]])
        corners = [here + 15 * ahead, here - 9 * ahead + 9 * side, here - 9 * ahead - 9 * side]
        pen.polygon([tuple(corner) for corner in corners], fill=style.START, outline=style.PAPER)
        return image

    def pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions (n, 3) [m] in pixels from the top left, (n, 2)."""
        x, y = self._to_pixels.transform(points[:, [0, 2]]).T
        return np.stack([x, PLAN - y], axis=1)
