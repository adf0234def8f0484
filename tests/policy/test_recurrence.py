"""The packed LSTM against the step-by-step one, and the cutting of rollouts into segments."""

import numpy as np
import pytest
import torch

from prnav.policy import RecurrentCore, segment


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
    core = RecurrentCore(inputs=4, hidden=6, layers=2)
    features = torch.randn(steps, environments, 4)
    begin = torch.randn(2, 2, environments, 6)

    state, expected = begin, []
    for t in range(steps):
        output, state = core.step(features[t], state, torch.from_numpy(starts[t]))
        expected.append(output)
    packed = core.sequence(features.flatten(0, 1), begin, segment(starts)).view(steps, environments, 6)
    torch.testing.assert_close(packed, torch.stack(expected), atol=1e-5, rtol=0)


def test_gradients_stop_at_episode_starts():
    starts = np.zeros((4, 2), bool)
    starts[2, 0] = True
    core = RecurrentCore(inputs=3, hidden=5, layers=2)
    features = torch.randn(8, 3, requires_grad=True)
    begin = torch.randn(2, 2, 2, 5, requires_grad=True)
    last = core.sequence(features, begin, segment(starts)).view(4, 2, 5)[3]
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
