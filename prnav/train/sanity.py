"""Early warnings: what a run that goes nowhere looks like, said once each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from prnav.aliases import JSON
from prnav.policy import ActionHead


@dataclass(frozen=True)
class Bounds:
    """When to warn."""

    exploration_share: float = 0.02
    """Of what a policy that knows nothing has of entropy, or where actions are real of standard deviation: below it
    nothing new is tried."""
    kl: float = 0.3
    """Mean divergence of an update beyond which the policy jumps rather than walks."""
    patience: int = 10
    """Updates in a row that must look so."""
    hopeless_episodes: int = 2000
    """Episodes without one success."""


class Sanity:
    """Watches rows of metrics."""

    def __init__(self, head: ActionHead, bounds: Bounds = Bounds()) -> None:  # noqa: B008 (frozen)
        self.bounds = bounds
        self.exploration = head.exploration(bounds.exploration_share)
        self._counts = {"exploration": 0, "kl": 0}
        self._said: set[str] = set()
        self._succeeded = False

    def check(self, row: Mapping[str, JSON]) -> list[str]:
        """What is to be said after this row."""
        bounds, losses, measures = self.bounds, row["losses"], row["measures"]
        found: dict[str, str] = {}
        sign = self.exploration
        if self._lasts("exploration", losses.get(sign.metric, math.inf) < sign.least):
            found["exploration"] = (
                f"{sign.complaint.format(least=sign.least)} for {bounds.patience} updates: it tries nothing new; raise "
                f"ppo.entropy_coefficient or lower ppo.learning_rate"
            )
        if self._lasts("kl", losses.get("kl", 0.0) > bounds.kl):
            found["kl"] = (
                f"the policy has moved by more than {bounds.kl} nats (kl) in each of {bounds.patience} updates; lower "
                f"ppo.learning_rate or ppo.epochs"
            )
        self._succeeded |= measures.get("success", 1.0) > 0.0
        if not self._succeeded and row["episodes"] >= bounds.hopeless_episodes:
            found["success"] = (
                f"none of the last episodes of {row['episodes']:,} so far has succeeded; check the goals "
                f"(prnav-episodes check), or begin with --warmstart imitation"
            )
        new = [text for name, text in found.items() if name not in self._said]
        self._said |= found.keys()
        return [f"step {row['step']:,}: {text}" for text in new]

    def _lasts(self, name: str, bad: bool) -> bool:
        self._counts[name] = self._counts[name] + 1 if bad else 0
        return self._counts[name] >= self.bounds.patience
