"""Attention of a transformer's readout token alone, on a CPU, forward and backward.

With one query per head, keys and values need not be made: the query is carried through the keys' weights to the
normalised tokens ("probe"), and the tokens' weighted mean through the values'. Here the tokens are read once forward
and once backward, and nothing of their size is kept.

Letters in shapes: B batch, S tokens, D width, H heads, E = D / H.
"""

from __future__ import annotations

import numpy as np
import torch
from numba import njit
from torch import Tensor
from torch.autograd.function import once_differentiable

from prnav.aliases import Untyped
from prnav.policy.block_cpu import folded
from prnav.policy.block_kernels import COMPILED, EPSILON, Floats, exponential, normalize


@njit(**COMPILED)
def _forward(tokens: Floats, probe: Floats, normed: Floats, scales: Floats, weights: Floats, out: Floats) -> None:
    """Mean of each entry's normalised tokens (S, D) by softmax of their products with ``probe`` (B, H * D)."""
    batch, width = len(probe), tokens.shape[1]
    count, heads = len(normed), probe.shape[1] // width
    zero = np.float32(0.0)
    for b in range(batch):
        normalize(tokens, b * count, b * count + count, normed, 0, scales)
        for h in range(heads):
            ask, weight, result = probe[b, h * width :], weights[b, h * count :], out[b, h * width :]
            top = zero * ask[0] - np.float32(3e38)
            for j in range(count):
                row = normed[j]
                score = zero * row[0]
                for d in range(width):
                    score += row[d] * ask[d]
                weight[j] = score
                top = max(top, score)
            total = zero * ask[0]
            for j in range(count):
                weight[j] = exponential(weight[j] - top)
                total += weight[j]
            for d in range(width):
                result[d] = zero
            for j in range(count):
                weight[j] /= total
                w, row = weight[j], normed[j]
                for d in range(width):
                    result[d] += w * row[d]


@njit(**COMPILED)
def _backward(
    tokens: Floats,
    probe: Floats,
    normed: Floats,
    scales: Floats,
    weights: Floats,
    grad: Floats,
    d_probe: Floats,
    d_tokens: Floats,
) -> None:
    """Gradient of ``probe``, and of ``tokens`` but for what comes through the probe."""
    batch, width = len(probe), tokens.shape[1]
    count, heads = len(normed), probe.shape[1] // width
    zero, size = np.float32(0.0), np.float32(tokens.shape[1])
    pulls = np.empty((heads, count), normed.dtype)
    for b in range(batch):
        normalize(tokens, b * count, b * count + count, normed, 0, scales)
        for h in range(heads):
            above, weight, pull = grad[b, h * width :], weights[b, h * count :], pulls[h]
            result = d_probe[b, h * width :]
            mean = zero * above[0]
            for j in range(count):
                row = normed[j]
                product = zero * row[0]
                for d in range(width):
                    product += row[d] * above[d]
                pull[j] = product
                mean += product * weight[j]
            for d in range(width):
                result[d] = zero
            for j in range(count):
                pull[j] = weight[j] * (pull[j] - mean)
                p, row = pull[j], normed[j]
                for d in range(width):
                    result[d] += p * row[d]
        for j in range(count):
            row, result = normed[j], d_tokens[b * count + j]
            for d in range(width):
                result[d] = zero
            for h in range(heads):
                above, ask = grad[b, h * width :], probe[b, h * width :]
                w, p = weights[b, h * count + j], pulls[h, j]
                for d in range(width):
                    result[d] += w * above[d] + p * ask[d]
            total = zero * row[0]
            along = total
            for d in range(width):
                total += result[d]
                along += result[d] * row[d]
            total, along, scale = total / size, along / size, scales[j]
            for d in range(width):
                result[d] = scale * (result[d] - total - row[d] * along)


