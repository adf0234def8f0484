"""One training run as pure data: what ``configs/*.toml`` hold."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from prnav import catalog
from prnav.checks import require_at_least
from prnav.config import TYPE_OF, load_config
from prnav.contracts import TaskConfig, TaskSpec
from prnav.errors import ConfigError
from prnav.policy import PolicyConfig
from prnav.resources import resource
from prnav.train.imitation import ImitationConfig
from prnav.train.mini_batches import check_mini_batches
from prnav.train.ppo import PPOConfig


@dataclass(frozen=True)
class TrainConfig:
    """A run: task and environment, policy, PPO, warm start, budget."""

    name: str = "run"
    """Run directory under ``runs/`` where none is given."""
    task: str = "pointgoal"
    """What is learnt: a name of :mod:`prnav.catalog`. It says what class ``env`` is of."""
    seed: int = 0
    """Seed of weights, actions and episode order."""
    total_steps: int = 1_000_000
    """Simulation steps in all, those of the warm start included."""
    num_envs: int = 30
    """Environments of each worker."""
    groups: int = 2
    """Groups that a worker's environments are simulated in side by side: while the policy decides for one, another
    walks and sees. The same number gives the same bits."""
    sync_fraction: float = 1.0
    """With several workers, the share of them that must have finished a rollout before those that still collect are
    cut short (DD-PPO's preemption; its published code has 0.6). It makes results depend on the machine's load; 1 waits
    for all."""
    device: Literal["auto", "cpu", "cuda"] = "auto"
    threads: int = 0
    """Cores that the learner uses on a CPU; 0 is all. The same number gives the same bits."""
    checkpoint_steps: int = 100_000
    keep_checkpoints: int = 3
    validate_steps: int = 0
    """Steps between two validations on the val split, by which the best checkpoint is kept; 0 is never."""
    validation_episodes: int = 64
    precision: Literal["float32", "tf32", "bfloat16"] = "float32"
    """Of the encoder's products on a GPU: "tf32" for all of the policy's, "bfloat16" for the encoder's."""
    compile: bool = False
    """Whether torch compiles the encoder: pays on a GPU, after a minute."""
    window: int = 200
    """Episodes over which the reported success, SPL and reward are averaged."""
    env: TaskConfig = field(default=None, metadata={TYPE_OF: catalog.config_type})
    """Settings of the task; its defaults where left out."""
    policy: PolicyConfig = field(default_factory=PolicyConfig)
    ppo: PPOConfig = field(default_factory=PPOConfig)
    imitation: ImitationConfig = field(default_factory=ImitationConfig)

    def __post_init__(self) -> None:
        positive = ("total_steps", "num_envs", "groups", "checkpoint_steps", "keep_checkpoints", "validation_episodes")
        require_at_least(self, 1, *positive, "window")
        wanted = self.spec.config_type
        if self.env is None:
            object.__setattr__(self, "env", wanted())
        elif not isinstance(self.env, wanted):
            raise ValueError(
                f"task is {self.task!r} and env is a {type(self.env).__name__}; it must be a {wanted.__name__}"
            )
        require_at_least(self, 0, "seed", "threads", "validate_steps")
        if not 0.0 < self.sync_fraction <= 1.0:
            raise ValueError(f"sync_fraction is {self.sync_fraction}; it must be above 0 and at most 1")
        check_mini_batches(self.ppo, self.imitation, self.policy, self.num_envs)

    @property
    def spec(self) -> TaskSpec:
        """The task.

        Raises:
            ConfigError: there is none of that name.
        """
        return catalog.task_spec(self.task)


FREE_ON_RESUME = frozenset(
    {
        "name",
        "total_steps",
        "groups",
        "checkpoint_steps",
        "keep_checkpoints",
        "validate_steps",
        "validation_episodes",
        "threads",
        "device",
    }
)
"""Keys that a resumed run may change; ``groups`` only to what its checkpoint has."""


def group_sizes(num_envs: int, groups: int) -> list[int]:
    """How many environments each group has: as even as can be, none empty."""
    groups = min(groups, num_envs)
    return [num_envs // groups + (place < num_envs % groups) for place in range(groups)]


def config_names() -> list[str]:
    """Names of the shipped experiments."""
    return sorted(path.stem for path in resource("configs").glob("*.toml") if not path.stem.startswith("design-"))


def config_path(name: str) -> Path:
    """File of a shipped experiment, or ``name`` itself where it is a path.

    Raises:
        ConfigError: neither.
    """
    if name in config_names():
        return resource("configs", f"{name}.toml")
    if name.endswith(".toml") or os.sep in name:
        return Path(name)
    raise ConfigError(f"config {name!r} is not known; valid: {', '.join(config_names())}, or the path of a TOML file")


def load_train_config(name: str, overrides: tuple[str, ...] = ()) -> TrainConfig:
    """Config of a shipped experiment or a TOML file, with ``key=value`` overrides.

    Raises:
        ConfigError: as :func:`prnav.config.load_config`.
    """
    return load_config(TrainConfig, config_path(name), overrides)


def without_readings(config: TrainConfig) -> TrainConfig:
    """The same run for a blind agent: no readings are rendered or seen."""
    return replace(
        config,
        name=f"{config.name}-blind",
        env=config.spec.blind(config.env),
        policy=replace(config.policy, encoder="blind"),
    )
