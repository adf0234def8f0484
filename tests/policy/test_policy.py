"""Encoders, features and the actor-critic."""

import numpy as np
import pytest
import torch
from policy_specs import FOUR, SHAPES, observations, specs

from prnav.contracts import DiscreteActions, ObservationSpec
from prnav.errors import ConfigError
from prnav.policy import ENCODERS, PolicyConfig, build_policy
from prnav.policy.features import displacement_features, gps_features, pointgoal_features


def config(encoder: str, **changes) -> PolicyConfig:
    sizes = {"width": 16, "transformer_heads": 2, "feedforward": 24, "lstm_hidden": 12}
    return PolicyConfig(encoder=encoder, **{**sizes, **changes})


@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
@pytest.mark.parametrize("previous_action", [True, False])
@pytest.mark.parametrize(("head_hidden", "skip"), [(0, False), (8, True)])
def test_a_rollout_at_once_equals_step_by_step(encoder, previous_action, head_hidden, skip):
    changes = {"previous_action": previous_action, "head_hidden": head_hidden, "skip": skip, "displacement": skip}
    policy = build_policy(config(encoder, **changes), specs(), FOUR)
    steps, environments = 7, 3
    obs = observations(steps, environments)
    rng = np.random.default_rng(0)
    starts = torch.from_numpy(rng.random((steps, environments)) < 0.3)
    previous = torch.from_numpy(rng.integers(0, 4, (steps, environments)))
    begin = policy.initial_state(environments)
    begin["lstm"] += torch.randn(begin["lstm"].shape, generator=torch.Generator().manual_seed(2))

    distribution, values = policy.sequence(obs, previous, starts, begin)
    state = begin
    for t in range(steps):
        step = policy.step({key: value[t] for key, value in obs.items()}, previous[t], starts[t], state)
        state = step.state
        torch.testing.assert_close(distribution.parameters[t], step.distribution.parameters, atol=1e-5, rtol=0)
        torch.testing.assert_close(values[t], step.values, atol=1e-5, rtol=0)
    assert distribution.parameters.shape == (steps, environments, 4) and values.shape == (steps, environments)


def test_transformer_tokens_are_those_of_the_paper():
    policy = build_policy(config("transformer"), specs(), FOUR)
    assert len(policy.encoder.blocks) == 3
    assert policy.core.lstm.num_layers == 2
    tokens = policy.encoder.tokens(observations(5))
    assert tokens.shape == (5, 1 + 1 + 1 + 2 * 16, 16)  # readout, GPS and compass, goal, K grids of 4 x 4
    without_goal = {key: shape for key, shape in SHAPES.items() if key != "pointgoal"}
    target_policy = build_policy(config("transformer"), specs(without_goal), DiscreteActions(3))
    assert target_policy.encoder.tokens(observations(5)).shape == (5, 1 + 1 + 2 * 16, 16)


def test_transformer_treats_grids_with_their_designs_as_a_set():
    encoder = build_policy(config("transformer"), specs(), FOUR).encoder
    obs = observations(5)
    swapped = {**obs, "photoreceptors": obs["photoreceptors"].flip(1), "design": obs["design"].flip(1)}
    torch.testing.assert_close(encoder(obs), encoder(swapped), atol=1e-5, rtol=0)
    moved = {**obs, "design": obs["design"].flip(1)}
    assert (encoder(obs) - encoder(moved)).abs().max() > 1e-4


@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
def test_only_the_blind_agent_ignores_its_readings_and_design(encoder):
    network = build_policy(config(encoder), specs(), FOUR).encoder
    obs = observations(2)
    for key in ("photoreceptors", "design"):
        changed = network({**obs, key: torch.zeros_like(obs[key])})
        assert torch.equal(network(obs), changed) == (encoder == "blind")


def test_missing_readings_are_an_error_that_names_the_remedy():
    with pytest.raises(
        ConfigError,
        match="'compact' needs one observation of photoreceptor readings and one of their design; "
        r"the environment gives gps \(vector\); use encoder 'blind'",
    ):
        build_policy(config("compact"), specs({"gps": (2,)}), FOUR)
    with pytest.raises(ConfigError, match="the environment gives nothing"):
        build_policy(config("transformer"), {}, FOUR)
    with pytest.raises(ConfigError, match=r"needs photoreceptors \(K, P, 3\) and design \(K, 7\)"):
        build_policy(config("compact"), specs({"photoreceptors": (2, 16, 3), "design": (3, 7)}), FOUR)
    with pytest.raises(ConfigError, match="'state' needs a vector observation; the environment gives design, photo"):
        build_policy(config("state"), specs({"photoreceptors": (2, 16, 3), "design": (2, 7)}), FOUR)


