"""An LSTM that forgets at the start of each episode.

Letters in shapes: T steps, N environments, S segments (parts of a rollout that belong to one episode), F features,
H hidden units, L layers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor, nn
from torch.nn.utils.rnn import PackedSequence

from prnav.aliases import Array
from prnav.policy.config import PolicyConfig
from prnav.policy.features import displacement_features
from prnav.policy.lstm_cpu import packed_layer, packed_steps
from prnav.policy.memory.memory import Cut, Cutter, Inputs, Memory, MemoryState, Rows


@dataclass(frozen=True)
class Segments:
    """A rollout (T, N) cut at episode starts and packed by length, so that each segment runs from its own state."""

    order: Tensor
    """Flat index t * N + n of each packed row, (T * N,)."""
    inverse: Tensor
    """Packed row of each flat index, (T * N,)."""
    batch_sizes: Tensor
    """How many segments are at least k + 1 steps long, (longest,), on the CPU as PackedSequence wants it."""
    environments: Tensor
    """Environment of each segment, longest segment first, (S,)."""
    carried: Tensor
    """1 where a segment goes on from the rollout's incoming state, 0 where an episode starts, (S, 1) float."""


def segment(starts: ArrayLike, device: torch.device | str = "cpu") -> Segments:
    """Segments of a rollout whose ``starts`` (T, N) bool mark the first step of each episode."""
    starts = np.asarray(starts, dtype=bool)
    steps, environments = starts.shape
    begins = starts.copy()
    begins[0] = True
    environment, first = np.nonzero(begins.T)  # by environment, then by step
    ends = np.append(first[1:], 0)
    ends[np.append(environment[1:] != environment[:-1], True)] = steps
    lengths = ends - first
    by_length = np.argsort(-lengths, kind="stable")
    environment, first, lengths = environment[by_length], first[by_length], lengths[by_length]
    batch_sizes = (lengths[:, None] > np.arange(lengths[0])).sum(axis=0)
    offset = np.repeat(np.arange(lengths[0]), batch_sizes)
    row = np.arange(steps * environments) - np.repeat(np.cumsum(batch_sizes) - batch_sizes, batch_sizes)
    order = (first[row] + offset) * environments + environment[row]
    inverse = np.empty_like(order)
    inverse[order] = np.arange(order.size)
    carried = (first == 0) & ~starts[0, environment]
    return Segments(
        order=torch.from_numpy(order).to(device),
        inverse=torch.from_numpy(inverse).to(device),
        batch_sizes=torch.from_numpy(batch_sizes),
        environments=torch.from_numpy(environment).to(device),
        carried=torch.from_numpy(carried.astype(np.float32)[:, None]).to(device),
    )


