"""Readout and device from an environment's settings: they reach all that reads light; noise is the episode's own."""

import dataclasses
import importlib.util

import numpy as np
import pytest

from prnav.catalog import task_spec
from prnav.design.judging import play_design
from prnav.domains.navigation.env import NavigationSlots
from prnav.domains.navigation.env.settings import ReadoutSettings, SensorSettings
from prnav.domains.navigation.light import Light
from prnav.domains.navigation.pointgoal import PointGoalConfig, PointGoalNavEnv, PointGoalNavVectorEnv
from prnav.domains.navigation.probe import NavigationProbe, Proxy, ProxyConfig
from prnav.errors import DesignError
from prnav.play import episode_key
from prnav.policy import PolicyConfig, build_policy
from prnav.sensors import load_design, read_out
from prnav.sim import World

FAULTY = ReadoutSettings(exposure=(0.8, 1.5), noise=(0.05,), bits=(6,), acceptance="cosine", seed=3)


@pytest.fixture(scope="module")
def faulty(config):
    return dataclasses.replace(config, readout=FAULTY, rays_per_receptor=4, rules=PointGoalConfig(max_steps=9))


def test_readings_are_those_of_the_readout(faulty, source):
    clear = dataclasses.replace(faulty, readout=ReadoutSettings(acceptance="cosine"))
    slots, ideal = (NavigationSlots(source, 3, each) for each in (faulty, clear))
    for each in (slots, ideal):
        each.begin(np.arange(3), [7, 0, 4])
        each.advance([1, 2, 1])
    keys = np.array([episode_key(3, *source.id(episode)) for episode in (7, 0, 4)], np.uint64)
    expected = read_out(ideal.observe()["photoreceptors"], FAULTY, keys, np.ones(3, np.int64))
    np.testing.assert_array_equal(slots.observe()["photoreceptors"], expected)


@pytest.mark.parametrize("camera_size", [0, 8])
def test_noise_is_the_episodes_own_whatever_the_batch(faulty, source, random_actions, camera_size):
    seen = dataclasses.replace(faulty, camera_size=camera_size)
    name = "camera" if camera_size else "photoreceptors"
    batch, singles = PointGoalNavVectorEnv(3, seen, source), [PointGoalNavEnv(seen, source) for _ in range(3)]
    observations = batch.reset(seed=4)[0]
    alone = [single.reset(seed=4 + i)[0] for i, single in enumerate(singles)]
    ends = 0
    for _ in range(25):
        for row, one in enumerate(alone):
            np.testing.assert_array_equal(observations[name][row], one[name])
        actions = random_actions(3)
        observations, _, terminated, truncated, _ = batch.step(actions)
        for row, single in enumerate(singles):
            alone[row], *_ = single.step(actions[row])
            if (terminated | truncated)[row]:
                alone[row] = single.reset()[0]
                ends += 1
    assert ends >= 6


def test_noise_differs_from_step_to_step_and_from_seed_to_seed(faulty, source):
    def readings(**changes):
        readout = dataclasses.replace(FAULTY, bits=(0,), **changes)
        slots = NavigationSlots(source, 1, dataclasses.replace(faulty, readout=readout))
        slots.begin([0], [5])
        first = slots.observe()["photoreceptors"]
        for _ in range(12):  # a full turn: the same pose to the bit
            slots.advance([2])
        return first, slots.observe()["photoreceptors"]

    first, later = readings()
    assert (first != later).mean() > 0.5
    assert (readings(seed=4)[0] != first).mean() > 0.5
    first, later = readings(noise=(0.0,))
    np.testing.assert_array_equal(first, later)


def test_a_restored_environment_goes_on_with_the_same_noise(faulty, source, random_actions):
    first, second = PointGoalNavVectorEnv(3, faulty, source), PointGoalNavVectorEnv(3, faulty, source)
    first.reset(seed=5)
    for _ in range(5):
        first.step(random_actions(3))
    second.restore(first.snapshot())
    for _ in range(12):
        actions = random_actions(3)
        one, two = first.step(actions)[0], second.step(actions)[0]
        np.testing.assert_array_equal(one["photoreceptors"], two["photoreceptors"])


def test_what_is_kept_of_an_evaluation_is_what_the_agent_was_shown(faulty, source):
    slots = NavigationSlots(source, 2, faulty)
    slots.begin([0, 1], [8, 3])
    shown, positions, yaws = [], [], []
    for action in (1, 2, 1, 3):
        shown.append(slots.observe()["photoreceptors"][1])
        positions.append(slots.positions[1].copy())
        yaws.append(float(slots.yaws[1]))
        slots.advance([action, action])
    again = slots.readings_along(3, np.array(positions), np.array(yaws), np.arange(4))
    np.testing.assert_array_equal(again, shown)


