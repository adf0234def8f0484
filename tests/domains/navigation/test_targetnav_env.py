import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import prnav  # noqa: F401 (registers the environments)
from prnav.domains.navigation.env import NavigationSlots, load_source
from prnav.domains.navigation.pointgoal import PointGoalNavEnv
from prnav.domains.navigation.targetnav import (
    TargetNavConfig,
    TargetNavEnv,
    TargetNavEnvConfig,
    TargetNavVectorEnv,
)
from prnav.errors import ConfigError
from prnav.scene import ten_training_homes
from prnav.sim.simulator import LEFT


@pytest.fixture(scope="module")
def target(config):
    return TargetNavEnvConfig(scenes="train", max_scenes=2, episodes_per_scene=60, rays_per_receptor=1)


def test_gymnasium_makes_both_and_finds_no_fault(target, source):
    env = gymnasium.make("prnav/TargetNav-v0", config=target, source=source)
    check_env(env.unwrapped, skip_render_check=True)
    assert env.action_space.n == 3
    assert "pointgoal" not in env.observation_space.spaces
    envs = gymnasium.make_vec(
        "prnav/TargetNav-v0", num_envs=3, vectorization_mode="vector_entry_point", config=target, source=source
    )
    assert envs.reset(seed=0)[0] in envs.observation_space
    single = TargetNavEnv(source=source, scenes="val", rays_per_receptor=1, rules={"max_steps": 7})
    assert single.config.rules == TargetNavConfig(max_steps=7)
    assert TargetNavEnv(source=source, vision=False).config.rules == TargetNavConfig()


def test_a_batch_equals_single_environments_step_for_step(target, source):
    short = dataclasses.replace(target, rules=TargetNavConfig(max_steps=50))
    batch = TargetNavVectorEnv(3, short, source)
    singles = [TargetNavEnv(short, source) for _ in range(3)]
    observations, _ = batch.reset(seed=10)
    alone = [single.reset(seed=10 + i)[0] for i, single in enumerate(singles)]
    ends = {"terminated": 0, "truncated": 0}
    for t in range(130):
        for i in range(3):
            for name, value in observations.items():
                np.testing.assert_array_equal(value[i], alone[i][name])
        actions = batch.expert_actions() if t >= 50 else np.full(3, t % 3)
        assert [single.expert_action() for single in singles] == batch.expert_actions().tolist()
        observations, rewards, terminated, truncated, info = batch.step(actions)
        for i, single in enumerate(singles):
            alone[i], reward, term, trunc, facts = single.step(actions[i])
            assert (reward, term, trunc) == (rewards[i], terminated[i], truncated[i])
            if term or trunc:
                ends["terminated" if term else "truncated"] += 1
                for name in ("spl", "soft_spl", "distance_to_goal", "success"):
                    assert info["final_info"][name][i] == facts[name]
                assert facts["success"] == term == (facts["distance_to_goal"] <= 0.8)
                alone[i] = single.reset()[0]
    assert min(ends.values()) > 0


def test_the_oracle_finds_every_sphere_and_all_rewards_add_up(target, source):
    env = TargetNavVectorEnv(8, dataclasses.replace(target, vision=False), source)
    env.reset(seed=3)
    shortest = env.slots.shortest.copy()
    found = np.zeros(8, bool)
    for _ in range(150):
        *_, info = env.step(env.expert_actions())
        if "final_info" in info:
            final = info["final_info"]
            for i in np.flatnonzero(info["_final_info"] & ~found):
                assert final["success"][i] == 1.0
                left, steps = final["distance_to_goal"][i], final["steps"][i]
                assert final["reward"][i] == pytest.approx(shortest[i] - left - 0.003 * steps + 2.5, abs=1e-9)
                found[i] = True
    assert found.all()


def test_only_the_sphere_differs_between_visible_and_invisible(config, target, source):
    hidden = dataclasses.replace(target, rules=TargetNavConfig(visible=False))
    there, gone, without = (NavigationSlots(source, 12, each) for each in (target, hidden, config))
    for slots in (there, gone, without):
        slots.begin(np.arange(12), np.arange(12))
    green = np.zeros(12, bool)
    for _ in range(80):
        seen, unseen, never = there.observe(), gone.observe(), without.observe()
        np.testing.assert_array_equal(unseen["photoreceptors"], never["photoreceptors"])
        np.testing.assert_array_equal(seen["gps"], unseen["gps"])
        changed = np.any(seen["photoreceptors"] != unseen["photoreceptors"], axis=-1)
        pure = np.all(seen["photoreceptors"] == np.float32([0.0, 1.0, 0.0]), axis=-1)
        assert not (pure & ~changed).any()
        green |= pure.any(axis=(1, 2))
        acting, actions = ~there.success, there.expert_actions()
        for slots in (there, gone, without):
            slots.advance(actions + there.first_action - slots.first_action, acting)
    assert green.sum() > 8


def test_actions_are_forward_left_right(target, source):
    env = TargetNavEnv(dataclasses.replace(target, vision=False), source)
    env.reset(seed=0)
    yaw = env.slots.yaws[0]
    env.step(1)
    assert np.isclose(np.sin(env.slots.yaws[0] - yaw), np.sin(np.pi / 6))
    assert env.slots.first_action + 1 == LEFT
    with pytest.raises(ValueError, match="action is 3; it must be an integer from 0 to 2"):
        env.step(3)


def test_a_config_of_the_other_task_is_refused(config, target, source):
    with pytest.raises(ConfigError, match="is for targetnav and its config for pointgoal; give a TargetNavEnvConfig"):
        TargetNavEnv(config, source)
    with pytest.raises(ConfigError, match="is for pointgoal and its config for targetnav; give a PointGoalEnvConfig"):
        PointGoalNavEnv(target, source)


def test_training_is_in_the_ten_drawn_homes():
    config = TargetNavEnvConfig(max_scenes=2, episodes_per_scene=3, vision=False)
    assert load_source(config).world.scene_ids == tuple(ten_training_homes()[:2])
