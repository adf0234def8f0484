"""What a control environment is made of, as pure data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from prnav.domains.control.facts import EPISODE_STEPS, TASKS, TaskFacts

Senses = Literal["receptors", "camera", "third-person", "state", "nothing"]
"""What an agent is given: readings of photoreceptors or pictures of cameras on its body, a picture of the suite's own
camera beside it, the suite's observation (the state), or nothing (the paper's intelligent blind agent)."""

SENSES: tuple[Senses, ...] = ("receptors", "camera", "third-person", "state", "nothing")


@dataclass(frozen=True)
class ControlConfig:
    """Task, senses and sensors of a control environment."""

    task: str = "walker-walk"
    """"reacher-hard", "walker-stand", "walker-walk", "walker-run", "finger-spin" or "finger-turn-easy"."""
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
    threads: int = 1
    """Threads that simulate and cast rays; results are the same whatever their number."""

    def __post_init__(self) -> None:
        if self.task not in TASKS:
            raise ValueError(f"task is {self.task!r}; valid: {', '.join(map(repr, TASKS))}")
        if self.senses not in SENSES:
            raise ValueError(f"senses is {self.senses!r}; valid: {', '.join(map(repr, SENSES))}")
        if self.floor not in ("today", "mujoco-3.11"):
            raise ValueError(f"floor is {self.floor!r}; valid: 'today', 'mujoco-3.11'")
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
