"""The seams between domains and learning: specs, batched environments, tasks and traces.

Domains implement what stands here; policy, train, design, evaluate and report know nothing else of them.
"""

from prnav.aliases import JSON, Array, JSONObject, Progress, Untyped
from prnav.contracts.agents import Agent, Turn
from prnav.contracts.envs import BatchEnv, Designable, EpisodeSlots, HasExpert, Info, Observations, State
from prnav.contracts.measures import MEASURES, Measure
from prnav.contracts.records import Evaluation, Header, Outcome, Played, Trace
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
from prnav.contracts.tasks import (
    EpisodeRequest,
    EvaluationSpec,
    Pictures,
    ProbeSpec,
    StateProbe,
    TaskConfig,
    TaskSpec,
    World,
)

__all__ = [
    "Untyped",
    "Array",
    "Info",
    "JSON",
    "JSONObject",
    "MEASURES",
    "Agent",
    "EpisodeRequest",
    "Evaluation",
    "EvaluationSpec",
    "Header",
    "Measure",
    "Pictures",
    "Played",
    "ProbeSpec",
    "Progress",
    "StateProbe",
    "TaskConfig",
    "TaskSpec",
    "Trace",
    "Turn",
    "World",
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
