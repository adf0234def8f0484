"""Joint optimisation on a toy: designs reach the agents, are scored, learn, and a resumed run has the same bits."""

import json

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from prnav.contracts import DiscreteActions, ObservationSpec
from prnav.design.cost import CostConfig
from prnav.design.designed_envs import DesignedVectorEnv
from prnav.design.gaussian import DesignPolicy, DesignPolicyConfig
from prnav.design.joint import JointConfig, JointTrainer, UpdateTurn, turn
from prnav.errors import ConfigError
from prnav.policy import PolicyConfig
from prnav.sensors import load_design
from prnav.train import PPOConfig, RunFolder, TrainConfig

DESIGN = load_design("habitat-camera")
OPTIMUM = np.array([0.0, 0.3, 0.0, -0.3, 0.2, 0.0, 0.0])


class ScoredEnv(VectorEnv):
    """Episodes of a few steps whose score says how near the design is to an optimum, whatever the agent does."""

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(self, num_envs=16):
        self.num_envs = num_envs
        box = gymnasium.spaces.Box(-np.inf, np.inf, (1, 7), np.float32)
        sight = gymnasium.spaces.Box(0, 1, (1, 1, 3), np.float32)
        self.single_observation_space = gymnasium.spaces.Dict({"design": box, "photoreceptors": sight})
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.single_action_space = gymnasium.spaces.Discrete(2)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.theta, self.waiting = np.zeros((2, num_envs, 1, 7))

    def reset(self, *, seed=None, options=None):
        self.time = np.arange(self.num_envs) % 3
        self.theta = self.waiting.copy()
        return self._observe(), {}

    def set_designs(self, agents, theta):
        self.waiting[agents] = theta

    def step(self, actions):
        over = self.time == 2
        info = {}
        if over.any():
            score = 1.0 - ((self.theta[:, 0] - OPTIMUM) ** 2).sum(1)
            info = {
                "final_obs": self._observe(),
                "final_info": {"soft_spl": score, "played": self.theta[:, 0, 1].copy()},
            }
            self.theta[over] = self.waiting[over]
        self.time = np.where(over, 0, self.time + 1)
        return self._observe(), np.zeros(self.num_envs), over, np.zeros_like(over), info

    observation_specs = {
        "design": ObservationSpec((1, 7), "design"),
        "photoreceptors": ObservationSpec((1, 1, 3), "receptors"),
    }
    action_spec = DiscreteActions(2)

    def snapshot(self):
        return {"theta": self.theta.copy(), "waiting": self.waiting.copy(), "time": self.time.copy()}

    def restore(self, state):
        self.theta, self.waiting, self.time = (np.array(state[key]) for key in ("theta", "waiting", "time"))

    def _observe(self):
        return {
            "design": self.theta.astype(np.float32),
            "photoreceptors": np.zeros((self.num_envs, 1, 1, 3), np.float32),
        }


def config(**changes):
    policy = PolicyConfig(encoder="compact", width=4, lstm_hidden=4, lstm_layers=1)
    ppo = PPOConfig(rollout_steps=12, epochs=1, learning_rate=1e-3)
    defaults = {"total_steps": 16 * 12 * 30, "num_envs": 16, "policy": policy, "ppo": ppo, "threads": 1}
    return TrainConfig(**{**defaults, "checkpoint_steps": 16 * 12 * 5, **changes})


JOINT = JointConfig(2, 1, 2, score="soft_spl", policy=DesignPolicyConfig(learning_rate=0.03, epochs=4))


def trainer(path, run=None, joint=JOINT, **keys):
    made = JointTrainer(run or config(), joint, ScoredEnv(), DESIGN, RunFolder(path), **keys)
    made.begin()
    return made


