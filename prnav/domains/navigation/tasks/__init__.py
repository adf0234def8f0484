"""What an agent is asked to do, and how well it did: rules and measures as pure functions of arrays."""

from prnav.domains.navigation.tasks.measures import path_efficiency, soft_spl, spl
from prnav.domains.navigation.tasks.pointgoal import PointGoalConfig
from prnav.domains.navigation.tasks.rules import Rules, Verdict, judge
from prnav.domains.navigation.tasks.targetnav import TargetNavConfig

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
