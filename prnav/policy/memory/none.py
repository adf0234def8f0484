"""No memory: actor and critic are given the features of the step alone."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from prnav.policy.config import PolicyConfig
from prnav.policy.memory.memory import Cut, Cutter, Inputs, Memory, MemoryState, Rows


class NoMemory(Memory):
    """Features go through as they are. MemoryState: nothing."""

    def __init__(self, features: int, config: PolicyConfig, fixes: bool) -> None:
        super().__init__()
        self.outputs = features

    def initial_state(self, environments: int) -> MemoryState:
        """Nothing."""
        return {}

    def select(self, state: MemoryState, rows: Rows) -> MemoryState:
        """Nothing."""
        return {}

    def step(self, inputs: Inputs, state: MemoryState, starts: Tensor) -> tuple[Tensor, MemoryState]:
        """One step of N environments."""
        return inputs.features, {}

    def sequence(self, inputs: Inputs, state: MemoryState, starts: Tensor, plan: object) -> Tensor:
        """The features of the frames, which are the targets."""
        return inputs.features

    def cutter(self, starts: NDArray[np.bool_], device: torch.device) -> Cutter:
        """Mini-batches are made of single steps."""
        return RowCutter(starts)


class RowCutter:
    """Cuts a rollout into single steps."""

    def __init__(self, starts: NDArray[np.bool_]) -> None:
        self.units = starts.size

    def cut(self, units: NDArray[np.int64]) -> Cut:
        """The rows ``units`` (M,)."""
        return Cut(units, units, units[:0], None)
