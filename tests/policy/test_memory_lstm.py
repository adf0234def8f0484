"""The packed LSTM against the step-by-step one, and the cutting of rollouts into segments."""

import numpy as np
import pytest
import torch

from prnav.policy import PolicyConfig
from prnav.policy.memory import Inputs, LSTMMemory, segment


def lstm(features: int, hidden: int, **changes) -> LSTMMemory:
    return LSTMMemory(features, PolicyConfig(lstm_hidden=hidden, lstm_layers=2, **changes), fixes=True)


def whole(core: LSTMMemory, features: torch.Tensor, begin: torch.Tensor, starts: np.ndarray) -> torch.Tensor:
    inputs = Inputs(features.flatten(0, 1), None)
    flags = torch.from_numpy(starts).flatten()
    return core.sequence(inputs, {"lstm": begin}, flags, segment(starts)).view(*starts.shape, -1)


def starts_of(kind: str, steps: int = 13, environments: int = 5) -> np.ndarray:
    rng = np.random.default_rng(0)
    return {
        "none": np.zeros((steps, environments), bool),
        "all": np.ones((steps, environments), bool),
        "first": np.arange(steps)[:, None] == np.zeros(environments),
        "some": rng.random((steps, environments)) < 0.2,
        "last": np.arange(steps)[:, None] == np.full(environments, steps - 1),
    }[kind]


@pytest.mark.parametrize("kind", ["none", "all", "first", "some", "last"])
def test_packed_equals_step_by_step(kind):
    starts = starts_of(kind)
    steps, environments = starts.shape
    torch.manual_seed(0)
    core = lstm(4, 6)
    features = torch.randn(steps, environments, 4)
    begin = torch.randn(2, 2, environments, 6)

    state, expected = {"lstm": begin}, []
    for t in range(steps):
        output, state = core.step(Inputs(features[t], None), state, torch.from_numpy(starts[t]))
        expected.append(output)
    packed = whole(core, features, begin, starts)
    torch.testing.assert_close(packed, torch.stack(expected), atol=1e-5, rtol=0)


def test_gradients_stop_at_episode_starts():
    starts = np.zeros((4, 2), bool)
    starts[2, 0] = True
    core = lstm(3, 5)
    features = torch.randn(8, 3, requires_grad=True)
    begin = torch.randn(2, 2, 2, 5, requires_grad=True)
    last = whole(core, features.view(4, 2, 3), begin, starts)[3]
    last[0].sum().backward()
    gradient = features.grad.view(4, 2, 3)
    assert (gradient[:2, 0] == 0).all() and (gradient[2:, 0] != 0).all()
    assert (gradient[:, 1] == 0).all()  # environments do not mix
    assert (begin.grad == 0).all()


def test_segments_cover_every_step_once_and_the_longest_come_first():
    starts = starts_of("some", 17, 9)
    segments = segment(starts)
    assert sorted(segments.order.tolist()) == list(range(17 * 9))
    assert (segments.order[segments.inverse] == torch.arange(17 * 9)).all()
    sizes = segments.batch_sizes
    assert (sizes[1:] <= sizes[:-1]).all() and sizes.sum() == 17 * 9
    assert sizes[0] == len(segments.environments) == 9 + starts[1:].sum()
    assert segments.carried.sum() == (~starts[0]).sum()


def test_a_cut_is_whole_environments_step_by_step():
    starts = starts_of("some", 6, 5)
    cutter = lstm(3, 4).cutter(starts, torch.device("cpu"))
    assert cutter.units == 5
    cut = cutter.cut(np.array([3, 1]))
    assert cut.targets.tolist() == cut.frames.tolist() == [t * 5 + n for t in range(6) for n in (3, 1)]
    assert cut.environments.tolist() == [3, 1]
    assert torch.equal(cut.plan.order, segment(starts[:, [3, 1]]).order)


def test_the_state_of_a_first_checkpoint_is_understood():
    """One array then: the fixes stood in the first units of one more layer."""
    core = lstm(3, 5, displacement=True)
    stored = np.random.default_rng(0).normal(size=(2, 3, 4, 5)).astype(np.float32)
    state = core.restored(stored)
    assert set(state) == set(core.initial_state(4))
    np.testing.assert_array_equal(state["lstm"], stored[:, :2])
    np.testing.assert_array_equal(state["fixes"], stored[0, 2, :, :3])
    again = core.restored({name: value.numpy() for name, value in state.items()})
    assert all(torch.equal(again[name], state[name]) for name in state)