class LSTMMemory(Memory):
    """LSTM with two ways to run that agree: step by step while acting, by whole segments while learning.

    With ``displacement`` the way moved since the last step, by GPS and compass, is one more input. With ``skip`` the
    outputs are the LSTM's followed by its inputs.

    MemoryState: "lstm" (2, L, N, H), hidden and cell values, and with ``displacement`` "fixes" (N, 3), the last GPS and
    compass.
    """

    def __init__(self, features: int, config: PolicyConfig, fixes: bool) -> None:
        super().__init__()
        hidden, self.skip, self.displacement = config.lstm_hidden, config.skip, config.displacement and fixes
        inputs = features + (2 if self.displacement else 0)
        self.outputs = hidden + (inputs if self.skip else 0)
        self.lstm = nn.LSTM(inputs, hidden, config.lstm_layers)
        for name, parameter in self.lstm.named_parameters():
            if name.startswith("weight"):
                for gate in parameter.data.chunk(4):
                    nn.init.orthogonal_(gate)
            else:
                nn.init.zeros_(parameter)
                if name.startswith("bias_ih"):
                    parameter.data[hidden : 2 * hidden] = 1.0  # start by remembering

    def initial_state(self, environments: int) -> MemoryState:
        """Zeros."""
        weight = next(self.lstm.parameters())
        state = {"lstm": weight.new_zeros(2, self.lstm.num_layers, environments, self.lstm.hidden_size)}
        return {**state, "fixes": weight.new_zeros(environments, 3)} if self.displacement else state

    def select(self, state: MemoryState, rows: Rows) -> MemoryState:
        """MemoryState of some environments; a view of it for a slice."""
        part = {"lstm": state["lstm"][:, :, rows]}
        return {**part, "fixes": state["fixes"][rows]} if self.displacement else part

    def restored(self, stored: Mapping[str, Array] | Array) -> MemoryState:
        """The state that a checkpoint holds; those of the first version have one array, the fixes in its last layer."""
        if isinstance(stored, Mapping):
            return super().restored(stored)
        layers = self.lstm.num_layers
        parts = {"lstm": np.ascontiguousarray(stored[:, :layers])}
        if self.displacement:
            parts["fixes"] = np.ascontiguousarray(stored[0, layers, :, :3])
        return super().restored(parts)

    def step(self, inputs: Inputs, state: MemoryState, starts: Tensor) -> tuple[Tensor, MemoryState]:
        """One step of N environments."""
        rows = self._rows(inputs, state.get("fixes"), starts)
        before = state["lstm"] * (~starts)[:, None].to(rows.dtype)
        outputs, after = self.lstm(rows[None], (before[0], before[1]))
        kept = {"lstm": torch.stack(after)}
        if inputs.fixes is not None and self.displacement:
            kept["fixes"] = inputs.fixes
        return self._with_skip(outputs[0], rows), kept

    def sequence(self, inputs: Inputs, state: MemoryState, starts: Tensor, plan: object) -> Tensor:
        """All steps of whole environments, segment by segment; ``plan`` is their :class:`Segments`."""
        assert isinstance(plan, Segments)
        before = state["lstm"]
        rows = self._rows(inputs, state.get("fixes"), starts)
        begin = before[:, :, plan.environments] * plan.carried
        if rows.device.type == "cpu" and rows.dtype == torch.float32:
            outputs = self._sequence_on_cpu(rows[plan.order], begin, plan)[plan.inverse]
        else:
            packed = PackedSequence(rows[plan.order], plan.batch_sizes)
            outputs = self.lstm(packed, (begin[0], begin[1]))[0].data[plan.inverse]
        return self._with_skip(outputs, rows)

    def cutter(self, starts: NDArray[np.bool_], device: torch.device) -> Cutter:
        """Mini-batches are made of whole environments."""
        return EnvironmentCutter(starts, device)

    def _rows(self, inputs: Inputs, last: Tensor | None, starts: Tensor) -> Tensor:
        """Inputs of the LSTM (T * N, F), given the fixes (N, 3) before the first step."""
        if not self.displacement:
            return inputs.features
        assert inputs.fixes is not None and last is not None
        before = torch.cat([last, inputs.fixes[: -len(last)]])
        moved = displacement_features(inputs.fixes, before) * (~starts)[:, None].to(inputs.fixes.dtype)
        return torch.cat([inputs.features, moved], dim=-1)

    def _with_skip(self, outputs: Tensor, rows: Tensor) -> Tensor:
        return torch.cat([outputs, rows], dim=-1) if self.skip else outputs

    def _sequence_on_cpu(self, rows: Tensor, begin: Tensor, segments: Segments) -> Tensor:
        """Packed outputs (T * N, H) from packed rows (T * N, F): the same numbers several times faster."""
        walk = packed_steps(segments.batch_sizes.numpy())
        for layer, weights in enumerate(self.lstm.all_weights):
            w_ih, w_hh, b_ih, b_hh = weights
            rows = packed_layer(rows, begin[0, layer], begin[1, layer], (w_ih, w_hh, b_ih, b_hh), walk)
        return rows


class EnvironmentCutter:
    """Cuts a rollout into whole environments."""

    def __init__(self, starts: NDArray[np.bool_], device: torch.device) -> None:
        self.starts, self.device = starts, device
        self.units = starts.shape[1]

    def cut(self, units: NDArray[np.int64]) -> Cut:
        """All steps of the environments ``units``, step by step."""
        steps, environments = self.starts.shape
        rows = (np.arange(steps)[:, None] * environments + units).ravel()
        return Cut(rows, rows, units, segment(self.starts[:, units], self.device))
