"""What an agent is asked to do, and how well it did: rules and measures as pure functions of arrays."""

from prnav.tasks.measures import path_efficiency, soft_spl, spl
from prnav.tasks.pointgoal import PointGoalConfig
from prnav.tasks.rules import Rules, Verdict, judge
from prnav.tasks.targetnav import TargetNavConfig

__all__ = [
    "PointGoalConfig",
    "Rules",
    "TargetNavConfig",
    "Verdict",
    "judge",
    "path_efficiency",
    "soft_spl",
    "spl",
]
