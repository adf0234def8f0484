"""The compiled LSTM layer against torch's."""

import numpy as np
import pytest
import torch
from torch.nn.utils.rnn import PackedSequence

from prnav.policy.lstm_cpu import packed_layer, packed_steps

FEATURES, HIDDEN = 5, 7


def both(batch_sizes: list[int], scale: float = 1.0):
    """Outputs and gradients of torch's packed LSTM and of ours."""
    torch.manual_seed(0)
    lstm = torch.nn.LSTM(FEATURES, HIDDEN)
    for parameter in lstm.parameters():
        parameter.data *= scale
    sizes = torch.tensor(batch_sizes)
    inputs = torch.randn(int(sizes.sum()), FEATURES)
    hidden, cell = torch.randn(batch_sizes[0], HIDDEN), torch.randn(batch_sizes[0], HIDDEN)
    outer = torch.randn(len(inputs), HIDDEN)
    results = []
    for ours in (False, True):
        leaves = [x.clone().requires_grad_() for x in (inputs, hidden, cell)]
        if ours:
            walk = packed_steps(np.array(batch_sizes))
            out = packed_layer(*leaves, tuple(lstm.all_weights[0]), walk)
        else:
            out = lstm(PackedSequence(leaves[0], sizes), (leaves[1][None], leaves[2][None]))[0].data
        gradients = torch.autograd.grad((out * outer).sum(), [*leaves, *lstm.parameters()])
        results.append([out.detach(), *gradients])
    return results


@pytest.mark.parametrize("batch_sizes", [[1], [4], [3, 3, 3], [5, 4, 2, 1, 1], [2, 1]])
@pytest.mark.parametrize("scale", [1.0, 20.0])
def test_outputs_and_gradients_are_torchs(batch_sizes, scale):
    theirs, ours = both(batch_sizes, scale)
    for a, b in zip(theirs, ours, strict=True):
        torch.testing.assert_close(a, b, atol=2e-5, rtol=1e-4)


def test_the_rational_tanh_is_exact_to_float32():
    """One hidden unit with a wide-open output gate is tanh of the cell."""
    x = torch.linspace(-30, 30, 20001)[:, None]
    inputs = torch.zeros(len(x), 1)
    weights = (torch.zeros(4, 1), torch.zeros(4, 1), torch.tensor([-50.0, 50.0, 0.0, 50.0]), torch.zeros(4))
    outputs = packed_layer(inputs, torch.zeros_like(x), x, weights, packed_steps(np.array([len(x)])))
    torch.testing.assert_close(outputs.double(), torch.tanh(x.double()), atol=4e-7, rtol=0)


def test_not_a_number_is_not_hidden():
    inputs = torch.full((3, 1), float("nan"), requires_grad=True)
    weights = tuple(torch.ones(shape, requires_grad=True) for shape in ((4, 1), (4, 1), (4,), (4,)))
    out = packed_layer(inputs, torch.zeros(3, 1), torch.zeros(3, 1), weights, packed_steps(np.array([3])))
    assert torch.isnan(torch.autograd.grad(out.sum(), weights[0])[0]).any()
