"""The recurrent core: an LSTM that forgets at the start of each episode.

Letters in shapes: T steps, N environments, S segments (parts of a rollout that belong to one episode), F features,
H hidden units, L layers. A recurrent state is one tensor (2, L, N, H): hidden and cell values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor, nn
from torch.nn.utils.rnn import PackedSequence

from prnav.policy.lstm_cpu import packed_layer, packed_steps


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


class RecurrentCore(nn.Module):
    """LSTM with two ways to run that agree: step by step while acting, by whole segments while learning."""

    def __init__(self, inputs: int, hidden: int, layers: int) -> None:
        super().__init__()
        self.lstm = nn.LSTM(inputs, hidden, layers)
        for name, parameter in self.lstm.named_parameters():
            if name.startswith("weight"):
                for gate in parameter.data.chunk(4):
                    nn.init.orthogonal_(gate)
            else:
                nn.init.zeros_(parameter)
                if name.startswith("bias_ih"):
                    parameter.data[hidden : 2 * hidden] = 1.0  # start by remembering

    def initial_state(self, environments: int) -> Tensor:
        """Zeros (2, L, N, H) on the core's device."""
        weight = next(self.lstm.parameters())
        return weight.new_zeros(2, self.lstm.num_layers, environments, self.lstm.hidden_size)

    def step(self, features: Tensor, state: Tensor, starts: Tensor) -> tuple[Tensor, Tensor]:
        """One step: features (N, F), state before it, starts (N,) bool -> outputs (N, H), state after it."""
        state = state * (~starts)[:, None].to(state.dtype)
        outputs, (hidden, cell) = self.lstm(features[None], (state[0], state[1]))
        return outputs[0], torch.stack([hidden, cell])

    def sequence(self, features: Tensor, state: Tensor, segments: Segments) -> Tensor:
        """A whole rollout: features (T * N, F), state before it -> outputs (T * N, H)."""
        begin = state[:, :, segments.environments] * segments.carried
        if features.device.type == "cpu" and features.dtype == torch.float32:
            return self._sequence_on_cpu(features[segments.order], begin, segments)[segments.inverse]
        packed = PackedSequence(features[segments.order], segments.batch_sizes)
        outputs, _ = self.lstm(packed, (begin[0], begin[1]))
        return outputs.data[segments.inverse]

    def _sequence_on_cpu(self, rows: Tensor, begin: Tensor, segments: Segments) -> Tensor:
        """Packed outputs (T * N, H) from packed rows (T * N, F): the same numbers several times faster."""
        walk = packed_steps(segments.batch_sizes.numpy())
        for layer, weights in enumerate(self.lstm.all_weights):
            w_ih, w_hh, b_ih, b_hh = weights
            rows = packed_layer(rows, begin[0, layer], begin[1, layer], (w_ih, w_hh, b_ih, b_hh), walk)
        return rows
