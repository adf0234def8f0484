"""The maths of the design policy: its gradient, where it converges, and that noise leaves it alone."""

import numpy as np
import pytest

from prnav.design.cost import CostConfig, design_cost, solid_angle, tree_length
from prnav.design.gaussian import DesignPolicy, DesignPolicyConfig, advantages, log_probability, policy_gradient
from prnav.sensors import load_design


@pytest.mark.parametrize("clip", [None, 0.2])
def test_gradient_is_that_of_the_surrogate(clip):
    rng = np.random.default_rng(0)
    values, advantage = rng.normal(0.1, 0.3, (50, 3)), rng.normal(size=50)
    old = log_probability(values, np.array([0.02, 0.0, 0.1]), np.log([0.25, 0.3, 0.3]))
    mean, log_std = np.array([0.0, 0.05, 0.1]), np.log([0.3, 0.25, 0.35])

    def surrogate(parameters):
        ratio = np.exp(log_probability(values, parameters[:3], parameters[3:]) - old)
        if clip is None:
            return (ratio * advantage).mean()
        return np.minimum(ratio * advantage, np.clip(ratio, 1 - clip, 1 + clip) * advantage).mean()

    point = np.concatenate([mean, log_std])
    steps = 1e-6 * np.eye(6)
    numeric = [(surrogate(point + step) - surrogate(point - step)) / 2e-6 for step in steps]
    np.testing.assert_allclose(
        np.concatenate(policy_gradient(values, advantage, old, mean, log_std, clip)), numeric, rtol=1e-4
    )


def run(config, objective, updates=150, batch=256, size=6, seed=0):
    rng = np.random.default_rng(seed)
    policy = DesignPolicy(config, size)
    for _ in range(updates):
        values, log_probs = policy.sample(rng.normal(size=(batch, size)))
        difficulty = rng.normal(size=(batch, 1))
        policy.update(values, objective(values, difficulty[:, 0], rng), log_probs, difficulty)
    return policy


@pytest.mark.parametrize("estimator", ["ppo", "reinforce"])
@pytest.mark.parametrize("learn_std", [True, False])
def test_it_converges_to_a_known_optimum(estimator, learn_std):
    optimum = np.array([0.3, -0.2, 0.0, 0.15, -0.4, 0.1])

    def objective(values, difficulty, rng):
        return 0.5 - ((values - optimum) ** 2).sum(1) + 0.3 * difficulty + rng.normal(0, 0.1, len(values))

    policy = run(DesignPolicyConfig(estimator=estimator, learn_std=learn_std), objective)
    assert np.abs(policy.mean - optimum).max() < 0.06
    if learn_std:
        assert policy.std.mean() < 0.15  # it knows now


def test_a_flat_objective_leaves_the_mean_within_noise():
    config = DesignPolicyConfig(learning_rate=0.002, learn_std=False)
    ends = np.array([run(config, lambda v, d, r: r.normal(0, 0.2, len(v)), 60, 64, seed=s).mean for s in range(12)])
    moved = np.sqrt((ends**2).mean())  # a walk without direction: far below 240 steps of 0.002 in line
    assert moved < 0.1 * 240 * 0.002 * 3
    assert np.abs(ends.mean(0)).max() < 4 * moved / np.sqrt(12)
    still = run(config, lambda v, d, r: np.full(len(v), 0.7), 20, 64)
    np.testing.assert_array_equal(still.mean, np.zeros(6))


def test_covariates_take_what_they_explain_and_no_more():
    rng = np.random.default_rng(0)
    covariates = rng.normal(size=(400, 2))
    signal = rng.normal(size=400)
    found = advantages(signal + covariates @ [3.0, -2.0], covariates)
    assert np.corrcoef(found, signal)[0, 1] > 0.99
    assert np.corrcoef(advantages(signal + covariates @ [3.0, -2.0]), signal)[0, 1] < 0.5
    np.testing.assert_array_equal(advantages(np.ones(5)), np.zeros(5))


def test_state_goes_on_to_the_same_bits():
    rng = np.random.default_rng(0)
    one = DesignPolicy(DesignPolicyConfig(), 4)
    values, log_probs = one.sample(rng.normal(size=(32, 4)))
    one.update(values, values[:, 0], log_probs)
    two = DesignPolicy(DesignPolicyConfig(), 4)
    two.load_state_dict(one.state_dict())
    for policy in (one, two):
        policy.update(values, values[:, 1], log_probs)
    np.testing.assert_array_equal(one.mean, two.mean)
    np.testing.assert_array_equal(one.std, two.std)
    assert one.update(values[:0], values[:0, 0], log_probs[:0])["design_step"] == 0.0


def test_settings_are_checked():
    with pytest.raises(ValueError, match="std is 0.5; it must lie within"):
        DesignPolicyConfig(std=0.5)


def test_costs():
    assert solid_angle(np.pi) == pytest.approx(2 * np.pi) and solid_angle(np.pi / 2) == pytest.approx(4 * np.pi / 6)
    assert tree_length(np.array([[0.0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 3, 0]])) == pytest.approx(5.0)
    design = load_design("forward")
    poses = np.stack([design.sensors, design.sensors])
    poses[1, 1, 6] = np.radians(3.0)  # closed
    assert CostConfig().free and design_cost(poses, design, CostConfig()).tolist() == [0.0, 0.0]
    cost = design_cost(poses, design, CostConfig(sensor=0.01, power=0.001, distance=1.0))
    np.testing.assert_allclose(cost, [2 * 0.026 + 0.12, 0.026 + 0.12])
    with pytest.raises(ValueError, match="fov is -1"):
        CostConfig(fov=-1)
