"""What is fixed about each control task, and known without MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from prnav.errors import ControlError

EPISODE_STEPS = 1000
"""Simulation steps of an episode, of every task; also the largest return."""


LARGEST = 1e10
"""Positions and velocities beyond this are a diverged simulation, as MuJoCo has it (mjMAXVAL)."""


@dataclass(frozen=True)
class TaskFacts:
    """One task of the DeepMind Control Suite as the paper plays it (appendix "Continuous Control").

    A *simulation step* is one control step of the suite: the physics advances by ``physics_steps`` steps and one reward
    is given. All counts of steps, and the paper's budgets, are in simulation steps. The agent decides once every
    ``action_repeat`` of them, and its reward is their sum.
    """

    name: str
    """As it is typed, for example "walker-walk"."""
    body: Literal["reacher", "walker", "finger"]
    title: str
    """As the paper writes it."""
    physics_steps: int
    """Steps of the physics per simulation step."""
    step_seconds: float
    """Simulated time of one simulation step [s]."""
    action_repeat: int
    """Simulation steps that one action lasts in the paper."""
    actions: int
    """Number of motors; each takes a number in -1..1."""
    observations: tuple[tuple[str, int], ...]
    """Names and sizes of the suite's own observation (the state), in its order."""
    env_name: str
    """Of the Gymnasium environment "prnav/{env_name}-v0"."""
    paper_steps: int
    """Simulation steps of a training with a fixed design in the paper."""

    @property
    def observation_size(self) -> int:
        """Numbers in the state."""
        return sum(size for _, size in self.observations)


_REACHER = (("position", 2), ("to_target", 2), ("velocity", 2))
_WALKER = (("orientations", 14), ("height", 1), ("velocity", 9))
_SPIN = (("position", 4), ("velocity", 3), ("touch", 2))
_TURN = (*_SPIN, ("target_position", 2), ("dist_to_target", 1))
_MILLION = 1_000_000

TASKS: dict[str, TaskFacts] = {
    facts.name: facts
    for facts in (
        TaskFacts("reacher-hard", "reacher", "Reacher: Hard", 1, 0.02, 2, 2, _REACHER, "ReacherHard", 100 * _MILLION),
        TaskFacts("walker-stand", "walker", "Walker: Stand", 10, 0.025, 2, 6, _WALKER, "WalkerStand", 200 * _MILLION),
        TaskFacts("walker-walk", "walker", "Walker: Walk", 10, 0.025, 2, 6, _WALKER, "WalkerWalk", 200 * _MILLION),
        TaskFacts("walker-run", "walker", "Walker: Run", 10, 0.025, 2, 6, _WALKER, "WalkerRun", 200 * _MILLION),
        TaskFacts("finger-spin", "finger", "Finger: Spin", 2, 0.02, 2, 2, _SPIN, "FingerSpin", 200 * _MILLION),
        TaskFacts(
            "finger-turn-easy", "finger", "Finger: Turn Easy", 2, 0.02, 4, 2, _TURN, "FingerTurnEasy", 300 * _MILLION
        ),
    )
}
"""All tasks by name."""


def task_facts(name: str) -> TaskFacts:
    """Facts of a task.

    Raises:
        ControlError: there is no task of that name.
    """
    if name not in TASKS:
        raise ControlError(f"control task {name!r} is unknown; valid: {', '.join(TASKS)}")
    return TASKS[name]
