"""Environments of the control tasks: Gymnasium's rules, episodes, snapshots, and the same bits in any company."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest

pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

from gymnasium.utils.env_checker import check_env  # noqa: E402

from prnav.contracts import BatchEnv, Designable, EpisodeSlots  # noqa: E402
from prnav.domains.control.env import (  # noqa: E402
    CONFIGS,
    ControlConfig,
    ControlEnv,
    ControlSlots,
    ControlVectorEnv,
    EpisodeSeeds,
    config_of,
    episode_seed,
    split_seeds,
)
from prnav.domains.control.suite import WalkerRunEnv, WalkerWalkVectorEnv  # noqa: E402
from prnav.errors import ConfigError, DesignError, EpisodeError  # noqa: E402

SENSES = ("receptors", "camera", "third-person", "state", "nothing")


def config(task, senses="receptors", **settings):
    return config_of(task.name)(senses=senses, rays_per_receptor=4, camera_size=12, **settings)


def random_actions(env, steps, seed=0):
    shape = (steps, env.num_envs, env.action_spec.size)
    return np.random.default_rng(seed).uniform(-1, 1, shape).astype(np.float32)


def assert_same(got, want):
    assert got.keys() == want.keys()
    for name in want:
        np.testing.assert_array_equal(got[name], want[name], err_msg=name)


@pytest.mark.parametrize("senses", SENSES)
def test_single_environments_pass_gymnasiums_check(task, mounts, senses):
    env = ControlEnv(config(task, senses), mounts=mounts)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*not wrapped.*|.*spec.*|.*infinity.*|.*render.*")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("senses", SENSES)
def test_observations_are_as_the_specs_say(task, mounts, senses):
    envs = ControlVectorEnv(3, config(task, senses), mounts=mounts)
    observations, _ = envs.reset(seed=4)
    observations = [observations, *(envs.step(action)[0] for action in random_actions(envs, 3))]
    for row in observations:
        assert row.keys() == envs.observation_specs.keys()
        assert envs.observation_space.contains(row)
        for name, spec in envs.observation_specs.items():
            assert row[name].shape == (3, *spec.shape) and row[name].dtype == spec.dtype
            assert (row[name] >= spec.low).all() and (row[name] <= spec.high).all()
    if senses not in ("nothing", "state"):
        name = "photoreceptors" if senses == "receptors" else "camera"
        assert np.ptp(observations[0][name]) > 0 and not np.array_equal(observations[0][name], observations[-1][name])
    if senses == "nothing":
        assert set(observations[0]) == {"design"} and not observations[0]["design"].any()


def test_environments_are_what_the_contracts_ask_for(task, mounts):
    envs = ControlVectorEnv(2, config(task, "nothing"), mounts=mounts)
    assert isinstance(envs, BatchEnv) and isinstance(envs, Designable)
    assert isinstance(envs.slots, EpisodeSlots)


@pytest.mark.parametrize("num_envs", [1, 3])
def test_ids_are_registered_with_their_task(task, mounts, num_envs):
    name = f"prnav/{task.facts.env_name}-v0"
    env = gymnasium.make(name, senses="state")
    observation, _ = env.reset(seed=1)
    assert env.unwrapped.config.task == task.name
    envs = gymnasium.make_vec(name, num_envs=num_envs, vectorization_mode="vector_entry_point", senses="state")
    rows, _ = envs.reset(seed=1)
    np.testing.assert_array_equal(rows["state"][0], observation["state"])


@pytest.mark.parametrize("sensors", [2, 4, 8])
def test_designs_of_the_library_see(task, sensors):
    name = f"prnav/{task.facts.env_name}-v0"
    design = f"{task.facts.body}-{sensors}"
    env = gymnasium.make(name, design=design, grid=2)
    observation, _ = env.reset(seed=0)
    assert observation["photoreceptors"].shape == (sensors, 4, 3) and np.ptp(observation["photoreceptors"]) > 0.1
    if sensors == 4:
        assert_same(gymnasium.make(name, grid=2).reset(seed=0)[0], observation)
    with pytest.raises(DesignError, match="'nowhere'"):
        gymnasium.make(name, design="nowhere")
    other = {"reacher": "walker", "walker": "finger", "finger": "reacher"}[task.facts.body]
    with pytest.raises(DesignError, match=f"{other}-2"):
        gymnasium.make(name, design=f"{other}-2")


def test_a_vector_environment_is_its_single_environments(task, mounts):
    envs = ControlVectorEnv(3, config(task), mounts=mounts)
    singles = [ControlEnv(config(task), mounts=mounts) for _ in range(3)]
    together, _ = envs.reset(seed=10)
    for row, env in enumerate(singles):
        assert_same(env.reset(seed=10 + row)[0], {name: value[row] for name, value in together.items()})
    for actions in random_actions(envs, 5):
        together, rewards, *_ = envs.step(actions)
        for row, env in enumerate(singles):
            observation, reward, *_ = env.step(actions[row])
            assert reward == rewards[row]
            assert_same(observation, {name: value[row] for name, value in together.items()})


def test_threads_and_company_change_no_bits(task, mounts):
    many = ControlVectorEnv(66, config(task), mounts=mounts)  # more than one batch that keeps its simulations' data
    some = ControlVectorEnv(5, config(task, threads=3), mounts=mounts)
    whole, part = many.reset(seed=0)[0], some.reset(seed=0)[0]
    for actions in random_actions(many, 4):
        assert_same(part, {name: value[:5] for name, value in whole.items()})
        whole, rewards, *_ = many.step(actions)
        part, some_rewards, *_ = some.step(actions[:5])
        np.testing.assert_array_equal(some_rewards, rewards[:5])
    assert_same(part, {name: value[:5] for name, value in whole.items()})


def test_rewards_are_sums_over_the_repeated_action(task, mounts):
    envs = ControlVectorEnv(4, config(task, "state"))
    repeat = task.facts.action_repeat
    assert envs.config.repeat == repeat
    envs.reset(seed=3)
    start = envs.slots.state(np.arange(4))
    actions = random_actions(envs, 6)
    repeated = np.repeat(actions, repeat, axis=0).swapaxes(0, 1)
    want = task.rollout(start["qpos"], start["qvel"], start["target"], repeated)
    for step, action in enumerate(actions):
        observation, rewards, *_ = envs.step(action)
        np.testing.assert_allclose(rewards, want.reward[:, step * repeat : (step + 1) * repeat].sum(axis=1), rtol=1e-12)
        np.testing.assert_array_equal(observation["state"], want.obs[:, (step + 1) * repeat - 1].astype(np.float32))


def test_episodes_are_truncated_after_a_thousand_simulation_steps(task, mounts):
    envs = ControlVectorEnv(2, config(task, "state", action_repeat=250))
    first, info = envs.reset(seed=0)
    seeds, total = info["episode_seed"].copy(), np.zeros(2)
    for step, actions in enumerate(random_actions(envs, 4)):
        observation, rewards, terminated, truncated, info = envs.step(actions)
        total += rewards
        assert not terminated.any() and truncated.all() == (step == 3)
    final = info["final_info"]
    np.testing.assert_allclose(final["return"], total)
    assert (final["steps"] == 1000).all() and not final["diverged"].any()
    assert list(final["episode_id"]) == [str(seed) for seed in seeds] and set(final["scene_id"]) == {task.name}
    assert (info["episode_seed"] != seeds).all()
    other = ControlVectorEnv(2, config(task, "state"))
    again, _ = other.reset(options={"episodes": info["episode_seed"]})
    np.testing.assert_array_equal(again["state"], observation["state"])
    assert not np.array_equal(info["final_obs"][0]["state"], observation["state"][0])
    with pytest.raises(ConfigError, match="action_repeat is 3; it must divide the 1000 steps of an episode"):
        WalkerWalkVectorEnv(2, action_repeat=3)


def test_a_diverging_simulation_ends_its_episode_alone_and_is_counted(task, mounts):
    envs = ControlVectorEnv(4, config(task), mounts=mounts)
    calm = ControlVectorEnv(4, config(task), mounts=mounts)
    envs.reset(seed=5), calm.reset(seed=5)
    actions = random_actions(envs, 3)
    envs.step(actions[0]), calm.step(actions[0])
    envs.slots.physics.qvel[2] = 1e9
    observation, rewards, terminated, truncated, info = envs.step(actions[1])
    want = calm.step(actions[1])
    np.testing.assert_array_equal(terminated, [False, False, True, False])
    assert not truncated.any() and rewards[2] == 0.0
    assert info["final_info"]["diverged"][2] == 1.0 and np.isfinite(info["final_obs"][2]["photoreceptors"]).all()
    others = [0, 1, 3]
    for _ in range(2):
        np.testing.assert_array_equal(observation["photoreceptors"][others], want[0]["photoreceptors"][others])
        np.testing.assert_array_equal(rewards[others], want[1][others])
        observation, rewards, terminated, *_ = envs.step(actions[2])
        want = calm.step(actions[2])
    assert not terminated.any() and np.isfinite(observation["photoreceptors"]).all()
    assert envs.slots.steps[2] == 2 * envs.config.repeat


@pytest.mark.parametrize("senses", ["receptors", "state"])
def test_snapshots_continue_to_the_same_bits(task, mounts, senses):
    envs = ControlVectorEnv(3, config(task, senses, action_repeat=100), mounts=mounts)
    envs.reset(seed=8)
    actions = random_actions(envs, 14)
    for action in actions[:5]:
        envs.step(action)
    if senses == "receptors":
        envs.set_designs([1], np.full((1, 4, 7), 0.1))
    state, seen = envs.snapshot(), envs.observations()
    other = ControlVectorEnv(3, config(task, senses, action_repeat=100), mounts=mounts)
    other.restore(state)
    assert_same(other.observations(), seen)
    for action in actions[5:]:  # across the end of an episode
        got, want = other.step(action), envs.step(action)
        assert_same(got[0], want[0])
        for a, b in zip(got[1:4], want[1:4], strict=True):
            np.testing.assert_array_equal(a, b)
    if senses == "receptors":
        assert got[0]["design"][1].any() and not got[0]["design"][0].any()
    small = ControlVectorEnv(2, config(task, senses), mounts=mounts)
    with pytest.raises(ConfigError, match="the snapshot's seed has shape"):
        small.restore(state)


def test_designs_change_what_is_read_from_the_next_episode_on(task, mounts):
    envs = ControlVectorEnv(2, config(task, action_repeat=500), mounts=mounts)
    first, _ = envs.reset(seed=2)
    theta = np.random.default_rng(0).normal(size=(1, 4, 7)) * 0.3
    envs.set_designs([0], theta)
    actions = random_actions(envs, 2)
    before = envs.step(actions[0])[0]
    assert not before["design"].any()
    after = envs.step(actions[1])[0]
    np.testing.assert_array_equal(after["design"][0], theta[0].astype(np.float32))
    assert not after["design"][1].any()
    plain = ControlVectorEnv(2, config(task, action_repeat=500), mounts=mounts)
    plain.reset(seed=2), plain.step(actions[0])
    same = plain.step(actions[1])[0]["photoreceptors"]
    assert np.array_equal(same[1], after["photoreceptors"][1])
    assert not np.array_equal(same[0], after["photoreceptors"][0])
    with pytest.raises(DesignError, match="agent 2 of 2"):
        envs.set_designs([2], theta)
    with pytest.raises(DesignError, match=r"designs have shape \(1, 3, 7\); for this environment it must be"):
        envs.set_designs([0], theta[:, :3])
    with pytest.raises(DesignError, match="not finite"):
        envs.set_designs([0], theta * np.nan)


def test_slots_play_a_list_of_episodes_in_any_order(task, mounts):
    seeds = [7, 123, 4_294_967_295]
    slots = ControlSlots(config(task), 2, seeds, mounts=mounts)
    assert slots.episode_ids == tuple((task.name, str(seed)) for seed in seeds)
    slots.begin(np.array([1]), np.array([2]))
    slots.begin(np.array([0]), np.array([1]))
    alone = ControlSlots(config(task), 1, seeds, mounts=mounts)
    alone.begin(np.array([0]), np.array([2]))
    actions = np.random.default_rng(0).uniform(-1, 1, (4, 2, task.facts.actions))
    for step, acting in enumerate([[True, True], [False, True], [True, False], [True, True]]):
        held = slots.observe(np.array([0]))
        slots.advance(actions[step], np.array(acting))
        if acting[1]:
            alone.advance(actions[step, 1:])
        if not acting[0]:
            assert_same(slots.observe(np.array([0])), held)
        assert_same(slots.observe(np.array([1])), alone.observe(np.array([0])))
    assert slots.outcome(1) == alone.outcome(0)
    assert slots.outcome(1)["steps"] == 3 * slots.config.repeat and slots.outcome(1)["episode_id"] == str(seeds[2])
    assert {name: value.shape[0] for name, value in slots.state(np.array([0, 1])).items()}.keys() >= {"qpos", "qvel"}
    with pytest.raises(EpisodeError, match="episode 3 of 3"):
        slots.begin(np.array([0]), np.array([3]))
    with pytest.raises(EpisodeError, match="seed of an episode is -1"):
        slots.begin_seeds([0], [-1])


def test_bad_actions_are_refused(task, mounts):
    envs = ControlVectorEnv(2, config(task, "state"))
    envs.reset(seed=0)
    with pytest.raises(ValueError, match="actions have shape"):
        envs.step(np.zeros((2, task.facts.actions + 1)))
    with pytest.raises(ValueError, match="not finite"):
        envs.step(np.full((2, task.facts.actions), np.nan))


def test_settings_are_checked():
    with pytest.raises(ConfigError, match="control task 'walker-fly' is unknown; valid: reacher-hard, "):
        config_of("walker-fly")
    with pytest.raises(ConfigError, match="'senses' is 'smell'; valid: 'receptors'"):
        WalkerWalkVectorEnv(1, senses="smell")
    with pytest.raises(ConfigError, match="split is 'dev'; valid: 'train', 'val', 'test'"):
        WalkerWalkVectorEnv(1, split="dev")
    with pytest.raises(ConfigError, match="num_envs is 0"):
        WalkerWalkVectorEnv(0, senses="state")
    with pytest.raises(ConfigError, match="the environment is for walker-run and its config for walker-walk"):
        WalkerRunEnv(CONFIGS["walker-walk"](senses="state"))
    with pytest.raises(ConfigError, match="give either a config or single settings"):
        WalkerRunEnv(CONFIGS["walker-run"](), senses="state")
    with pytest.raises(ConfigError, match=r"ControlVectorEnv plays any task: give it the config of one"):
        ControlVectorEnv(2, senses="state")
    with pytest.raises(ConfigError, match="seed is"):
        WalkerWalkVectorEnv(2, senses="state").reset(seed=[1])
    with pytest.raises(DesignError, match="has no sensors to place"):
        WalkerWalkVectorEnv(1, senses="state").set_designs([0], np.zeros((1, 4, 7)))


def test_no_two_splits_share_episodes_and_configs_know_their_task():
    seeds = [set(split_seeds(split)) for split in ("train", "val", "test")]
    assert not (seeds[0] & seeds[1] or seeds[0] & seeds[2] or seeds[1] & seeds[2]) and min(map(len, seeds)) >= 30
    assert {name: cls().facts.name for name, cls in CONFIGS.items()} == {name: name for name in CONFIGS}
    assert all(issubclass(cls, ControlConfig) for cls in CONFIGS.values())


def test_episode_seeds_depend_on_their_own_seed_alone():
    order = EpisodeSeeds(np.array([4, 5]))
    first = order.draw(np.array([0, 1]))
    second = order.draw(np.array([1]))
    assert list(first) == [episode_seed(4, 0), episode_seed(5, 0)] and second[0] == episode_seed(5, 1)
    drawn = {episode_seed(seed, number) for seed in range(20) for number in range(20)}
    assert len(drawn) == 400 and 0 <= min(drawn) and max(drawn) < 1 << 32
