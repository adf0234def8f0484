"""A transformer block on a CPU, forward and backward in chunks that stay in a core's cache.

torch's own way goes over tens of megabytes for every small operation. Here a few rows of the batch go through the
whole block before the next: matrix products by torch, the rest by compiled loops (:mod:`prnav.policy.block_kernels`,
:mod:`prnav.policy.attention_kernels`).
What the backward pass needs is kept, and attention and GELU are done again there. Gradients of weights add up chunk by
chunk in a fixed order, so that results do not depend on the machine's load.

Both norms' gains and biases are folded into the linear maps that follow them.

Letters in shapes: B batch, S tokens, R = B * S rows, D width, F hidden units of the MLP.
"""

from __future__ import annotations

import threading
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.autograd.function import once_differentiable

from prnav.aliases import Untyped
from prnav.policy.attention_kernels import attention_kernels, query_tile
from prnav.policy.block_kernels import (
    add_row,
    add_rows,
    gelu,
    gelu_backward,
    normalize,
    normalize_backward,
)

CHUNK = 544
"""Rows that go through a block together, if the tokens of one batch entry are not more: what fits a core's cache."""


def _chunks(batch: int, count: int) -> list[tuple[int, int]]:
    """First row and the one after the last of each chunk of whole batch entries."""
    step = min(batch, max(1, CHUNK // count)) * count
    return [(begin, min(begin + step, batch * count)) for begin in range(0, batch * count, step)]


def folded(weight: Tensor, bias: Tensor, gain: Tensor, shift: Tensor) -> tuple[Tensor, Tensor]:
    """Weight and bias of a linear map that takes in the gain and shift of the norm before it."""
    return weight * gain, torch.addmv(bias, weight, shift)


def _unfolded(d_weight: Tensor, d_bias: Tensor, weight: Tensor, gain: Tensor, shift: Tensor) -> tuple[Tensor, ...]:
    """Gradients of gain, shift and weight from those of the folded weight and bias."""
    return (
        (d_weight * weight).sum(dim=0),
        weight.t() @ d_bias,
        torch.addr(d_weight * gain, d_bias, shift),
    )


class BlockMemory:
    """One piece of memory that matrices are cut from; used again once the last reference to it is gone.

    Fresh memory costs a page fault for every 4 KiB, which were a tenth of the time. The large pieces that wait are at
    most as many as ``MOST``, the latest.
    """

    LARGE: ClassVar[int] = 1 << 18
    """Numbers from which on a piece waits to be used again."""
    MOST: ClassVar[int] = 16
    free: ClassVar[list[NDArray[np.float32]]] = []

    def __init__(self, shapes: list[tuple[int, int]]) -> None:
        size = sum(-(-rows * columns // 16) * 16 for rows, columns in shapes) + 15
        self.flat = self._take(size)
        begin = -self.flat.ctypes.data % 64 // 4  # of a cache line
        self.matrices: list[Tensor] = []
        for rows, columns in shapes:
            piece = self.flat[begin : begin + rows * columns].reshape(rows, columns)
            self.matrices.append(torch.from_numpy(piece))
            begin += -(-rows * columns // 16) * 16

    @classmethod
    def _take(cls, size: int) -> NDArray[np.float32]:
        with _lock:
            for place, flat in enumerate(cls.free):
                if size <= flat.size <= 2 * size:
                    return cls.free.pop(place)
        return np.empty(size, dtype=np.float32)

    def __del__(self) -> None:
        if self.flat.size >= self.LARGE:
            with _lock:
                self.free.append(self.flat)
                del self.free[: -self.MOST]


_lock = threading.RLock()  # the collector of garbage may come in between


class Block(torch.autograd.Function):
    """(tokens, heads, keep, the block's 12 parameters in the order of its modules) -> tokens (B, S, D)."""

    @staticmethod
    def forward(ctx: Untyped, tokens: Tensor, heads: int, keep: bool, *parameters: Tensor) -> Tensor:
        """Tokens (B, S, D) after the block."""
        gain, shift, w_qkv, b_qkv, w_out, b_out, gain_2, shift_2, w_in, b_in, w_mlp, b_mlp = parameters
        batch, count, width = tokens.shape
        rows, hidden = batch * count, len(w_in)
        chunks = _chunks(batch, count)
        most = chunks[0][1]
        source = tokens.reshape(rows, width)
        result = torch.empty_like(source)
        kept = rows if keep else most
        memory = BlockMemory([(kept, size) for size in (width, width, 3 * width, width, hidden)] + [(2, kept)])
        first, second, qkv, attended, inner, scales = memory.matrices
        passing = BlockMemory([(most, hidden)])
        (active,) = passing.matrices
        w_qkv, b_qkv = folded(w_qkv, b_qkv, gain, shift)
        w_in, b_in = folded(w_in, b_in, gain_2, shift_2)
        attend, _ = attention_kernels(heads, width // heads, count)
        work = work_space(width // heads, count)[:4]
        turned_qkv, turned_out, turned_in, turned_mlp = w_qkv.t(), w_out.t(), w_in.t(), w_mlp.t()
        before, after, one, two, three, four, five, gelus = map(
            _numpy, (source, result, first, second, qkv, attended, inner, active)
        )
        deviations, bias = _numpy(scales), _numpy(b_mlp)
        for begin, end in chunks:
            at, to = (begin, end) if keep else (0, end - begin)
            out = result[begin:end]
            normalize(before, begin, end, one, at, deviations[0])
            torch.addmm(b_qkv, first[at:to], turned_qkv, out=qkv[at:to])
            attend(three, at, to, four, *work)
            torch.addmm(b_out, attended[at:to], turned_out, out=out)
            add_rows(before, begin, end, after)
            normalize(after, begin, end, two, at, deviations[1])
            torch.addmm(b_in, second[at:to], turned_in, out=inner[at:to])
            gelu(five, at, to, gelus)
            add_row(bias, begin, end, after)
            out.addmm_(active[: end - begin], turned_mlp)
        if keep:
            ctx.save_for_backward(w_qkv, w_in, *parameters)
            ctx.memory, ctx.heads, ctx.shape = memory, heads, tokens.shape
        return result.view(tokens.shape)

    @staticmethod
    @once_differentiable
    def backward(ctx: Untyped, outer: Tensor) -> tuple[Tensor | None, ...]:
        """Gradients of tokens and parameters."""
        first, second, qkv, attended, inner, scales = ctx.memory.matrices
        w_qkv, w_in, *parameters = ctx.saved_tensors
        gain, shift, plain_qkv, _, w_out, _, gain_2, shift_2, plain_in, _, w_mlp, _ = parameters
        batch, count, width = ctx.shape
        chunks = _chunks(batch, count)
        most, hidden = chunks[0][1], len(w_in)
        grad = outer.reshape(batch * count, width)
        result = torch.empty_like(grad)
        passing = BlockMemory([(most, size) for size in (hidden, hidden, width, 3 * width)])
        active, d_inner, d_rows, d_qkv = passing.matrices
        d_w_qkv, d_w_out, d_w_in, d_w_mlp = (torch.zeros_like(w) for w in (w_qkv, w_out, w_in, w_mlp))
        sizes = [len(w) for w in (w_qkv, w_out, w_in, w_mlp)]
        biases, sums = grad.new_zeros(sum(sizes)), grad.new_zeros(sum(sizes))
        _, attend_backward = attention_kernels(ctx.heads, width // ctx.heads, count)
        work = work_space(width // ctx.heads, count)
        one, two, three, five = map(_numpy, (first, second, qkv, inner))
        above, below, gelus, d_five, d_one, d_three = map(_numpy, (grad, result, active, d_inner, d_rows, d_qkv))
        deviations = _numpy(scales)
        sums_qkv, sums_out, sums_in, sums_mlp = map(_numpy, sums.split(sizes))
        for begin, end in chunks:
            size = end - begin
            outside, around, of_inner, of_rows, of_qkv = (
                grad[begin:end],
                result[begin:end],
                d_inner[:size],
                d_rows[:size],
                d_qkv[:size],
            )
            torch.mm(outside, w_mlp, out=of_inner)
            gelu_backward(five, begin, end, gelus, d_five, sums_in)
            d_w_mlp.addmm_(outside.t(), active[:size])
            d_w_in.addmm_(of_inner.t(), second[begin:end])
            torch.mm(of_inner, w_in, out=of_rows)
            normalize_backward(d_one, two, deviations[1], begin, end, above, below, sums_mlp)
            d_w_out.addmm_(around.t(), attended[begin:end])
            torch.mm(around, w_out, out=of_rows)
            attend_backward(three, begin, end, d_one, d_three, sums_qkv, *work)
            d_w_qkv.addmm_(of_qkv.t(), first[begin:end])
            torch.mm(of_qkv, w_qkv, out=of_rows)
            normalize_backward(d_one, one, deviations[0], begin, end, below, below, sums_out)
            biases += sums  # chunk by chunk, since a sum over all rows one by one would lose digits
            sums.zero_()
        d_b_qkv, d_b_out, d_b_in, d_b_mlp = biases.split(sizes)
        d_gain, d_shift, d_w_qkv = _unfolded(d_w_qkv, d_b_qkv, plain_qkv, gain, shift)
        d_gain_2, d_shift_2, d_w_in = _unfolded(d_w_in, d_b_in, plain_in, gain_2, shift_2)
        of_attention = (d_gain, d_shift, d_w_qkv, d_b_qkv, d_w_out, d_b_out)
        of_mlp = (d_gain_2, d_shift_2, d_w_in, d_b_in, d_w_mlp, d_b_mlp)
        return (result.view(ctx.shape), None, None, *of_attention, *of_mlp)


def _numpy(tensor: Tensor) -> Untyped:
    return tensor.detach().numpy()


def work_space(head: int, count: int) -> list[Untyped]:
    """Work space of :func:`attention_kernels`: the first four arrays of forward, all of backward."""
    across = query_tile(count)
    sizes = (head * across, count * across, across, across, count * across, across * head, across * head)
    return [np.empty(size, dtype=np.float32) for size in sizes]


def block(tokens: Tensor, heads: int, parameters: list[Tensor]) -> Tensor:
    """Tokens (B, S, D) after one block of :class:`prnav.policy.encoders.TransformerBlock`.

    Args:
        tokens: float32 on the CPU.
        heads: Of the attention; D / heads must be even, and S at least 2.
        parameters: Weight and bias of each of the block's modules in their order.
    """
    after: Tensor = Block.apply(tokens, heads, torch.is_grad_enabled(), *parameters)  # type: ignore[no-untyped-call]
    return after