def test_judging_reads_by_the_runs_settings(faulty, source):
    """The judge's slots have the run's readout, and how many there are changes nothing."""
    spec = task_spec("pointgoal")
    held_out = spec.held_out(faulty, "val")
    assert held_out.readout == FAULTY
    few = dataclasses.replace(source, table=source.table.take(np.arange(5)))
    slots = [spec.make_slots(faulty, few, count) for count in (5, 2)]
    policy = build_policy(
        PolicyConfig(encoder="compact", width=16, lstm_hidden=16), slots[0].observation_specs, slots[0].action_spec
    )
    theta = np.zeros((2, 7))
    one, two = (play_design(policy, each, theta, seed=1) for each in slots)
    for name, values in one.items():
        np.testing.assert_array_equal(values, two[name])


def test_the_proxy_scores_designs_as_the_run_reads_them(source, faulty):
    design = load_design("forward")
    homes = World(*(part * 2 for part in (source.world.scene_ids, source.world.scenes, source.world.navmeshes)))
    config = ProxyConfig(homes=4, places=160, pose_homes=1, goals=2, directions=4, features=16)
    ideal, noisy, again = (Proxy(config, homes, each) for each in (SensorSettings(), faulty, faulty))
    assert noisy.parts(design) == again.parts(design)
    assert noisy.parts(design) != ideal.parts(design)


def test_the_probe_of_a_task_takes_the_runs_settings(monkeypatch, faulty):
    given = []
    monkeypatch.setattr(Proxy, "load", lambda config, progress, sensing: given.append(sensing))
    NavigationProbe().load(ProxyConfig(), faulty)
    assert given == [faulty]


def test_settings_for_another_number_of_sensors_are_refused(faulty, source):
    with pytest.raises(DesignError, match="exposure has 2 values; the design has 4 sensors: give 1 or 4"):
        NavigationSlots(source, 1, dataclasses.replace(faulty, design="fan"))


def test_device_auto_is_the_cpu_where_no_gpu_is_found(monkeypatch, config, source):
    monkeypatch.setattr("prnav.render.renderer.cuda_available", lambda: False)
    light = Light(source.world.scenes, dataclasses.replace(config, device="auto"))
    assert light.renderer.device == "cpu" and not light.is_on_gpu and light.renderer.engine == "embree"


needs_warp = pytest.mark.skipif(
    importlib.util.find_spec("warp") is None, reason='the package warp-lang is missing; pip install "prnav[gpu]"'
)


@needs_warp
@pytest.mark.parametrize("camera_size", [0, 8])
def test_readings_that_stay_on_the_device_are_the_same(config, source, random_actions, camera_size):
    """As on a GPU, with Warp's CPU device in its place."""
    import torch

    settings = {"engine": "warp", "camera_size": camera_size, "rules": PointGoalConfig(max_steps=4)}
    name = "camera" if camera_size else "photoreceptors"
    host, there = (PointGoalNavVectorEnv(3, dataclasses.replace(config, **settings), source) for _ in range(2))
    assert not there.on_device
    there.on_device = True
    one, two = host.reset(seed=0)[0], there.reset(seed=0)[0]
    for _ in range(9):
        assert isinstance(two[name], torch.Tensor)
        np.testing.assert_array_equal(two[name].numpy(), one[name])
        assert str(two[name].dtype).removeprefix("torch.") == one[name].dtype.name
        kept = one[name].copy()
        two[name].fill_(0)  # the caller's own
        actions = random_actions(3)
        (one, *_, info), (two, *_, its_info) = host.step(actions), there.step(actions)
        np.testing.assert_array_equal(kept.shape, one[name].shape)
        for mine, other in zip(info.get("final_obs", []), its_info.get("final_obs", []), strict=True):
            assert (mine is None) == (other is None)
            if mine is not None:
                np.testing.assert_array_equal(mine[name], other[name].numpy())


@needs_warp
def test_the_collector_takes_readings_from_the_device(config, source):
    import torch

    from prnav.train.crew import Crew
    from prnav.train.rollout import Rollout

    settings = dataclasses.replace(config, engine="warp", rules=PointGoalConfig(max_steps=5))
    rollouts = []
    for on_device in (False, True):
        envs = PointGoalNavVectorEnv(3, settings, source)
        envs.on_device = on_device
        policy = build_policy(
            PolicyConfig(encoder="compact", width=16, lstm_hidden=16), envs.observation_specs, envs.action_spec
        )
        rollout = Rollout(8, 3, policy)
        Crew([envs], policy, seed=0, threads=1).collect(rollout, None)
        rollouts.append(rollout)
    for name, values in rollouts[0].observations.items():
        assert torch.equal(values, rollouts[1].observations[name])
    assert torch.equal(rollouts[0]["values"], rollouts[1]["values"])
