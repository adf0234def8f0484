"""Rows of a run's metrics, as ``metrics.jsonl`` holds them, and the board that shows them."""

from __future__ import annotations

from typing import NotRequired, Protocol, TypedDict

from prnav.contracts import Array

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


class Board(Protocol):
    """What TensorBoard's writer is used for."""

    def add_scalar(self, tag: str, value: float, step: int) -> None:
        """A number of a step."""
        ...

    def add_image(self, tag: str, picture: Array, step: int, *, dataformats: str) -> None:
        """A picture of a step."""
        ...


class NoBoard:
    """Stands for the writer where another worker writes."""

    def add_scalar(self, tag: str, value: float, step: int) -> None:
        """Nothing."""

    def add_image(self, tag: str, picture: Array, step: int, *, dataformats: str) -> None:
        """Nothing."""
