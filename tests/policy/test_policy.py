"""Encoders, features and the actor-critic."""

import numpy as np
import pytest
import torch

from prnav.errors import ConfigError
from prnav.policy import PolicyConfig, build_policy, entropies, log_probabilities, sample_actions
from prnav.policy.features import displacement_features, gps_features, pointgoal_features

SHAPES = {"photoreceptors": (2, 16, 3), "design": (2, 7), "gps": (2,), "compass": (1,), "pointgoal": (2,)}


def config(encoder: str, **changes) -> PolicyConfig:
    sizes = {"width": 16, "transformer_heads": 2, "feedforward": 24, "lstm_hidden": 12}
    return PolicyConfig(encoder=encoder, **{**sizes, **changes})


def observations(*batch: int) -> dict[str, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    return {key: torch.rand(*batch, *shape, generator=generator) for key, shape in SHAPES.items()}


@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
@pytest.mark.parametrize("previous_action", [True, False])
@pytest.mark.parametrize(("head_hidden", "skip"), [(0, False), (8, True)])
def test_a_rollout_at_once_equals_step_by_step(encoder, previous_action, head_hidden, skip):
    changes = {"previous_action": previous_action, "head_hidden": head_hidden, "skip": skip, "displacement": skip}
    policy = build_policy(config(encoder, **changes), SHAPES, 4)
    steps, environments = 7, 3
    obs = observations(steps, environments)
    rng = np.random.default_rng(0)
    starts = torch.from_numpy(rng.random((steps, environments)) < 0.3)
    previous = torch.from_numpy(rng.integers(0, 4, (steps, environments)))
    begin = policy.initial_state(environments)
    begin += torch.randn(begin.shape, generator=torch.Generator().manual_seed(2))

    logits, values = policy.sequence(obs, previous, starts, begin)
    state = begin
    for t in range(steps):
        step = policy.step({key: value[t] for key, value in obs.items()}, previous[t], starts[t], state)
        state = step.state
        torch.testing.assert_close(logits[t], step.logits, atol=1e-5, rtol=0)
        torch.testing.assert_close(values[t], step.values, atol=1e-5, rtol=0)
    assert logits.shape == (steps, environments, 4) and values.shape == (steps, environments)


def test_transformer_tokens_are_those_of_the_paper():
    policy = build_policy(config("transformer"), SHAPES, 4)
    assert len(policy.encoder.blocks) == 3
    assert policy.core.lstm.num_layers == 2
    tokens = policy.encoder.tokens(observations(5))
    assert tokens.shape == (5, 1 + 1 + 1 + 2 * 16, 16)  # readout, GPS and compass, goal, K grids of 4 x 4
    without_goal = {key: shape for key, shape in SHAPES.items() if key != "pointgoal"}
    target_policy = build_policy(config("transformer"), without_goal, 3)
    assert target_policy.encoder.tokens(observations(5)).shape == (5, 1 + 1 + 2 * 16, 16)


def test_transformer_treats_grids_with_their_designs_as_a_set():
    encoder = build_policy(config("transformer"), SHAPES, 4).encoder
    obs = observations(5)
    swapped = {**obs, "photoreceptors": obs["photoreceptors"].flip(1), "design": obs["design"].flip(1)}
    torch.testing.assert_close(encoder(obs), encoder(swapped), atol=1e-5, rtol=0)
    moved = {**obs, "design": obs["design"].flip(1)}
    assert (encoder(obs) - encoder(moved)).abs().max() > 1e-4


@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
def test_only_the_blind_agent_ignores_its_readings_and_design(encoder):
    network = build_policy(config(encoder), SHAPES, 4).encoder
    obs = observations(2)
    for key in ("photoreceptors", "design"):
        changed = network({**obs, key: torch.zeros_like(obs[key])})
        assert torch.equal(network(obs), changed) == (encoder == "blind")


def test_missing_readings_are_an_error_that_names_the_remedy():
    shapes = {"gps": (2,)}
    with pytest.raises(ConfigError, match="needs the observations 'photoreceptors' and 'design'.*use encoder 'blind'"):
        build_policy(config("compact"), shapes, 4)
    with pytest.raises(ConfigError, match="'blind' has nothing to see"):
        build_policy(config("blind"), {"photoreceptors": (2, 16, 3)}, 4)
    with pytest.raises(ConfigError, match=r"needs photoreceptors \(K, P, 3\) and design \(K, 7\)"):
        build_policy(config("compact"), {"photoreceptors": (2, 16, 3), "design": (3, 7)}, 4)


def test_config_says_what_is_wrong():
    with pytest.raises(ValueError, match="width 10 cannot be split over 4 transformer_heads; make it a multiple of 4"):
        PolicyConfig(width=10)
    with pytest.raises(ValueError, match="lstm_hidden is 0; it must be at least 1"):
        PolicyConfig(lstm_hidden=0)


def test_same_seed_same_weights_and_the_global_random_state_is_left_alone():
    torch.manual_seed(5)
    before = torch.random.get_rng_state()
    first, second, third = (build_policy(config("compact"), SHAPES, 4, seed=s) for s in (3, 3, 4))
    assert torch.equal(before, torch.random.get_rng_state())
    same = [torch.equal(a, b) for a, b in zip(first.parameters(), second.parameters(), strict=True)]
    assert all(same)
    assert not torch.equal(first.core.lstm.weight_hh_l0, third.core.lstm.weight_hh_l0)


def test_a_new_policy_is_nearly_uniform():
    policy = build_policy(config("compact"), SHAPES, 4)
    starts = torch.ones(6, dtype=torch.bool)
    step = policy.step(observations(6), torch.zeros(6, dtype=torch.long), starts, policy.initial_state(6))
    assert (entropies(step.logits) > np.log(4) - 1e-3).all()


def test_displacement_is_the_way_moved_in_the_frame_of_the_last_heading():
    """Heading half a turn left of the start (compass pi / 2): ahead is the start's left, so gps right falls."""
    last = torch.tensor([[1.0, 2.0, np.pi / 2]])
    moved = displacement_features(torch.tensor([[1.0, 1.75, np.pi / 2]]), last)
    torch.testing.assert_close(moved, torch.tensor([[1.0, 0.0]]), atol=1e-6, rtol=0)
    stuck = displacement_features(torch.tensor([[1.0, 2.0, 0.3]]), last)
    torch.testing.assert_close(stuck, torch.zeros(1, 2), atol=1e-6, rtol=0)


def test_features_are_bounded_and_do_not_jump_behind_the_agent():
    goal = torch.tensor([[5.0, np.pi - 1e-6], [5.0, -np.pi + 1e-6], [1e4, 0.0], [0.0, 0.0]], dtype=torch.float32)
    features = pointgoal_features(goal)
    torch.testing.assert_close(features[0], features[1], atol=1e-5, rtol=0)
    assert features.abs().max() < 10
    assert torch.isfinite(gps_features(torch.zeros(1, 2))).all()


def test_sampling_follows_the_probabilities_and_the_callers_numbers():
    logits = torch.log(torch.tensor([0.1, 0.2, 0.7])).expand(20000, 3)
    uniforms = torch.rand(20000, 3, generator=torch.Generator().manual_seed(0))
    actions = sample_actions(logits, uniforms)
    shares = torch.bincount(actions, minlength=3) / 20000
    torch.testing.assert_close(shares, torch.tensor([0.1, 0.2, 0.7]), atol=0.01, rtol=0)
    assert torch.equal(actions, sample_actions(logits, uniforms))
    assert (sample_actions(logits, None) == 2).all()


def test_log_probabilities_and_entropies():
    logits = torch.log(torch.tensor([[0.25, 0.75], [0.5, 0.5]])) + 3.0
    torch.testing.assert_close(
        log_probabilities(logits, torch.tensor([1, 0])), torch.log(torch.tensor([0.75, 0.5])), atol=1e-6, rtol=0
    )
    expected = torch.tensor([-(0.25 * np.log(0.25) + 0.75 * np.log(0.75)), np.log(2)], dtype=torch.float32)
    torch.testing.assert_close(entropies(logits), expected, atol=1e-6, rtol=0)
