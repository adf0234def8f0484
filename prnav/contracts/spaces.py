"""What an agent can do and what it is shown, as plain data that a policy is built from and a checkpoint stores."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from prnav.aliases import JSON, JSONObject
from prnav.errors import ConfigError


@dataclass(frozen=True)
class DiscreteActions:
    """One of ``n`` actions, numbered from 0."""

    n: int

    def __post_init__(self) -> None:
        if self.n < 1:
            raise ConfigError(f"DiscreteActions: n is {self.n}; it must be at least 1")


@dataclass(frozen=True)
class BoxActions:
    """A vector of real numbers between bounds: the D actuators of a body."""

    low: tuple[float, ...]
    """Least value of each, (D,)."""
    high: tuple[float, ...]
    """Largest value of each, (D,)."""

    def __post_init__(self) -> None:
        if not self.low or len(self.low) != len(self.high):
            raise ConfigError(
                f"BoxActions: {len(self.low)} lower and {len(self.high)} upper bounds; give as many of each, at least 1"
            )
        for low, high in zip(self.low, self.high, strict=True):
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise ConfigError(f"BoxActions: bounds [{low}, {high}]; they must be finite, the lower one first")

    @property
    def size(self) -> int:
        """D."""
        return len(self.low)


ActionSpec = DiscreteActions | BoxActions

ObservationKind = Literal["receptors", "image", "design", "vector"]
"""How an observation is to be understood: photoreceptor readings (K, P, 3) in 0..1, pictures (K, H, W, 3) in bytes,
normalised sensor designs (K, E), or a vector (n,)."""

KINDS: tuple[ObservationKind, ...] = ("receptors", "image", "design", "vector")


@dataclass(frozen=True)
class ObservationSpec:
    """One named observation of one agent."""

    shape: tuple[int, ...]
    """Without the batch axis."""
    kind: ObservationKind
    dtype: str = "float32"
    """NumPy's name of the type: "float32", or "uint8" for pictures."""
    low: float = -math.inf
    """Least value that any entry takes; :class:`ObservationSpec` promises no more than these two bounds."""
    high: float = math.inf


ObservationSpecs = Mapping[str, ObservationSpec]
"""Specs by the name under which the observation is found."""


def spec_to_mapping(spec: ActionSpec | ObservationSpec) -> JSONObject:
    """The spec in JSON's types, for checkpoints and ``run.json``."""
    if isinstance(spec, DiscreteActions):
        return {"n": spec.n}
    if isinstance(spec, BoxActions):
        return {"low": list(spec.low), "high": list(spec.high)}
    return {"shape": list(spec.shape), "kind": spec.kind, "dtype": spec.dtype}


def action_spec_of(stored: Mapping[str, JSON]) -> ActionSpec:
    """The action spec that :func:`spec_to_mapping` stored.

    Raises:
        ConfigError: it is none.
    """
    if set(stored) == {"n"}:
        return DiscreteActions(int(stored["n"]))
    if set(stored) == {"low", "high"}:
        return BoxActions(tuple(map(float, stored["low"])), tuple(map(float, stored["high"])))
    raise ConfigError(f"actions are stored as {dict(stored)}; valid: {{n}}, or {{low, high}}")


def observation_spec_of(stored: Mapping[str, JSON]) -> ObservationSpec:
    """The observation spec that :func:`spec_to_mapping` stored.

    Raises:
        ConfigError: it is none.
    """
    kind = stored.get("kind")
    if kind not in KINDS or not isinstance(stored.get("shape"), list | tuple):
        raise ConfigError(f"an observation is stored as {dict(stored)}; it needs a shape and a kind among {KINDS}")
    return ObservationSpec(tuple(int(size) for size in stored["shape"]), kind, str(stored.get("dtype", "float32")))
