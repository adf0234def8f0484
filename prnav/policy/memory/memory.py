"""What every kind of memory does: carry a state from step to step, and say how a rollout is cut for learning.

Letters in shapes: T steps, N environments, B rows, F features, O outputs. A rollout's rows are numbered t * N + n.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from prnav.aliases import Array

MemoryState = dict[str, Tensor]
"""What a memory carries from step to step. Only the memory itself knows what the tensors mean."""

Rows = slice | Tensor
"""Which environments: a slice, or their indices (n,) int64."""


class Inputs(NamedTuple):
    """What a memory is given."""

    features: Tensor
    """Encodings, and what is known of the previous actions, (B, F)."""
    fixes: Tensor | None
    """GPS and compass, (B, 3), where there are any."""


class Cut(NamedTuple):
    """Part of a rollout that losses are taken of, and what must be at hand for it."""

    targets: NDArray[np.int64]
    """Rows whose losses are taken, (M,)."""
    frames: NDArray[np.int64]
    """Rows whose observations must be encoded for them, each once, (U,)."""
    environments: NDArray[np.int64]
    """Environments whose state before the rollout is needed, (E,)."""
    plan: object
    """How the memory gets from the frames to the targets."""


class Cutter(Protocol):
    """Cuts one rollout."""

    units: int
    """How many indivisible parts the rollout has."""

    def cut(self, units: NDArray[np.int64]) -> Cut:
        """The part of the rollout that these units (n,) make."""
        ...


class Memory(nn.Module, ABC):
    """From the features of a step, and of those before it in the episode, to what actor and critic are given.

    Acting step by step and learning from a cut give the same outputs.
    """

    outputs: int
    """O."""

    @abstractmethod
    def initial_state(self, environments: int) -> MemoryState:
        """MemoryState of N environments before the first step."""

    @abstractmethod
    def select(self, state: MemoryState, rows: Rows) -> MemoryState:
        """MemoryState of some environments, for a slice as views."""

    @abstractmethod
    def step(self, inputs: Inputs, state: MemoryState, starts: Tensor) -> tuple[Tensor, MemoryState]:
        """One step: inputs (N, ...), state before it, starts (N,) bool -> outputs (N, O), state after it.

        Where ``starts``, what came before is forgotten.
        """

    @abstractmethod
    def sequence(self, inputs: Inputs, state: MemoryState, starts: Tensor, plan: object) -> Tensor:
        """Outputs (M, O) of a cut's targets.

        Args:
            inputs: Of its frames, (U, ...).
            state: Of its environments, before the rollout.
            starts: Of its frames, (U,) bool.
            plan: Its plan.
        """

    @abstractmethod
    def cutter(self, starts: NDArray[np.bool_], device: torch.device) -> Cutter:
        """What cuts a rollout whose ``starts`` (T, N) mark the first step of each episode; plans lie on ``device``."""

    def restored(self, stored: Mapping[str, Array] | Array) -> MemoryState:
        """The state that a checkpoint holds as arrays, on the host."""
        assert isinstance(stored, Mapping)
        return {name: torch.as_tensor(value) for name, value in stored.items()}
