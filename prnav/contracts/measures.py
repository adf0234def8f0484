"""The vocabulary of measures: what they are called, and how they are printed and read. Tasks choose from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Measure:
    """How a measure is named, printed and read."""

    key: str
    label: str
    unit: str
    decimals: int
    better: int
    """+1 where more is better, -1 where less is, 0 where neither."""


MEASURES: tuple[Measure, ...] = (
    Measure("success", "Success", "", 3, +1),
    Measure("spl", "SPL", "", 3, +1),
    Measure("soft_spl", "SoftSPL", "", 3, +1),
    Measure("soft_spl_closest", "SoftSPL, closest", "", 3, +1),
    Measure("distance_to_goal", "Distance to goal", "m", 2, -1),
    Measure("collisions", "Collisions", "", 1, -1),
    Measure("path_length", "Path length", "m", 2, 0),
    Measure("steps", "Steps", "", 1, 0),
    Measure("reward", "Reward", "", 2, +1),
    Measure("return", "Return", "", 1, +1),
    Measure("diverged", "Diverged", "", 4, -1),
)
"""Measures that are reported where records have them, in this order."""

BY_KEY: Mapping[str, Measure] = {measure.key: measure for measure in MEASURES}
