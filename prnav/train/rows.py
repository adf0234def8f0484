"""Rows of a run's metrics, as ``metrics.jsonl`` holds them."""

from __future__ import annotations

from typing import NotRequired, TypedDict

Numbers = dict[str, float]
"""By name."""


class MetricsRow(TypedDict):
    """What one update of a run gave."""

    step: int
    """Simulation steps so far."""
    update: int
    """Updates so far."""
    episodes: int
    """Episodes that ended so far."""
    phase: str
    """What the update was for: "imitation", "ppo", "design"."""
    measures: Numbers
    """Means over the latest episodes."""
    losses: Numbers
    times: Numbers
    """Seconds, and steps per second."""
    validation: NotRequired[Numbers]
    """Measures of the validation, where one was due."""


class Counters(TypedDict):
    """How far a run has come."""

    step: int
    updates: int
    episodes: int


class Share(TypedDict):
    """What one worker tells the others of an update."""

    steps: int
    ended: list[dict[str, float]]
    losses: dict[str, float]
