"""One LSTM layer over packed segments on a CPU, forward and backward.

torch's own packed LSTM fills a zero tensor as large as the whole input for each step of its backward pass, which makes
that pass quadratic in the number of steps. Here each step is one small matrix product and one compiled loop over the
gates, and the products of weights and inputs are done once for all steps.

Letters in shapes: R packed rows (all steps of all segments), S segments, F features, H hidden units. Packed rows are
those of ``PackedSequence``: all segments' first steps, then all second steps, and so on, longest segment first. Gates
stand in torch's order: input, forget, cell, output.
"""

from __future__ import annotations

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor
from torch.autograd.function import once_differentiable

from prnav.aliases import Untyped

Floats = NDArray[np.float32]


@njit(inline="always")
def _tanh(x: np.float32) -> np.float32:
    """Hyperbolic tangent by its continued fraction between the bounds where it is 1 in float32; error below 3e-7."""
    x = min(max(x, np.float32(-9.0)), np.float32(9.0))
    s = x * x
    top = np.float32(-2.76076847742355e-16)
    top = top * s + np.float32(2.00018790482477e-13)
    top = top * s + np.float32(-8.60467152213735e-11)
    top = top * s + np.float32(5.12229709037114e-08)
    top = top * s + np.float32(1.48572235717979e-05)
    top = top * s + np.float32(6.37261928875436e-04)
    top = top * s + np.float32(4.89352455891786e-03)
    low = np.float32(1.19825839466702e-06)
    low = low * s + np.float32(1.18534705686654e-04)
    low = low * s + np.float32(2.26843463243900e-03)
    low = low * s + np.float32(4.89352518554385e-03)
    return x * top / low


@njit(cache=True, nogil=True, error_model="numpy")
def _forward(gates: Floats, cells: Floats, squashed: Floats, hidden: Floats, row: int, last: int, count: int) -> None:
    """One step of ``count`` segments: activate their gates in place, write their cell, its tanh, their output.

    ``row`` is the step's first packed row; ``cells`` and ``hidden`` hold S rows of initial state before the packed
    ones, and ``last`` is the row in them of the step before.
    """
    segments, size = cells.shape[0] - gates.shape[0], cells.shape[1]
    half = np.float32(0.5)
    for r in range(count):
        gate, before, after = gates[row + r], cells[last + r], cells[segments + row + r]
        tanh, out = squashed[row + r], hidden[segments + row + r]
        for j in range(size):
            i = half + half * _tanh(half * gate[j])
            f = half + half * _tanh(half * gate[size + j])
            g = _tanh(gate[2 * size + j])
            o = half + half * _tanh(half * gate[3 * size + j])
            gate[j], gate[size + j], gate[2 * size + j], gate[3 * size + j] = i, f, g, o
            c = f * before[j] + i * g
            t = _tanh(c)
            after[j] = c
            tanh[j] = t
            out[j] = o * t


@njit(cache=True, nogil=True, error_model="numpy")
def _backward(
    outer: Floats,
    gates: Floats,
    cells: Floats,
    squashed: Floats,
    d_hidden: Floats,
    d_cell: Floats,
    d_gates: Floats,
    row: int,
    last: int,
    count: int,
) -> None:
    """The same step backwards: gradient of the gates' inputs, and of the cells before it (in place in ``d_cell``)."""
    size = cells.shape[1]
    one = np.float32(1.0)
    for r in range(count):
        gate, before, tanh = gates[row + r], cells[last + r], squashed[row + r]
        above, carried, cell, result = outer[row + r], d_hidden[r], d_cell[r], d_gates[row + r]
        for j in range(size):
            i, f, g, o = gate[j], gate[size + j], gate[2 * size + j], gate[3 * size + j]
            t = tanh[j]
            dh = above[j] + carried[j]
            dc = cell[j] + dh * o * (one - t * t)
            result[j] = dc * g * i * (one - i)
            result[size + j] = dc * before[j] * f * (one - f)
            result[2 * size + j] = dc * i * (one - g * g)
            result[3 * size + j] = dh * t * o * (one - o)
            cell[j] = dc * f


