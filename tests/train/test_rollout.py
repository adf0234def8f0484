"""What the collector stores, and how the learner cuts it."""

import numpy as np
import torch
from toy_env import CueEnv

from prnav.policy import PolicyConfig, build_policy
from prnav.train.crew import Crew
from prnav.train.learner import Learner
from prnav.train.ppo import PPOConfig, ppo_loss
from prnav.train.rollout import Rollout, final_measures, final_observations

CONFIG = PolicyConfig(encoder="compact", width=16, lstm_hidden=16)


def collected(cut: bool = False, environments: int = 8, steps: int = 11, expert_share=None):
    envs = CueEnv(environments, length=4, cut=cut)
    policy = build_policy(CONFIG, envs.observation_specs, envs.action_spec)
    crew = Crew([envs], policy, seed=0, threads=1)
    rollout = Rollout(steps, environments, policy)
    _, first = crew.collect(rollout, expert_share)
    _, ended = crew.collect(rollout, expert_share)  # the second one goes on from the first one's state
    return policy, rollout, [*first, *ended]


def test_learning_sees_what_acting_saw():
    policy, rollout, _ = collected()
    with torch.no_grad():
        distribution, values = policy.sequence(
            rollout.observations, rollout["previous_actions"], rollout["starts"], rollout.state
        )
    torch.testing.assert_close(values, rollout["values"], atol=1e-5, rtol=0)
    log_probs = distribution.log_prob(rollout["actions"])
    torch.testing.assert_close(log_probs, rollout["log_probs"], atol=1e-5, rtol=0)


def test_starts_follow_ends():
    _, rollout, ended = collected()
    over = rollout["terminated"] | rollout["truncated"]
    assert torch.equal(rollout["starts"][1:], over[:-1])
    assert torch.equal(rollout["previous_actions"][1:], rollout["actions"][:-1])
    assert len(ended) >= over.sum()
    assert all(set(row) == {"success", "reward"} for row in ended)  # numbers alone


def test_final_values_are_those_of_the_state_that_was_cut_off():
    """The policy run on through the cut, without a reset, sees the final observation at the next step."""
    policy, rollout, _ = collected(cut=True)
    starts, clock = rollout["starts"], rollout.observations["clock"]
    cuts = torch.nonzero(rollout["truncated"][:-1])
    assert len(cuts) and not rollout["terminated"].any()
    for t, n in cuts.tolist():
        observations = {key: value[: t + 2, n : n + 1].clone() for key, value in rollout.observations.items()}
        for key, value in observations.items():
            value[t + 1] = 0.0
            if key == "clock":
                value[t + 1] = clock[t, n] + 1  # the toy's final observation: all dark, one step later
        previous = rollout["previous_actions"][: t + 2, n : n + 1]
        unbroken = starts[: t + 2, n : n + 1].clone()
        unbroken[t + 1] = False
        with torch.no_grad():
            _, values = policy.sequence(
                observations, previous, unbroken, policy.core.select(rollout.state, slice(n, n + 1))
            )
        torch.testing.assert_close(values[t + 1, 0], rollout["final_values"][t, n], atol=1e-5, rtol=0)


def test_the_oracle_labels_all_steps_and_takes_its_share():
    _, rollout, _ = collected(expert_share=1.0)
    assert torch.equal(rollout["actions"], rollout["expert"])
    _, rollout, _ = collected(expert_share=0.0)
    agreement = (rollout["actions"] == rollout["expert"]).float().mean()
    assert (rollout["expert"] >= 0).all() and 0.1 < agreement < 0.6
    _, rollout, _ = collected()
    assert (rollout["expert"] == -1).all()


def test_gradients_do_not_depend_on_threads_or_mini_batches_of_equal_size():
    policy, rollout, _ = collected()
    rollout["advantages"], rollout["returns"] = torch.randn(11, 8), torch.randn(11, 8)

    def step(threads: int) -> list[torch.Tensor]:
        learner = Learner(policy, seed=0, threads=threads, epsilon=1e-5)
        before = [parameter.detach().clone() for parameter in learner.parameters]
        learner.update(rollout, lambda *a: ppo_loss(*a, PPOConfig()), 1, 1, 1e-9, 1e9)
        for parameter, value in zip(learner.parameters, before, strict=True):
            parameter.data.copy_(value)
        return [parameter.grad.clone() for parameter in learner.parameters]

    for a, b in zip(step(1), step(3), strict=True):
        torch.testing.assert_close(a, b, atol=1e-6, rtol=1e-4)
    for a, b in zip(step(2), step(2), strict=True):
        assert torch.equal(a, b)


def test_final_information_in_both_layouts():
    rows = np.array([0, 2])
    ours = {"final_obs": {"gps": np.arange(6.0).reshape(3, 2), "_gps": np.array([True, False, True])}}
    theirs = {"final_obs": np.array([{"gps": np.array([0.0, 1.0])}, None, {"gps": np.array([4.0, 5.0])}])}
    for info in (ours, theirs):
        final = final_observations(info, rows)
        assert list(final) == ["gps"] and final["gps"].tolist() == [[0, 1], [4, 5]]
    info = {"final_info": {"spl": np.array([0.5, 0, 1.0]), "_spl": np.ones(3, bool), "scene_id": np.array(["a"] * 3)}}
    assert final_measures(info, rows) == [{"spl": 0.5}, {"spl": 1.0}]
