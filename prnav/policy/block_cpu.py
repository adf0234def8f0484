"""A transformer block on a CPU, forward and backward in chunks that stay in a core's cache.

torch's own way goes over tens of megabytes for every small operation. Here a few rows of the batch go through the
whole block before the next: matrix products by torch, the rest by compiled loops (:mod:`prnav.policy.block_kernels`).
What the backward pass needs is kept, and attention and GELU are done again there. Gradients of weights add up chunk by
chunk in a fixed order, so that results do not depend on the machine's load.

Both norms' gains and biases are folded into the linear maps that follow them.

Letters in shapes: B batch, S tokens, R = B * S rows, D width, F hidden units of the MLP.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from prnav.policy.block_kernels import attention_kernels, gelu, gelu_backward, normalize, normalize_backward, padded

CHUNK = 288
"""Rows that go through a block together, if the tokens of one batch entry are not more: what fits a core's cache."""


def _chunks(batch: int, count: int) -> list[tuple[int, int]]:
    """First row and the one after the last of each chunk of whole batch entries."""
    step = max(1, CHUNK // count) * count
    return [(begin, min(begin + step, batch * count)) for begin in range(0, batch * count, step)]


def _folded(weight: Tensor, bias: Tensor, gain: Tensor, shift: Tensor) -> tuple[Tensor, Tensor]:
    """Weight and bias of a linear map that takes in the gain and shift of the norm before it."""
    return weight * gain, torch.addmv(bias, weight, shift)


def _unfolded(d_weight: Tensor, d_bias: Tensor, weight: Tensor, gain: Tensor, shift: Tensor) -> tuple[Tensor, ...]:
    """Gradients of gain, shift and weight from those of the folded weight and bias."""
    return (
        (d_weight * weight).sum(dim=0),
        weight.t() @ d_bias,
        torch.addr(d_weight * gain, d_bias, shift),
    )


class Block(torch.autograd.Function):
    """(tokens, heads, keep, the block's 12 parameters in the order of its modules) -> tokens (B, S, D)."""

    @staticmethod
    def forward(ctx: Any, tokens: Tensor, heads: int, keep: bool, *parameters: Tensor) -> Tensor:
        """Tokens (B, S, D) after the block."""
        gain, shift, w_qkv, b_qkv, w_out, b_out, gain_2, shift_2, w_in, b_in, w_mlp, b_mlp = parameters
        batch, count, width = tokens.shape
        rows, hidden = batch * count, len(w_in)
        chunks = _chunks(batch, count)
        kept = rows if keep else chunks[0][1]
        source = tokens.reshape(rows, width)
        result = torch.empty_like(source)
        first, second = source.new_empty(kept, width), source.new_empty(kept, width)
        scales, scales_2 = source.new_empty(kept), source.new_empty(kept)
        qkv, attended, inner = (source.new_empty(kept, size) for size in (3 * width, width, hidden))
        active = source.new_empty(chunks[0][1], hidden)
        w_qkv, b_qkv = _folded(w_qkv, b_qkv, gain, shift)
        w_in, b_in = _folded(w_in, b_in, gain_2, shift_2)
        attend, _ = attention_kernels(heads, width // heads, count)
        work = _work(source, width // heads, count)[:4]
        for begin, end in chunks:
            at = begin if keep else 0
            here, out = slice(at, at + end - begin), result[begin:end]
            normalize(source.numpy(), begin, end, first.numpy(), at, scales.numpy())
            torch.addmm(b_qkv, first[here], w_qkv.t(), out=qkv[here])
            attend(qkv.numpy(), at, at + end - begin, attended.numpy(), *work)
            torch.addmm(b_out, attended[here], w_out.t(), out=out)
            out += source[begin:end]
            normalize(result.numpy(), begin, end, second.numpy(), at, scales_2.numpy())
            torch.addmm(b_in, second[here], w_in.t(), out=inner[here])
            gelu(inner.numpy(), at, at + end - begin, active.numpy())
            out += b_mlp
            out.addmm_(active[: end - begin], w_mlp.t())
        if keep:
            ctx.save_for_backward(first, second, scales, scales_2, qkv, attended, inner, w_qkv, w_in, *parameters)
            ctx.heads, ctx.shape = heads, tokens.shape
        return result.view(tokens.shape)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, outer: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients of tokens and parameters."""
        first, second, scales, scales_2, qkv, attended, inner, w_qkv, w_in, *parameters = ctx.saved_tensors
        gain, shift, plain_qkv, _, w_out, _, gain_2, shift_2, plain_in, _, w_mlp, _ = parameters
        batch, count, width = ctx.shape
        chunks = _chunks(batch, count)
        grad = outer.reshape(batch * count, width)
        result = torch.empty_like(grad)
        most, hidden = chunks[0][1], len(w_in)
        active, d_inner = grad.new_empty(most, hidden), grad.new_empty(most, hidden)
        d_rows, d_qkv = grad.new_empty(most, width), grad.new_empty(most, 3 * width)
        d_w_qkv, d_w_out, d_w_in, d_w_mlp = (torch.zeros_like(w) for w in (w_qkv, w_out, w_in, w_mlp))
        d_b_qkv, d_b_out, d_b_in, d_b_mlp = (grad.new_zeros(len(w)) for w in (w_qkv, w_out, w_in, w_mlp))
        _, attend_backward = attention_kernels(ctx.heads, width // ctx.heads, count)
        work = _work(grad, width // ctx.heads, count)
        for begin, end in chunks:
            here, some = slice(begin, end), slice(0, end - begin)
            outside, around = grad[here], result[here]
            torch.mm(outside, w_mlp, out=d_inner[some])
            gelu_backward(inner.numpy(), begin, end, active.numpy(), d_inner.numpy())
            d_w_mlp.addmm_(outside.t(), active[some])
            d_b_mlp += outside.sum(dim=0)
            d_w_in.addmm_(d_inner[some].t(), second[here])
            d_b_in += d_inner[some].sum(dim=0)
            torch.mm(d_inner[some], w_in, out=d_rows[some])
            normalize_backward(d_rows.numpy(), second.numpy(), scales_2.numpy(), begin, end, grad.numpy(), result.numpy())
            d_w_out.addmm_(around.t(), attended[here])
            d_b_out += around.sum(dim=0)
            torch.mm(around, w_out, out=d_rows[some])
            attend_backward(qkv.numpy(), begin, end, d_rows.numpy(), d_qkv.numpy(), *work)
            d_w_qkv.addmm_(d_qkv[some].t(), first[here])
            d_b_qkv += d_qkv[some].sum(dim=0)
            torch.mm(d_qkv[some], w_qkv, out=d_rows[some])
            normalize_backward(d_rows.numpy(), first.numpy(), scales.numpy(), begin, end, result.numpy(), result.numpy())
        d_gain, d_shift, d_w_qkv = _unfolded(d_w_qkv, d_b_qkv, plain_qkv, gain, shift)
        d_gain_2, d_shift_2, d_w_in = _unfolded(d_w_in, d_b_in, plain_in, gain_2, shift_2)
        of_attention = (d_gain, d_shift, d_w_qkv, d_b_qkv, d_w_out, d_b_out)
        of_mlp = (d_gain_2, d_shift_2, d_w_in, d_b_in, d_w_mlp, d_b_mlp)
        return (result.view(ctx.shape), None, None, *of_attention, *of_mlp)


def _work(like: Tensor, head: int, count: int) -> list[Any]:
    """Work space of :func:`attention_kernels`: the first four arrays of forward, all of backward."""
    across = padded(count)
    sizes = (head * across, count * across, across, across, count * across, count * head, count * head)
    return [like.new_empty(size).numpy() for size in sizes]


def block(tokens: Tensor, heads: int, parameters: list[Tensor]) -> Tensor:
    """Tokens (B, S, D) after one block of :class:`prnav.policy.encoders.TransformerBlock`.

    Args:
        tokens: float32 on the CPU; float64 gives float32's accuracy.
        heads: Of the attention.
        parameters: Weight and bias of each of the block's modules in their order.
    """
    return Block.apply(tokens, heads, torch.is_grad_enabled(), *parameters)
