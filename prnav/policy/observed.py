"""How an encoder finds what it reads: by the kind of an observation, whatever its name."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from prnav.contracts import ObservationKind, ObservationSpecs
from prnav.errors import ConfigError

Observations = Mapping[str, Tensor]
"""Observations (B, ...) by name."""

TITLES: Mapping[ObservationKind, str] = {"receptors": "photoreceptor readings", "image": "pictures"}


def vector_keys(specs: ObservationSpecs) -> list[str]:
    """Names of the vector observations, in a fixed order."""
    return sorted(name for name, spec in specs.items() if spec.kind == "vector")


def seen_with_design(specs: ObservationSpecs, kind: ObservationKind, encoder: str, remedy: str) -> tuple[str, str]:
    """Names of the observation of that kind and of the design of its sensors.

    Raises:
        ConfigError: one is missing, or there are several; ``encoder`` and ``remedy`` are then told.
    """
    found = [[name for name, spec in specs.items() if spec.kind == wanted] for wanted in (kind, "design")]
    if any(len(names) != 1 for names in found):
        given = ", ".join(f"{name} ({spec.kind})" for name, spec in sorted(specs.items())) or "nothing"
        raise ConfigError(
            f"policy encoder {encoder!r} needs one observation of {TITLES[kind]} and one of their design; the "
            f"environment gives {given}; {remedy}"
        )
    return found[0][0], found[1][0]


def batch_size(observations: Observations) -> int:
    """B."""
    return len(next(iter(observations.values())))