def test_the_schedule_is_the_papers():
    paper = JointConfig()
    assert turn(paper, 19_999) == UpdateTurn(True, "")
    assert turn(paper, 20_000) == UpdateTurn(True, "")
    assert [turn(paper, 20_000 + i).control for i in (399, 400, 499, 500)] == [True, False, False, True]
    assert [turn(paper, 20_000 + i).design for i in (399, 400, 498, 499, 999)] == [
        "",
        "collect",
        "collect",
        "update",
        "update",
    ]
    together = JointConfig(10, 400, 3, "together")
    assert [turn(together, i).design for i in range(9, 14)] == ["", "collect", "collect", "update", "collect"]
    assert turn(together, 12).control


def test_an_episode_is_scored_with_the_design_it_was_played_with():
    policy = DesignPolicy(DesignPolicyConfig(), 7)
    envs = DesignedVectorEnv(ScoredEnv(), DESIGN, policy, CostConfig(sensor=0.25), "soft_spl", seed=3)
    envs.reset(seed=0)
    played = []
    for _ in range(9):
        *_, info = envs.step(np.zeros(16, np.int64))
        if info:
            played.append(info["final_info"]["played"])
    assert len(envs.scores) == 16 * 3
    assert len(np.unique(envs.values[:, 1])) == 16 * 3  # each episode has its own design
    np.testing.assert_allclose(envs.scores, 0.75 - ((envs.values - OPTIMUM) ** 2).sum(1))
    firsts = []
    for count in (4, 16):
        other = DesignedVectorEnv(ScoredEnv(count), DESIGN, policy, CostConfig(), "soft_spl", seed=3)
        other.reset(seed=0)
        firsts.append(other.current[:4])
    np.testing.assert_array_equal(*firsts)  # an agent's designs are its own, however many play


def test_the_mean_goes_to_the_optimum_and_only_when_its_turn_comes(tmp_path):
    rows = []
    joint = trainer(tmp_path / "run", report=rows.append)
    joint.train()
    joint.close()
    phases = [row["phase"] for row in rows]
    assert phases[:8] == ["ppo", "ppo", "ppo", "design", "design", "ppo", "design", "design"]
    moved = [row["losses"].get("design_moved") for row in rows]
    assert [value is not None for value in moved[:8]] == [False] * 4 + [True, False, False, True]
    found = joint.theta[0]
    assert np.linalg.norm(found - OPTIMUM) < 0.5 * np.linalg.norm(OPTIMUM)
    best = joint.best_design("found")
    assert best.body.distance(best.sensors[:, :3]).max() < 1e-9 and best.sensors[0, 1] > DESIGN.sensors[0, 1]
    assert len(json.loads((tmp_path / "run" / "designs.json").read_text())) == len(joint.history) == 9


def test_control_is_frozen_while_the_design_collects(tmp_path):
    weights = []

    def keep(row):
        weights.append((row["phase"], _weights(joint)))

    joint = trainer(tmp_path / "run", report=keep)
    joint.train()
    joint.close()
    for (_, before), (phase, after) in zip(weights, weights[1:], strict=False):
        assert np.array_equal(before, after) == (phase == "design")


def _weights(joint):
    return np.concatenate([value.detach().numpy().ravel() for value in joint.policy.parameters()])


@pytest.mark.parametrize("schedule", ["alternate", "together"])
def test_a_resumed_run_has_the_same_bits(tmp_path, schedule):
    joint = JointConfig(2, 1, 2, schedule, "soft_spl")
    whole = trainer(tmp_path / "whole", joint=joint)
    whole.train()
    first = trainer(tmp_path / "parts", config(total_steps=16 * 12 * 13), joint)
    first.train()
    first.close()
    second = trainer(tmp_path / "parts", joint=joint)
    assert second.step == 16 * 12 * 13
    second.train()
    np.testing.assert_array_equal(second.theta, whole.theta)
    np.testing.assert_array_equal(_weights(second), _weights(whole))
    assert second.history == whole.history
    for one in (whole, second):
        one.close()


def test_a_run_keeps_its_joint_settings(tmp_path):
    first = trainer(tmp_path / "run", config(total_steps=16 * 12))
    first.close()
    with pytest.raises(ConfigError, match="its joint optimisation or initial design differs"):
        trainer(tmp_path / "run", joint=JointConfig(3, 1, 2))
