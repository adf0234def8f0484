"""What a policy's agents are shown and can do, as a checkpoint holds it."""

from __future__ import annotations

from collections.abc import Mapping

from prnav.aliases import JSON, JSONObject
from prnav.contracts import (
    ActionSpec,
    DiscreteActions,
    ObservationKind,
    ObservationSpec,
    ObservationSpecs,
    action_spec_of,
    observation_spec_of,
    spec_to_mapping,
)

FIRST_KINDS: Mapping[str, ObservationKind] = {"photoreceptors": "receptors", "camera": "image", "design": "design"}
"""Kinds of the observations that checkpoints of the first version name; all others are vectors."""


def stored_specs(observations: ObservationSpecs, actions: ActionSpec) -> JSONObject:
    """Entries of a checkpoint's tree."""
    stored = {name: spec_to_mapping(spec) for name, spec in observations.items()}
    return {"observations": stored, "actions": spec_to_mapping(actions)}


def specs_of(tree: Mapping[str, JSON]) -> tuple[ObservationSpecs, ActionSpec]:
    """The specs in a checkpoint's tree; one of the first version has shapes and a number of discrete actions.

    Raises:
        ConfigError: they are none.
    """
    if "observations" in tree:
        stored = {name: observation_spec_of(spec) for name, spec in tree["observations"].items()}
        return stored, action_spec_of(tree["actions"])
    kinds = {name: FIRST_KINDS.get(name, "vector") for name in tree["shapes"]}
    specs = {
        name: ObservationSpec(tuple(shape), kinds[name], "uint8" if kinds[name] == "image" else "float32")
        for name, shape in tree["shapes"].items()
    }
    return specs, DiscreteActions(int(tree["actions"]))
