"""Action heads: from what the memory says to a distribution over actions, one module per kind of action."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from prnav.aliases import Untyped
from prnav.contracts import ActionSpec, BoxActions, DiscreteActions
from prnav.policy.actions.categorical import Categorical, CategoricalHead
from prnav.policy.actions.gaussian import Gaussian, GaussianHead
from prnav.policy.actions.head import ActionDistribution, ActionHead, Exploration

HEADS: Mapping[type[Untyped], Callable[[Untyped], ActionHead]] = {
    DiscreteActions: CategoricalHead,
    BoxActions: GaussianHead,
}
"""The head of each kind of action."""


def action_head(spec: ActionSpec) -> ActionHead:
    """The head for what an agent can do."""
    return HEADS[type(spec)](spec)


__all__ = [
    "HEADS",
    "ActionDistribution",
    "ActionHead",
    "Categorical",
    "CategoricalHead",
    "Exploration",
    "Gaussian",
    "GaussianHead",
    "action_head",
]
