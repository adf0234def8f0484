"""What a control environment is made of, as pure data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from prnav.domains.control.facts import EPISODE_STEPS, TASKS, TaskFacts
from prnav.errors import ConfigError

Senses = Literal["receptors", "camera", "third-person", "state", "nothing"]
"""What an agent is given: readings of photoreceptors or pictures of cameras on its body, a picture of the suite's own
camera beside it, the suite's observation (the state), or nothing (the paper's intelligent blind agent)."""

SENSES: tuple[Senses, ...] = ("receptors", "camera", "third-person", "state", "nothing")

SPLITS: dict[str, tuple[int, int]] = {"train": (1_000_000, 1000), "val": (2_000_000, 32), "test": (3_000_000, 100)}
"""Seed of the first episode of each split, and how many there are."""


@dataclass(frozen=True)
class ControlConfig:
    """Senses and sensors of a control environment. Each task has a class of its own (:func:`config_of`)."""

    task: ClassVar[str]
    """Name of the task, for example "walker-walk"."""
    senses: Senses = "receptors"
    """"receptors", "camera", "third-person", "state" or "nothing"."""
    design: str = ""
    """Sensor design: name of a built-in one, or path of a design file; empty takes the body's standard one. Without
    effect for the senses "third-person" and "state"."""
    grid: int = 1
    """B: each sensor splits its view into B x B photoreceptors."""
    rays_per_receptor: int = 16
    """Rays that are averaged in one reading, a square number."""
    camera_size: int = 84
    """Pixels per side of pictures."""
    action_repeat: int = 0
    """Simulation steps that one action lasts, a divisor of 1,000; 0 takes the paper's (2, and 4 for Turn Easy)."""
    floor: Literal["today", "mujoco-3.11"] = "today"
    """Where the floor's texture begins: as MuJoCo draws it now, or did at the time of the paper."""
    split: str = "train"
    """Which episodes a list of them holds: "train", "val" or "test" (:func:`split_seeds`). Vector environments play
    episodes without end, which their own seed names."""
    threads: int = 1
    """Threads that simulate and cast rays; results are the same whatever their number."""

    def __post_init__(self) -> None:
        if self.senses not in SENSES:
            raise ValueError(f"senses is {self.senses!r}; valid: {', '.join(map(repr, SENSES))}")
        if self.floor not in ("today", "mujoco-3.11"):
            raise ValueError(f"floor is {self.floor!r}; valid: 'today', 'mujoco-3.11'")
        if self.split not in SPLITS:
            raise ValueError(f"split is {self.split!r}; valid: {', '.join(map(repr, SPLITS))}")
        for name in ("grid", "rays_per_receptor", "camera_size", "threads"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least 1")
        if self.action_repeat < 0 or EPISODE_STEPS % self.repeat:
            raise ValueError(
                f"action_repeat is {self.action_repeat}; it must divide the {EPISODE_STEPS} steps of an episode, "
                "or be 0 for the paper's"
            )

    @property
    def facts(self) -> TaskFacts:
        """Facts of the task."""
        return TASKS[self.task]

    @property
    def repeat(self) -> int:
        """Simulation steps that one action lasts."""
        return self.action_repeat or self.facts.action_repeat

    @property
    def designed(self) -> bool:
        """Whether the agent has sensors on its body that a design places."""
        return self.senses in ("receptors", "camera", "nothing")


@dataclass(frozen=True)
class ReacherHardConfig(ControlConfig):
    """Settings of Reacher: Hard."""

    task = "reacher-hard"


@dataclass(frozen=True)
class WalkerStandConfig(ControlConfig):
    """Settings of Walker: Stand."""

    task = "walker-stand"


@dataclass(frozen=True)
class WalkerWalkConfig(ControlConfig):
    """Settings of Walker: Walk."""

    task = "walker-walk"


@dataclass(frozen=True)
class WalkerRunConfig(ControlConfig):
    """Settings of Walker: Run."""

    task = "walker-run"


@dataclass(frozen=True)
class FingerSpinConfig(ControlConfig):
    """Settings of Finger: Spin."""

    task = "finger-spin"


@dataclass(frozen=True)
class FingerTurnEasyConfig(ControlConfig):
    """Settings of Finger: Turn Easy."""

    task = "finger-turn-easy"


CONFIGS: dict[str, type[ControlConfig]] = {
    cls.task: cls
    for cls in (
        ReacherHardConfig,
        WalkerStandConfig,
        WalkerWalkConfig,
        WalkerRunConfig,
        FingerSpinConfig,
        FingerTurnEasyConfig,
    )
}
"""Class of each task's settings."""


def config_of(task: str) -> type[ControlConfig]:
    """Class of a task's settings.

    Raises:
        ConfigError: the task is unknown.
    """
    if task not in CONFIGS:
        raise ConfigError(f"control task {task!r} is unknown; valid: {', '.join(CONFIGS)}")
    return CONFIGS[task]


def split_seeds(split: str) -> range:
    """Seeds of a split's episodes; they are the same for all tasks, and no two splits share any."""
    first, count = SPLITS[split]
    return range(first, first + count)
