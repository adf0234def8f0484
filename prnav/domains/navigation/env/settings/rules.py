"""How agents move, and how what they do is judged."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from prnav.domains.navigation.rules import Rules
from prnav.sim import SimConfig


def _no_rules() -> Rules:
    raise TypeError("NavigationConfig has no rules; make the config of a task, such as PointGoalEnvConfig")


@dataclass(frozen=True)
class RuleSettings:
    """Rules of the task and of movement; a task's own config says what class its rules are of."""

    rules: Rules = field(default_factory=_no_rules)
    """Table [env.rules], which checks its own values: rules of the task."""
    sim: SimConfig = field(default_factory=SimConfig)
    """Table [env.sim], which checks its own values: steps and turns."""

    def check(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: a reward is not finite, or ``sim`` is no such settings.
        """
        for name, value in (("success_reward", self.rules.success_reward), ("slack", self.rules.slack)):
            if not math.isfinite(value):
                raise ValueError(f"rules.{name} is {value!r}; it must be finite")
        if not isinstance(self.sim, SimConfig):
            raise ValueError(f"sim is {self.sim!r}; it must be a SimConfig (table [env.sim])")
