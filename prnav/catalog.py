"""All tasks by name, one line each. A task's code is imported when the task is asked for, and not before.

This module imports no domain: it knows where each is by name, so that training, design, evaluation and reports can ask
for a task without knowing what it is made of.
"""

from __future__ import annotations

from collections.abc import Mapping

from prnav.contracts import TaskSpec
from prnav.errors import ConfigError
from prnav.registry import resolve

TASKS: dict[str, str] = {
    "pointgoal": "prnav.domains.navigation.pointgoal:SPEC",
    "targetnav": "prnav.domains.navigation.targetnav:SPEC",
    "control/reacher-hard": "prnav.domains.control.suite:REACHER_HARD",
    "control/walker-stand": "prnav.domains.control.suite:WALKER_STAND",
    "control/walker-walk": "prnav.domains.control.suite:WALKER_WALK",
    "control/walker-run": "prnav.domains.control.suite:WALKER_RUN",
    "control/finger-spin": "prnav.domains.control.suite:FINGER_SPIN",
    "control/finger-turn-easy": "prnav.domains.control.suite:FINGER_TURN_EASY",
}
"""Name of a task -> module and attribute of its :class:`~prnav.contracts.TaskSpec`."""

DEFAULT_TASK = "pointgoal"
"""What is played where no task is named."""

GYMNASIUM: dict[str, str] = {
    "PointGoalNav": "prnav.domains.navigation.pointgoal",
    "TargetNav": "prnav.domains.navigation.targetnav",
    "ReacherHard": "prnav.domains.control.suite",
    "WalkerStand": "prnav.domains.control.suite",
    "WalkerWalk": "prnav.domains.control.suite",
    "WalkerRun": "prnav.domains.control.suite",
    "FingerSpin": "prnav.domains.control.suite",
    "FingerTurnEasy": "prnav.domains.control.suite",
}
"""Name of a Gymnasium environment -> module that has its classes ``NAMEEnv`` and ``NAMEVectorEnv``."""


def task_names() -> list[str]:
    """Names of all tasks."""
    return list(TASKS)


def task_spec(name: str) -> TaskSpec:
    """The task of that name.

    Raises:
        ConfigError: there is none.
    """
    if name not in TASKS:
        raise ConfigError(f"task is {name!r}; valid: {', '.join(map(repr, TASKS))}")
    spec: TaskSpec = resolve(TASKS, name)
    return spec


def config_type(table: Mapping[str, object]) -> type:
    """Class of the table [env] in a config that names its ``task``, as :func:`prnav.config.from_mapping` asks.

    Raises:
        ConfigError: no such task.
    """
    return task_spec(str(table.get("task", DEFAULT_TASK))).config_type


def register() -> None:
    """Register the environments with Gymnasium; their classes are imported when one is made."""
    import gymnasium

    for name, module in GYMNASIUM.items():
        gymnasium.register(
            id=f"prnav/{name}-v0",
            entry_point=f"{module}:{name}Env",
            vector_entry_point=f"{module}:{name}VectorEnv",
            order_enforce=False,
            disable_env_checker=True,
        )