class TokenReadout(torch.autograd.Function):
    """(tokens, w_query (D, D), b_query, w_key (H, E, D)) -> means of the normalised tokens, and the first tokens."""

    @staticmethod
    def forward(ctx: Untyped, tokens: Tensor, w_query: Tensor, b_query: Tensor, w_key: Tensor) -> tuple[Tensor, Tensor]:
        """Means (B, H, D) and first tokens (B, D)."""
        batch, count, width = tokens.shape
        heads, size, _ = w_key.shape
        rows, first = tokens.reshape(-1, width), tokens[:, 0].contiguous()
        leader = torch.nn.functional.layer_norm(first, (width,), eps=EPSILON)
        query = torch.addmm(b_query, leader, w_query.t()).view(batch, heads, size)
        probe = torch.bmm(query.transpose(0, 1), w_key).transpose(0, 1).reshape(batch, heads * width)
        probe *= size**-0.5
        weights, means = rows.new_empty(batch, heads * count), torch.empty_like(probe)
        normed, scales = rows.new_empty(count, width), rows.new_empty(count)
        _forward(*(x.detach().numpy() for x in (rows, probe, normed, scales, weights, means)))
        ctx.save_for_backward(rows, first, leader, query, probe, weights, w_query, w_key)
        return means.view(batch, heads, width), first

    @staticmethod
    @once_differentiable
    def backward(ctx: Untyped, d_means: Tensor, d_first: Tensor) -> tuple[Tensor, ...]:
        """Gradients of all inputs."""
        rows, first, leader, query, probe, weights, w_query, w_key = ctx.saved_tensors
        batch, heads, size = query.shape
        width = rows.shape[1]
        count = len(rows) // batch
        normed, scales = rows.new_empty(count, width), rows.new_empty(count)
        grad, d_probe, d_rows = d_means.reshape(batch, heads * width), torch.empty_like(probe), torch.empty_like(rows)
        _backward(*(x.detach().numpy() for x in (rows, probe, normed, scales, weights, grad, d_probe, d_rows)))
        d_probe *= size**-0.5
        of_heads = d_probe.view(batch, heads, width).transpose(0, 1)
        d_query = torch.bmm(of_heads, w_key.transpose(1, 2)).transpose(0, 1).reshape(batch, width)
        d_key = torch.bmm(query.permute(1, 2, 0), of_heads)
        d_leader = d_query @ w_query
        deviation = (first.var(dim=1, keepdim=True, correction=0) + EPSILON).sqrt()
        along = (d_leader * leader).mean(dim=1, keepdim=True)
        d_tokens = d_rows.view(batch, count, width)
        d_tokens[:, 0] += d_first + (d_leader - d_leader.mean(dim=1, keepdim=True) - leader * along) / deviation
        return d_tokens, d_query.t() @ leader, d_query.sum(dim=0), d_key


def attended_readout(
    tokens: Tensor, heads: int, gain: Tensor, shift: Tensor, weight: Tensor, bias: Tensor
) -> tuple[Tensor, Tensor]:
    """What the first token attends to, (B, D), before the attention's output map; and the first token, (B, D).

    Args:
        tokens: (B, S, D) float32 on the CPU.
        heads: H.
        gain: Of the norm before the attention, (D,).
        shift: Of the same norm.
        weight: Of queries, keys and values, (3 * D, D).
        bias: Of the same. That of the keys adds the same to all scores, and is not needed.
    """
    batch, _, width = tokens.shape
    taken_in, offset = folded(weight, bias, gain, shift)
    of_query, of_key, of_value = taken_in.view(3, width, width).unbind(0)
    to_query, _, to_value = offset.view(3, width).unbind(0)
    split = (heads, width // heads, width)
    means, first = TokenReadout.apply(tokens, of_query, to_query, of_key.view(split))  # type: ignore[no-untyped-call]
    attended = torch.bmm(means.transpose(0, 1), of_value.view(split).transpose(1, 2)).transpose(0, 1)
    return attended.reshape(batch, width) + to_value, first