class PackedLayer(torch.autograd.Function):
    """An LSTM layer: (inputs, h0, c0, w_ih, w_hh, bias, steps, previous) -> outputs, as :func:`packed_layer` says."""

    @staticmethod
    def forward(
        ctx: Untyped,
        inputs: Tensor,
        hidden: Tensor,
        cell: Tensor,
        w_ih: Tensor,
        w_hh: Tensor,
        bias: Tensor,
        steps: list[tuple[int, int, int]],
        previous: Tensor,
    ) -> Tensor:
        """Outputs (R, H)."""
        rows, segments, size = len(inputs), len(hidden), hidden.shape[1]
        gates = torch.addmm(bias, inputs, w_ih.t())
        cells, outputs = inputs.new_empty(segments + rows, size), inputs.new_empty(segments + rows, size)
        cells[:segments], outputs[:segments] = cell, hidden
        squashed = inputs.new_empty(rows, size)
        views = gates.numpy(), cells.numpy(), squashed.numpy(), outputs.numpy()
        turned = w_hh.t()
        for row, last, count in steps:
            gates[row : row + count].addmm_(outputs[last : last + count], turned)
            _forward(*views, row, last, count)
        ctx.save_for_backward(inputs, w_ih, w_hh, gates, cells, squashed, outputs, previous)
        ctx.steps = steps
        return outputs[segments:].clone()

    @staticmethod
    @once_differentiable
    def backward(ctx: Untyped, outer: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients of inputs, initial state, weights and bias."""
        inputs, w_ih, w_hh, gates, cells, squashed, outputs, previous = ctx.saved_tensors
        outer = outer.contiguous()
        segments = len(outputs) - len(inputs)
        d_hidden, d_cell = torch.zeros_like(outputs[:segments]), torch.zeros_like(outputs[:segments])
        d_gates = torch.empty_like(gates)
        views = [x.numpy() for x in (outer, gates, cells, squashed, d_hidden, d_cell, d_gates)]
        for row, last, count in reversed(ctx.steps):
            _backward(*views, row, last, count)  # type: ignore[call-arg, arg-type]
            torch.mm(d_gates[row : row + count], w_hh, out=d_hidden[:count])
        turned = d_gates.t()
        return (
            d_gates @ w_ih if ctx.needs_input_grad[0] else None,
            d_hidden,
            d_cell,
            turned @ inputs,
            turned @ outputs[previous],
            d_gates.sum(dim=0),
            None,
            None,
        )


def packed_steps(batch_sizes: NDArray[np.int64]) -> tuple[list[tuple[int, int, int]], Tensor]:
    """How a packed sequence is walked, for :func:`packed_layer`.

    Returns:
        For each step its first packed row, the row of the step before it in an array that has the S initial states in
        front, and how many segments it has; and that earlier row for each packed row, (R,).
    """
    ends = np.cumsum(batch_sizes)
    first = ends - batch_sizes
    last = np.concatenate([[0], batch_sizes[0] + first[:-1]])
    rows = np.arange(ends[-1])
    step = np.repeat(np.arange(len(batch_sizes)), batch_sizes)
    previous = torch.from_numpy(last[step] + rows - first[step])
    return list(zip(first.tolist(), last.tolist(), batch_sizes.tolist(), strict=True)), previous


def packed_layer(
    inputs: Tensor,
    hidden: Tensor,
    cell: Tensor,
    weights: tuple[Tensor, Tensor, Tensor, Tensor],
    walk: tuple[list[tuple[int, int, int]], Tensor],
) -> Tensor:
    """Outputs (R, H) of one LSTM layer.

    Args:
        inputs: Packed rows, (R, F) float32 on the CPU.
        hidden: Hidden values before each segment, (S, H).
        cell: Cell values before each segment, (S, H).
        weights: ``weight_ih``, ``weight_hh``, ``bias_ih``, ``bias_hh`` of a ``torch.nn.LSTM`` layer.
        walk: From :func:`packed_steps`.
    """
    w_ih, w_hh, b_ih, b_hh = weights
    outputs: Tensor = PackedLayer.apply(inputs, hidden, cell, w_ih, w_hh, b_ih + b_hh, *walk)  # type: ignore[no-untyped-call]
    return outputs
