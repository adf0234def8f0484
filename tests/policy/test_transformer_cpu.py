"""The transformer's fast path on a CPU against the plain modules, which run in float64."""

import copy
import gc
import threading

import pytest
import torch
from policy_specs import FOUR, SHAPES, specs

from prnav.policy import PolicyConfig, build_policy
from prnav.policy.block_cpu import BlockMemory, block
from prnav.policy.encoders import TransformerBlock


def scattered(module: torch.nn.Module) -> torch.nn.Module:
    """``module`` with norms and biases that are not at their first values."""
    for parameter in module.parameters():
        parameter.data.add_(0.1 * torch.randn_like(parameter))
    return module


def assert_same(fast, exact, tolerance=1e-5):
    for one, other in zip(fast, exact, strict=True):
        scale = max(float(other.detach().abs().max()), 1e-3)
        torch.testing.assert_close(one.double(), other, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize(
    ("batch", "count", "width", "heads", "feedforward"),
    [
        (40, 34, 64, 4, 256),
        (3, 2, 16, 2, 8),
        (5, 7, 24, 4, 40),
        (2, 600, 32, 1, 64),
        (1, 9, 20, 2, 12),
        (2, 5, 9, 3, 4),
        (3, 1, 8, 2, 8),
    ],
)
@pytest.mark.parametrize("way", ["forward", "first"])
def test_a_block_has_the_outputs_and_gradients_of_plain_modules(batch, count, width, heads, feedforward, way):
    torch.manual_seed(0)
    fast = scattered(TransformerBlock(width, heads, feedforward))
    exact = copy.deepcopy(fast).double()
    tokens = torch.randn(batch, count, width, requires_grad=True)
    exact_tokens = tokens.detach().double().requires_grad_()
    result, expected = getattr(fast, way)(tokens), getattr(exact, way)(exact_tokens)
    assert_same([result], [expected])
    with torch.no_grad():
        torch.testing.assert_close(getattr(fast, way)(tokens), result, rtol=0, atol=2e-6)
    grad = torch.randn_like(result)
    found = torch.autograd.grad(result, [tokens, *fast.parameters()], grad)
    assert_same(found, torch.autograd.grad(expected, [exact_tokens, *exact.parameters()], grad.double()))


def test_scores_far_apart_stay_finite():
    torch.manual_seed(0)
    fast = TransformerBlock(16, 2, 8)
    fast.attention_in.weight.data *= 100.0
    exact = copy.deepcopy(fast).double()
    tokens = torch.randn(4, 11, 16)
    assert_same([fast(tokens), fast.first(tokens)], [exact(tokens.double()), exact.first(tokens.double())], 1e-4)


def test_the_encoder_has_the_outputs_and_gradients_of_plain_modules():
    policy = build_policy(PolicyConfig(encoder="transformer", width=32, lstm_hidden=16), specs(), FOUR)
    fast = scattered(policy.encoder)
    exact = copy.deepcopy(fast).double()
    observations = {key: torch.rand(30, *shape) for key, shape in SHAPES.items()}
    result, expected = fast(observations), exact({key: value.double() for key, value in observations.items()})
    assert_same([result], [expected])
    grad = torch.randn_like(result)
    found = torch.autograd.grad(result, list(fast.parameters()), grad)
    assert_same(found, torch.autograd.grad(expected, list(exact.parameters()), grad.double()), 2e-5)


def test_results_are_the_same_bits_whatever_memory_holds_and_however_threads_fall():
    torch.manual_seed(0)
    layer = scattered(TransformerBlock(32, 4, 64))
    tokens, grad = torch.randn(50, 34, 32), torch.randn(50, 34, 32)

    def gradients():
        leaf = tokens.clone().requires_grad_()
        return torch.autograd.grad(layer(layer(leaf)), [leaf, *layer.parameters()], grad)

    expected = gradients()
    for flat in BlockMemory.free:
        flat.fill(float("nan"))
    results = [None] * 4

    def work(place):
        results[place] = gradients()

    threads = [threading.Thread(target=work, args=(place,)) for place in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in results:
        assert all(torch.equal(one, other) for one, other in zip(result, expected, strict=True))


def test_memory_is_used_again_once_it_is_free_and_not_before(monkeypatch):
    monkeypatch.setattr(BlockMemory, "free", [])
    shapes = [(1000, 370), (5, 3)]
    memory = BlockMemory(shapes)
    assert [tuple(matrix.shape) for matrix in memory.matrices] == shapes
    assert all(matrix.data_ptr() % 64 == 0 for matrix in memory.matrices)
    place = memory.flat.ctypes.data
    other = BlockMemory(shapes)
    assert other.flat.ctypes.data != place
    del memory
    gc.collect()
    assert [flat.ctypes.data for flat in BlockMemory.free] == [place]
    again = BlockMemory(shapes)
    assert again.flat.ctypes.data == place
    assert not BlockMemory.free


def test_a_graph_that_is_kept_gives_its_gradients_twice():
    torch.manual_seed(0)
    layer = TransformerBlock(16, 2, 8)
    tokens = torch.randn(4, 6, 16, requires_grad=True)
    result = block(tokens, 2, list(layer.parameters())).square().sum()
    (first,) = torch.autograd.grad(result, [tokens], retain_graph=True)
    block(torch.randn(4, 6, 16, requires_grad=True), 2, list(layer.parameters())).sum().backward()
    (second,) = torch.autograd.grad(result, [tokens])
    assert torch.equal(first, second)
