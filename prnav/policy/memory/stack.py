"""The last n frames' encodings side by side: the paper's memory in the DeepMind Control Suite (section "Architecture").

Frames before the start of an episode are zeros. What is kept from step to step is encodings, so that acting encodes
each frame once; while learning, each frame that a mini-batch needs is encoded once in that mini-batch. Of the rollout
before, the encodings as they were then are taken, as an LSTM takes its state: they touch the first n - 1 steps alone.

Letters in shapes: T steps, N environments, n frames, F features, M targets, U frames of a mini-batch, E environments
that began the rollout within an episode and whose first steps are among the targets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from prnav.policy.config import PolicyConfig
from prnav.policy.memory.memory import Cut, Cutter, Inputs, Memory, MemoryState, Rows

FAR = 1 << 40
"""Steps since the start of an episode that began before the rollout."""


@dataclass(frozen=True)
class Windows:
    """Where each target's frames stand."""

    index: Tensor
    """Rows of [U frames, E * (n - 1) earlier ones, zeros], oldest frame first, (n, M) int64."""


class StackMemory(Memory):
    """The features of the last n steps, oldest first, n * F of them.

    MemoryState: "frames" (N, n - 1, F), the last ones, oldest first, zeros where the episode had not begun.
    """

    device_of: Tensor

    def __init__(self, features: int, config: PolicyConfig, fixes: bool) -> None:
        super().__init__()
        self.frames, self.features, self.outputs = config.frames, features, config.frames * features
        self.register_buffer("device_of", torch.zeros(0), persistent=False)

    def initial_state(self, environments: int) -> MemoryState:
        """Zeros."""
        return {"frames": self.device_of.new_zeros(environments, self.frames - 1, self.features)}

    def select(self, state: MemoryState, rows: Rows) -> MemoryState:
        """MemoryState of some environments; a view of it for a slice."""
        return {"frames": state["frames"][rows]}

    def step(self, inputs: Inputs, state: MemoryState, starts: Tensor) -> tuple[Tensor, MemoryState]:
        """One step of N environments."""
        before = state["frames"].masked_fill(starts[:, None, None], 0.0)
        frames = torch.cat([before, inputs.features[:, None]], dim=1)
        return frames.flatten(1), {"frames": frames[:, 1:]}

    def sequence(self, inputs: Inputs, state: MemoryState, starts: Tensor, plan: object) -> Tensor:
        """Outputs of single steps; ``plan`` is their :class:`Windows`.

        Frame by frame of the windows, since no row is then taken twice: its gradient is a copy and no sum, the same
        bits on any device.
        """
        assert isinstance(plan, Windows)
        features = inputs.features
        rows = torch.cat([features, state["frames"].flatten(0, 1), features.new_zeros(1, self.features)])
        return torch.cat([rows.index_select(0, index) for index in plan.index], dim=1)

    def cutter(self, starts: NDArray[np.bool_], device: torch.device) -> Cutter:
        """Mini-batches are made of single steps."""
        return WindowCutter(starts, self.frames, device)


class WindowCutter:
    """Cuts a rollout into windows of n steps, each by its last one."""

    def __init__(self, starts: NDArray[np.bool_], frames: int, device: torch.device) -> None:
        self.steps, self.environments = starts.shape
        self.units, self.frames, self.device = starts.size, frames, device
        step = np.arange(self.steps)[:, None]
        self.age = (step - np.maximum.accumulate(np.where(starts, step, -FAR), axis=0)).ravel()
        """Steps since the episode's start, (T * N,)."""

    def cut(self, units: NDArray[np.int64]) -> Cut:
        """The rows ``units`` (M,)."""
        step, environment = np.divmod(units, self.environments)
        lag = np.arange(self.frames - 1, -1, -1)[:, None]
        source = step - lag
        alive = lag <= self.age[units]
        inside, before = alive & (source >= 0), alive & (source < 0)
        rows = source * self.environments + environment
        frames, place = np.unique(rows[inside], return_inverse=True)
        carried, of = np.unique(np.broadcast_to(environment, rows.shape)[before], return_inverse=True)
        kept = self.frames - 1
        index = np.full(rows.shape, len(frames) + len(carried) * kept)
        index[inside] = place
        index[before] = len(frames) + of * kept + kept + source[before]
        return Cut(units, frames, carried, Windows(torch.from_numpy(index).to(self.device)))
