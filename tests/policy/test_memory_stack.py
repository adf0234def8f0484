"""The stack of the last frames: step by step, at once, and in random mini-batches, against a loop."""

import numpy as np
import pytest
import torch
from policy_specs import FOUR, observations, specs

from prnav.policy import PolicyConfig, build_policy
from prnav.policy.memory import Inputs, NoMemory, StackMemory

STEPS, ENVIRONMENTS, FEATURES = 9, 4, 3
CPU = torch.device("cpu")


def stack(frames: int) -> StackMemory:
    return StackMemory(FEATURES, PolicyConfig(memory="stack", frames=frames), fixes=False)


def rollout(seed: int = 0, share: float = 0.3):
    rng = np.random.default_rng(seed)
    features = torch.from_numpy(rng.normal(size=(STEPS, ENVIRONMENTS, FEATURES)).astype(np.float32))
    return features, rng.random((STEPS, ENVIRONMENTS)) < share


def by_loop(features, starts, before, frames):
    """Outputs (T, N, n * F) by the definition: the last n frames, zeros before the episode's start."""
    history = torch.cat([before.transpose(0, 1), features])  # (n - 1 + T, N, F)
    result = torch.zeros(STEPS, ENVIRONMENTS, frames, FEATURES)
    for t in range(STEPS):
        for n in range(ENVIRONMENTS):
            for lag in range(frames):
                if lag and starts[t - lag + 1 : t + 1, n].any() if t - lag + 1 >= 0 else starts[: t + 1, n].any():
                    break
                result[t, n, frames - 1 - lag] = history[frames - 1 + t - lag, n]
    return result.flatten(2)


@pytest.mark.parametrize("frames", [1, 2, 3, 5, 12])
@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_steps_and_cuts_equal_the_definition(frames, share):
    memory = stack(frames)
    features, starts = rollout(share=share)
    state = {"frames": torch.randn(ENVIRONMENTS, frames - 1, FEATURES, generator=torch.Generator().manual_seed(1))}
    expected = by_loop(features, starts, state["frames"], frames)
    flags = torch.from_numpy(starts)

    now, outputs = state, []
    for t in range(STEPS):
        output, now = memory.step(Inputs(features[t], None), now, flags[t])
        outputs.append(output)
    torch.testing.assert_close(torch.stack(outputs), expected, atol=0, rtol=0)

    cutter = memory.cutter(starts, CPU)
    assert cutter.units == STEPS * ENVIRONMENTS
    flat, all_flags = features.flatten(0, 1), flags.flatten()
    for units in np.array_split(np.random.default_rng(3).permutation(cutter.units), 5):
        cut = cutter.cut(units)
        assert len(np.unique(cut.frames)) == len(cut.frames) <= frames * len(units)
        part = memory.select(state, torch.from_numpy(cut.environments))
        rows = torch.from_numpy(cut.frames)
        found = memory.sequence(Inputs(flat[rows], None), part, all_flags[rows], cut.plan)
        assert torch.equal(found, expected.flatten(0, 1)[cut.targets])
        assert (cut.targets == units).all()


def test_gradients_reach_the_frames_of_the_episode_alone():
    memory = stack(3)
    features, _ = rollout()
    starts = np.zeros((STEPS, ENVIRONMENTS), bool)
    starts[4, 1] = True
    features.requires_grad_(True)
    cut = memory.cutter(starts, CPU).cut(np.array([5 * ENVIRONMENTS + 1, 8 * ENVIRONMENTS + 2]))
    rows = torch.from_numpy(cut.frames)
    inputs = Inputs(features.flatten(0, 1)[rows], None)
    memory.sequence(
        inputs, memory.initial_state(0), torch.zeros(len(rows), dtype=torch.bool), cut.plan
    ).sum().backward()
    reached = features.grad.abs().sum(dim=2) > 0
    expected = torch.zeros(STEPS, ENVIRONMENTS, dtype=torch.bool)
    expected[[4, 5], 1] = expected[[6, 7, 8], 2] = True
    assert torch.equal(reached, expected)


def test_no_memory_is_the_step_alone():
    memory = NoMemory(FEATURES, PolicyConfig(memory="none"), fixes=False)
    features, starts = rollout()
    output, state = memory.step(
        Inputs(features[0], None), memory.initial_state(ENVIRONMENTS), torch.from_numpy(starts[0])
    )
    assert output is features[0] or torch.equal(output, features[0])
    assert state == {} and memory.outputs == FEATURES
    cut = memory.cutter(starts, CPU).cut(np.array([5, 2]))
    assert cut.targets.tolist() == cut.frames.tolist() == [5, 2] and not len(cut.environments)


@pytest.mark.parametrize("memory", ["stack", "none"])
@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
def test_a_rollout_at_once_equals_step_by_step(memory, encoder):
    sizes = {"width": 16, "transformer_heads": 2, "feedforward": 24, "head_hidden": 8}
    policy = build_policy(PolicyConfig(encoder=encoder, memory=memory, **sizes), specs(), FOUR)
    obs = observations(STEPS, ENVIRONMENTS)
    rng = np.random.default_rng(0)
    starts = torch.from_numpy(rng.random((STEPS, ENVIRONMENTS)) < 0.3)
    previous = torch.from_numpy(rng.integers(0, 4, (STEPS, ENVIRONMENTS)))
    begin = {name: torch.randn(value.shape) for name, value in policy.initial_state(ENVIRONMENTS).items()}
    distribution, values = policy.sequence(obs, previous, starts, begin)
    state = begin
    for t in range(STEPS):
        step = policy.step({key: value[t] for key, value in obs.items()}, previous[t], starts[t], state)
        state = step.state
        torch.testing.assert_close(distribution.parameters[t], step.distribution.parameters, atol=1e-5, rtol=0)
        torch.testing.assert_close(values[t], step.values, atol=1e-5, rtol=0)
    assert not [name for name, _ in policy.named_parameters() if name.startswith("core.")]