@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
def test_an_agent_without_vectors(encoder):
    """Control gives no GPS, no compass and no goal."""
    shapes = {"photoreceptors": (2, 16, 3), "design": (2, 7)}
    policy = build_policy(config(encoder), specs(shapes), FOUR)
    obs = observations(5, 3, shapes=shapes)
    starts = torch.zeros(5, 3, dtype=torch.bool)
    previous = torch.zeros(5, 3, dtype=torch.int64)
    distribution, values = policy.sequence(obs, previous, starts, policy.initial_state(3))
    (values.sum() + distribution.log_prob(previous).sum()).backward()
    assert all(parameter.grad is not None for parameter in policy.parameters())
    if encoder == "transformer":
        assert policy.encoder.tokens({key: value[0] for key, value in obs.items()}).shape == (3, 1 + 2 * 16, 16)
        rows = {key: value[0] for key, value in obs.items()}
        fast = policy.encoder(rows)
        exact = policy.double().encoder({key: value.double() for key, value in rows.items()})
        torch.testing.assert_close(fast.double(), exact, atol=1e-5, rtol=0)


def test_a_blind_agent_that_is_shown_nothing_at_all():
    policy = build_policy(config("blind"), {}, FOUR)
    step = policy.step({}, policy.initial_actions(3), torch.ones(3, dtype=torch.bool), policy.initial_state(3))
    assert step.values.shape == (3,) and torch.equal(step.values, step.values[:1].expand(3))
    step.values.sum().backward()
    assert policy.encoder.constant.grad.abs().max() > 0


def test_observations_are_found_by_their_kind():
    renamed = {
        "eyes": ObservationSpec((2, 16, 3), "receptors"),
        "theta": ObservationSpec((2, 7), "design"),
        "gps": ObservationSpec((2,), "vector"),
    }
    plain = build_policy(
        config("transformer"), specs({key: SHAPES[key] for key in ("photoreceptors", "design", "gps")}), FOUR
    )
    policy = build_policy(config("transformer"), renamed, FOUR)
    obs = observations(4)
    other = {"eyes": obs["photoreceptors"], "theta": obs["design"], "gps": obs["gps"]}
    assert torch.equal(policy.encoder(other), plain.encoder(obs))
    twice = {**renamed, "more_eyes": ObservationSpec((2, 16, 3), "receptors")}
    with pytest.raises(
        ConfigError, match=r"needs one observation .* gives eyes \(receptors\), gps \(vector\), more_eyes"
    ):
        build_policy(config("transformer"), twice, FOUR)


class Brightness(torch.nn.Module):
    """An encoder of a test: the mean of all readings."""

    def __init__(self, config, specs):
        super().__init__()
        self.layer = torch.nn.Linear(1, config.width)

    def forward(self, observations):
        return self.layer(observations["photoreceptors"].mean(dim=(1, 2, 3))[:, None])


def test_an_encoder_is_added_by_one_line(monkeypatch):
    monkeypatch.setitem(ENCODERS, "brightness", f"{__name__}:Brightness")
    policy = build_policy(config("brightness"), specs(), FOUR)
    assert policy.encoder(observations(5)).shape == (5, 16)
    with pytest.raises(
        ValueError, match="encoder is 'darkness'; valid: 'transformer', 'compact', 'blind', 'state', .*'brightness'"
    ):
        PolicyConfig(encoder="darkness")


def test_config_says_what_is_wrong():
    with pytest.raises(ValueError, match="width 10 cannot be split over 4 transformer_heads; make it a multiple of 4"):
        PolicyConfig(width=10)
    with pytest.raises(ValueError, match="lstm_hidden is 0; it must be at least 1"):
        PolicyConfig(lstm_hidden=0)
    with pytest.raises(ValueError, match="displacement is an input of the LSTM, and memory is 'stack'; leave it out"):
        PolicyConfig(memory="stack", displacement=True)


def test_same_seed_same_weights_and_the_global_random_state_is_left_alone():
    torch.manual_seed(5)
    before = torch.random.get_rng_state()
    first, second, third = (build_policy(config("compact"), specs(), FOUR, seed=s) for s in (3, 3, 4))
    assert torch.equal(before, torch.random.get_rng_state())
    same = [torch.equal(a, b) for a, b in zip(first.parameters(), second.parameters(), strict=True)]
    assert all(same)
    assert not torch.equal(first.core.lstm.weight_hh_l0, third.core.lstm.weight_hh_l0)


def test_a_new_policy_is_nearly_uniform():
    policy = build_policy(config("compact"), specs(), FOUR)
    starts = torch.ones(6, dtype=torch.bool)
    step = policy.step(observations(6), torch.zeros(6, dtype=torch.long), starts, policy.initial_state(6))
    assert (step.distribution.entropy() > np.log(4) - 1e-3).all()


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
