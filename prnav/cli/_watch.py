"""Watching a training run: validation homes, pictures for TensorBoard, Weights & Biases."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from prnav.errors import ConfigError

if TYPE_CHECKING:
    from prnav.train import TrainConfig

Show = Callable[[dict[str, Any]], None]


def validation_environments(config: TrainConfig) -> VectorEnv:
    """One environment for each of the first episodes of the val split, dealt evenly over its homes.

    Episodes of the user's own come from their val split where they are a folder, else the built-in ones are played.
    """
    from prnav.domains.navigation.env import NavigationVectorEnv, load_source

    own = config.env.episodes is not None and config.env.episode_split is not None
    settings = (
        replace(config.env, episode_split="val")
        if own
        else replace(config.env, scenes="val", episodes=None, episode_split=None, max_scenes=None)
    )
    source = load_source(settings, limit=config.validation_episodes)
    return NavigationVectorEnv(len(source), settings, source)


def draw_validation(envs: VectorEnv, path: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The first agent's path (steps + 1, 3) [m] on its home's floor, as a picture (H, W, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from prnav.domains.navigation.maps import floor_of, make_maps
    from prnav.domains.navigation.pictures.topdown import draw_floor, draw_trajectory
    from prnav.evaluate.evaluator import Trajectory

    source = envs.slots.source  # type: ignore[attr-defined]
    scene, (start, goal) = source.scene_index[0], (source.starts[0], source.goals[0])
    name = source.world.scene_ids[scene]
    maps = make_maps([(name, source.world.navmeshes[scene], [start[1], goal[1]])])
    floor = floor_of(maps, name, start[1])
    assert floor is not None
    steps = len(path) - 1
    trajectory = Trajectory(path, np.zeros(len(path)), np.zeros(steps, np.int8), np.zeros(steps, np.bool_))
    figure = Figure(figsize=(5, 5), dpi=80)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw_floor(axes, floor)
    draw_trajectory(axes, trajectory, floor, goal)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def with_wandb(show: Show, project: str, config: TrainConfig) -> Show:
    """``show`` that also sends rows of metrics to a project of Weights & Biases.

    Raises:
        ConfigError: the package is not installed.
    """
    from prnav.config import to_mapping

    try:
        wandb = importlib.import_module("wandb")
    except ImportError as error:
        raise ConfigError("--wandb needs the package wandb; pip install wandb, or leave the option out") from error
    run = wandb.init(project=project, name=config.name, config=to_mapping(config))

    def send(row: dict[str, Any]) -> None:
        show(row)
        groups = ("measures", "losses", "times", "validation")
        run.log(
            {f"{group}/{name}": value for group in groups for name, value in row.get(group, {}).items()},
            step=row["step"],
        )

    return send
