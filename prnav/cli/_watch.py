"""Watching a training run: validation episodes, Weights & Biases."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from prnav.errors import ConfigError

if TYPE_CHECKING:
    from prnav.train import MetricsRow, TrainConfig
    from prnav.train.validation import Validation

Show = Callable[["MetricsRow"], None]


def load_validation(config: TrainConfig) -> Validation:
    """The first episodes of what a run is validated on, dealt evenly over their scenes."""
    from prnav.train.validation import Validation

    spec = config.spec
    settings = spec.validation(config.env)
    world = spec.load(settings, limit=config.validation_episodes)
    slots = spec.make_slots(settings, world, config.validation_episodes)
    return Validation(slots, lambda trace: spec.pictures.trace(world, 0, trace))


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

    def send(row: MetricsRow) -> None:
        show(row)
        groups = {"measures": row["measures"], "losses": row["losses"], "times": row["times"]}
        groups["validation"] = row.get("validation", {})
        run.log(
            {f"{group}/{name}": value for group, values in groups.items() for name, value in values.items()},
            step=row["step"],
        )

    return send
