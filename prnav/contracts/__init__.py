"""The seams between domains and learning: specs, batched environments, tasks and traces.

Domains implement what stands here; policy, train, design, evaluate and report know nothing else of them.
"""

from prnav.contracts.envs import BatchEnv, Designable, EpisodeSlots, HasExpert, Observations, Outcome, State
from prnav.contracts.spaces import (
    ActionSpec,
    BoxActions,
    DiscreteActions,
    ObservationKind,
    ObservationSpec,
    ObservationSpecs,
    action_spec_of,
    observation_spec_of,
    spec_to_mapping,
)

__all__ = [
    "ActionSpec",
    "BatchEnv",
    "BoxActions",
    "Designable",
    "DiscreteActions",
    "EpisodeSlots",
    "HasExpert",
    "ObservationKind",
    "ObservationSpec",
    "ObservationSpecs",
    "Observations",
    "Outcome",
    "State",
    "action_spec_of",
    "observation_spec_of",
    "spec_to_mapping",
]
