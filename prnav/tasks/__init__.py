"""What an agent is asked to do, and how well it did: rules and measures as pure functions of arrays."""

from prnav.tasks.measures import path_efficiency, soft_spl, spl
from prnav.tasks.pointgoal import PointGoalConfig

__all__ = ["PointGoalConfig", "path_efficiency", "soft_spl", "spl"]
