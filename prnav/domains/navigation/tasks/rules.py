"""One way to judge a step, whatever the task."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.domains.navigation.tasks import pointgoal, targetnav
from prnav.domains.navigation.tasks.pointgoal import PointGoalConfig
from prnav.domains.navigation.tasks.targetnav import TargetNavConfig

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

Rules = PointGoalConfig | TargetNavConfig
"""Rules of a navigation task."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a step of N agents was worth."""

    success: Bools
    """Whether the episode succeeded with it, (N,)."""
    rewards: Floats
    """(N,)."""
    terminated: Bools
    """Whether the episode ended with it, not counting the time limit, (N,)."""


def judge(rules: Rules, stopped: Bools, before: Floats, after: Floats) -> Verdict:
    """Judge a step.

    Args:
        rules: of the task.
        stopped: where the action was stop, (N,); TargetNav has none.
        before: geodesic distance to the goal before the step [m], (N,).
        after: the same after it.
    """
    if isinstance(rules, TargetNavConfig):
        success = targetnav.succeeded(after, rules)
        return Verdict(success, targetnav.reward(success, before, after, rules), success)
    success = pointgoal.succeeded(stopped, after, rules)
    return Verdict(success, pointgoal.reward(stopped, success, before, after, rules), stopped)
