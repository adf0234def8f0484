import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import prnav  # noqa: F401 (registers the environments)
from prnav.domains.navigation.env import NavigationSlots
from prnav.domains.navigation.env.episode_source import deal
from prnav.domains.navigation.pointgoal import PointGoalConfig, PointGoalNavEnv, PointGoalNavVectorEnv
from prnav.errors import ConfigError, DesignError, EpisodeError


def test_gymnasium_makes_both_and_finds_no_fault(config, source):
    env = gymnasium.make("prnav/PointGoalNav-v0", config=config, source=source)
    check_env(env.unwrapped, skip_render_check=True)
    envs = gymnasium.make_vec(
        "prnav/PointGoalNav-v0", num_envs=3, vectorization_mode="vector_entry_point", config=config, source=source
    )
    observations, _ = envs.reset(seed=0)
    assert observations in envs.observation_space
    assert observations["photoreceptors"].shape == (3, len(envs.slots.design.sensors), 16, 3)


def test_a_camera_takes_the_photoreceptors_place(config, source):
    seen = dataclasses.replace(config, camera_size=32)
    envs = PointGoalNavVectorEnv(2, seen, source)
    observations, _ = envs.reset(seed=0)
    assert observations in envs.observation_space and "photoreceptors" not in observations
    slots = envs.slots
    view = slots.simulator.scene_index, slots.positions, slots.yaws, slots.poses
    picture = slots.light.renderer.image(*view, size=32)
    assert np.abs(observations["camera"] / 255.0 - picture).max() <= 0.5 / 255.0 + 1e-6
    assert observations["camera"].std() > 1.0


def test_single_settings_work_and_a_misspelt_one_is_named(source):
    env = PointGoalNavEnv(source=source, scenes="val", grid=1, rays_per_receptor=1)
    assert env.reset(seed=0)[0]["photoreceptors"].shape[1:] == (1, 3)
    with pytest.raises(ConfigError, match="unknown key 'gird'; did you mean grid?"):
        PointGoalNavEnv(source=source, gird=4)


def test_a_batch_equals_single_environments_step_for_step(config, source, random_actions):
    short = dataclasses.replace(config, rules=PointGoalConfig(max_steps=23))
    batch = PointGoalNavVectorEnv(4, short, source)
    singles = [PointGoalNavEnv(short, source) for _ in range(4)]
    observations, _ = batch.reset(seed=10)
    alone = [single.reset(seed=10 + i)[0] for i, single in enumerate(singles)]
    for t in range(60):
        for i in range(4):
            for name, value in observations.items():
                np.testing.assert_array_equal(value[i], alone[i][name])
        actions = random_actions(4)
        actions[t % 4] = 0 if t % 13 == 12 else actions[t % 4]
        observations, rewards, terminated, truncated, info = batch.step(actions)
        for i, single in enumerate(singles):
            alone[i], reward, term, trunc, facts = single.step(actions[i])
            assert (reward, term, trunc) == (rewards[i], terminated[i], truncated[i])
            assert ("final_info" in info and bool(info["_final_info"][i])) == (term or trunc)
            if term or trunc:
                for name in ("spl", "soft_spl", "distance_to_goal", "path_length", "collisions", "reward"):
                    assert info["final_info"][name][i] == facts[name]
                for name, value in alone[i].items():
                    np.testing.assert_array_equal(info["final_obs"][i][name], value)
                alone[i] = single.reset()[0]


def test_time_limit_truncates_and_stop_terminates(config, source):
    env = PointGoalNavEnv(dataclasses.replace(config, rules=PointGoalConfig(max_steps=3)), source)
    env.reset(seed=0)
    outcomes = [env.step(2)[2:4] for _ in range(3)]
    assert outcomes == [(False, False), (False, False), (False, True)]
    env.reset()
    assert env.step(0)[2:4] == (True, False)


