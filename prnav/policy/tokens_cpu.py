"""Input tokens of the photoreceptors' transformer on a CPU, written once and read once.

Letters in shapes: B batch, V vector tokens, K sensors, P photoreceptors per sensor, D width, S = 1 + V + K * P.
"""

from __future__ import annotations

import numpy as np
import torch
from numba import njit
from torch import Tensor
from torch.autograd.function import once_differentiable

from prnav.aliases import Untyped
from prnav.policy.block_kernels import COMPILED, Floats


@njit(**COMPILED)
def _forward(
    readout: Floats, vectors: Floats, readings: Floats, weight: Floats, designs: Floats, places: Floats, out: Floats
) -> None:
    """All tokens, (B, S, D); ``weight`` is (3, D)."""
    batch, ahead, width = vectors.shape
    sensors, receptors = designs.shape[1], len(places)
    red, green, blue = weight[0], weight[1], weight[2]
    for b in range(batch):
        out[b, 0] = readout
        for v in range(ahead):
            out[b, 1 + v] = vectors[b, v]
        for k in range(sensors):
            design = designs[b, k]
            for p in range(receptors):
                place, result = places[p], out[b, 1 + ahead + k * receptors + p]
                r, g, u = readings[b, k, p, 0], readings[b, k, p, 1], readings[b, k, p, 2]
                for d in range(width):
                    result[d] = design[d] + place[d] + r * red[d] + g * green[d] + u * blue[d]


@njit(**COMPILED)
def _backward(
    grad: Floats,
    readings: Floats,
    d_readout: Floats,
    d_vectors: Floats,
    d_weight: Floats,
    d_designs: Floats,
    d_places: Floats,
) -> None:
    """Gradients of all but the readings, from that of the tokens; all but ``d_vectors`` are added to."""
    batch, ahead, width = d_vectors.shape
    sensors, receptors = d_designs.shape[1], len(d_places)
    red, green, blue = d_weight[0], d_weight[1], d_weight[2]
    for b in range(batch):
        first = grad[b, 0]
        for d in range(width):
            d_readout[d] += first[d]
        for v in range(ahead):
            d_vectors[b, v] = grad[b, 1 + v]
        for k in range(sensors):
            design = d_designs[b, k]
            for p in range(receptors):
                place, above = d_places[p], grad[b, 1 + ahead + k * receptors + p]
                r, g, u = readings[b, k, p, 0], readings[b, k, p, 1], readings[b, k, p, 2]
                for d in range(width):
                    design[d] += above[d]
                    place[d] += above[d]
                    red[d] += r * above[d]
                    green[d] += g * above[d]
                    blue[d] += u * above[d]


class Tokens(torch.autograd.Function):
    """(readout (D), vectors (B, V, D), readings (B, K, P, 3), weight (3, D), designs (B, K, D), places (P, D))."""

    @staticmethod
    def forward(ctx: Untyped, *inputs: Tensor) -> Tensor:
        """Tokens (B, S, D)."""
        readout, vectors, readings, weight, designs, places = (x.detach().contiguous() for x in inputs)
        batch, ahead, width = vectors.shape
        count = 1 + ahead + designs.shape[1] * len(places)
        out = torch.from_numpy(np.empty((batch, count, width), dtype=np.float32))
        _forward(*(x.numpy() for x in (readout, vectors, readings, weight, designs, places, out)))
        ctx.save_for_backward(readings)
        ctx.shapes = [x.shape for x in inputs]
        return out

    @staticmethod
    @once_differentiable
    def backward(ctx: Untyped, grad: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients of all but the readings."""
        (readings,) = ctx.saved_tensors
        readout, vectors, _, weight, designs, places = (grad.new_zeros(shape) for shape in ctx.shapes)
        arrays = (grad.contiguous(), readings, readout, vectors, weight, designs, places)
        _backward(*(x.detach().numpy() for x in arrays))
        return readout, vectors, None, weight, designs, places
