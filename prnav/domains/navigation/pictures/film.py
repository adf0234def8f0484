"""Films of episodes as MP4: the way on the floor plan, what the receptors read, and the action, step by step."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON, Untyped
from prnav.contracts.records import Evaluation, Trace, pick_episodes
from prnav.domains.navigation.maps import FloorMap, load_maps
from prnav.domains.navigation.pictures.frame import HEIGHT, WIDTH, Frame, Plan, Words, compose
from prnav.domains.navigation.pictures.sights import ACTION_NAMES
from prnav.domains.navigation.pictures.topdown import caption, floors_of
from prnav.domains.navigation.sights import load_sights
from prnav.errors import PrnavError
from prnav.files import atomic_path

SECONDS = 30.0
"""A film runs for about so long, between 6 and 30 steps a second."""


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


def encoder() -> Untyped:
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
    row: Mapping[str, JSON],
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
    plans = [Plan(floor) for floor in floors]
    heights = np.array([floor.height for floor in floors])
    of_step = np.abs(track["positions"][:, 1, None] - heights).argmin(axis=1)
    goal = row.get("goal")
    shown = 0 if goal is None else int(np.abs(float(goal[1]) - heights).argmin())
    positions, actions, collisions = track["positions"], track["actions"], track["collisions"]
    for step in range(len(positions)):
        plan = plans[of_step[step]]
        if step:
            plan.go(positions[step - 1 : step + 1], step / len(actions), bool(collisions[step - 1]))
        image = plan.image.copy()
        plan.put(image, positions[step], track["yaws"][step], goal if of_step[step] == shown else None)
        last = step == len(actions)
        words = Words(
            title,
            caption(row),
            f"step {step}: {'end' if last else ACTION_NAMES[actions[step]]}",
            not last and bool(collisions[step]),
        )
        yield compose(image, None if readings is None else readings[step], words)