def test_state_restores_to_the_bit(config, source, random_actions):
    short = dataclasses.replace(config, rules=PointGoalConfig(max_steps=17))
    first, second = PointGoalNavVectorEnv(3, short, source), PointGoalNavVectorEnv(3, short, source)
    first.reset(seed=5)
    theta = np.random.Generator(np.random.PCG64(0)).normal(0, 0.1, (2, first.slots.num_sensors, 7))
    first.set_designs([0, 2], theta)
    for _ in range(25):
        first.step(random_actions(3))
    second.restore(first.snapshot())
    for name, value in first.observations().items():
        np.testing.assert_array_equal(value, second.observations()[name])
    for _ in range(30):
        actions = random_actions(3)
        one, two = first.step(actions), second.step(actions)
        for name, value in one[0].items():
            np.testing.assert_array_equal(value, two[0][name])
        np.testing.assert_array_equal(one[1], two[1])


def test_designs_change_at_the_next_episode_only(config, source):
    env = PointGoalNavVectorEnv(2, dataclasses.replace(config, rules=PointGoalConfig(max_steps=2)), source)
    before, _ = env.reset(seed=0)
    theta = np.full((1, env.slots.num_sensors, 7), 0.05)
    env.set_designs([1], theta)
    np.testing.assert_array_equal(env.step([2, 2])[0]["design"], before["design"])
    after = env.step([2, 2])[0]["design"]
    np.testing.assert_array_equal(after[0], before["design"][0])
    np.testing.assert_allclose(after[1], theta[0], rtol=1e-6)


def test_a_bad_design_is_refused(config, source):
    slots = NavigationSlots(source, 1, config)
    with pytest.raises(DesignError, match="not finite"):
        slots.set_designs([0], np.full((1, slots.num_sensors, 7), np.nan))
    with pytest.raises(DesignError, match=r"it must be \(1, "):
        slots.set_designs([0], np.zeros((1, 9, 7)))
    with pytest.raises(DesignError, match=r"it must be \(2, "):
        PointGoalNavVectorEnv(2, config, source).set_designs([0, 1], np.zeros((1, slots.num_sensors, 7)))


def test_an_unreachable_goal_is_named(config, source):
    lost = dataclasses.replace(
        source, table=dataclasses.replace(source.table, goal_position=source.goals + [0.0, 500.0, 0.0])
    )
    with pytest.raises(EpisodeError, match="its goal cannot be reached from its start"):
        NavigationSlots(lost, 1, config).begin([0], [0])


def test_the_oracle_arrives_on_a_nearly_shortest_path(config, source):
    env = PointGoalNavVectorEnv(16, dataclasses.replace(config, vision=False), source)
    env.reset(seed=3)
    spl, success = [], []
    for _ in range(150):
        info = env.step(env.expert_actions())[-1]
        if "final_info" in info:
            mask = info["_final_info"]
            spl.extend(info["final_info"]["spl"][mask])
            success.extend(info["final_info"]["success"][mask])
    assert len(spl) > 20
    assert np.mean(success) == 1.0
    assert np.mean(spl) > 0.9


def test_reward_sums_to_the_progress_made(config, source, random_actions):
    env = PointGoalNavVectorEnv(8, dataclasses.replace(config, vision=False), source)
    env.reset(seed=0)
    begin, total = env.slots.distance.copy(), np.zeros(8)
    for _ in range(20):
        total += env.step(random_actions(8))[1]
    np.testing.assert_allclose(total, begin - env.slots.distance - 20 * 0.003, atol=1e-9)


def test_episodes_are_dealt_evenly_over_scenes(source):
    dealt = deal(source.table, 3)
    assert [dealt.scene_id(row) for row in range(3)] == [source.table.scene_id(row) for row in (0, 1, 60)]
    only = deal(source.table, 1)
    assert only.scene_ids == source.table.scene_ids[:1]
    assert deal(source.table, 1000) is source.table
