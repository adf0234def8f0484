"""``render_mode="rgb_array"``: the way on the map beside what the agent sees."""

import dataclasses
import sys
import types

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo

from prnav.domains.navigation.pictures.frame import HEIGHT, PLAN, WIDTH
from prnav.domains.navigation.pictures.live import what_is_seen
from prnav.domains.navigation.pointgoal import PointGoalConfig, PointGoalNavEnv, PointGoalNavVectorEnv
from prnav.errors import ConfigError


def make(config, source, **changes):
    return PointGoalNavEnv(dataclasses.replace(config, **changes), source, render_mode="rgb_array")


def changed(one, two):
    """Which pixels differ, (H, W)."""
    return (one != two).any(axis=-1)


def test_a_frame_shows_the_way_and_what_is_seen(config, source):
    env = make(config, source)
    observation, _ = env.reset(seed=0)
    first = env.render()
    assert first.shape == (HEIGHT, WIDTH, 3) and first.dtype == np.uint8
    np.testing.assert_array_equal(first, env.render())
    patches = np.rint(255 * observation["photoreceptors"]).astype(np.uint8).reshape(2, 4, 4, 3)
    for patch in patches.reshape(-1, 3):  # every patch's colour is there, as a square
        assert (first[110:430, PLAN + 16 :] == patch).all(axis=-1).sum() >= 1000
    while env.slots.path_length[0] < 1.0:
        env.step(env.expert_action())
    later = env.render()
    assert changed(first, later)[:, :PLAN].any() and changed(first, later)[:, PLAN:].any()
    trail = changed(later, make_fresh(env))[:, :PLAN]  # the same pose without the way to it
    assert trail.sum() > 30


def make_fresh(env):
    """A frame of the same state, drawn as if the episode began here."""
    env._screen.begin(np.array([0]))
    return env.render()


def test_a_camera_is_shown_as_it_sees(config, source):
    env = make(config, source, camera_size=32, design="habitat-camera")
    picture = env.reset(seed=0)[0]["camera"][0]
    cell = 13  # 13 times 33 pixels fit between the words above and below
    shown = env.render()[110 : 110 + 32 * cell, PLAN + 16 : PLAN + 16 + 32 * cell]
    np.testing.assert_array_equal(shown, picture.repeat(cell, axis=0).repeat(cell, axis=1))


def test_a_picture_larger_than_its_room_is_made_smaller(config, source):
    env = make(config, source, camera_size=600, design="habitat-camera")
    env.reset(seed=0)
    assert env.render().shape == (HEIGHT, WIDTH, 3)


def test_a_blind_agent_is_shown_on_its_map(config, source):
    env = make(config, source, vision=False)
    observation, _ = env.reset(seed=0)
    assert what_is_seen(observation, env.slots.observation_specs) is None
    assert (env.render()[:, :PLAN] != 255).any()


def test_a_batch_shows_what_single_environments_do(config, source):
    short = dataclasses.replace(config, rules=PointGoalConfig(max_steps=5))
    batch = PointGoalNavVectorEnv(2, short, source, render_mode="rgb_array")
    single = PointGoalNavEnv(short, source, render_mode="rgb_array")
    batch.reset(seed=3)
    single.reset(seed=4)
    for _ in range(7):
        frames = batch.render()
        assert isinstance(frames, tuple) and len(frames) == 2
        np.testing.assert_array_equal(frames[1], single.render())
        batch.step([1, 1])
        if any(single.step(1)[2:4]):
            single.reset()


def test_nothing_is_drawn_unless_asked_for(config, source):
    for env in (PointGoalNavEnv(config, source), PointGoalNavVectorEnv(2, config, source)):
        env.reset(seed=0)
        assert env.render_mode is None and env.render() is None


def test_unknown_modes_and_early_calls_are_refused(config, source):
    for made in (PointGoalNavEnv, lambda *a, **k: PointGoalNavVectorEnv(2, *a, **k)):
        with pytest.raises(ConfigError, match="render_mode is 'human'; valid: 'rgb_array', or None"):
            made(config, source, render_mode="human")
    with pytest.raises(ConfigError, match=r"there is nothing to render before the first reset\(\); call it first"):
        make(config, source).render()


def test_gymnasium_records_an_episode(monkeypatch, tmp_path, config, source):
    """Up to the encoder: the frames that RecordVideo would hand to MoviePy."""
    if "moviepy" not in sys.modules:
        monkeypatch.setitem(sys.modules, "moviepy", types.ModuleType("moviepy"))
    short = dataclasses.replace(config, rules=PointGoalConfig(max_steps=4))
    made = gymnasium.make("prnav/PointGoalNav-v0", config=short, source=source, render_mode="rgb_array")
    env = RecordVideo(made, str(tmp_path / "videos"), episode_trigger=lambda episode: True)
    assert env.frames_per_sec == 8
    env.reset(seed=0)
    for _ in range(3):
        env.step(1)
    frames = list(env.recorded_frames)
    assert len(frames) == 4 and all(frame.shape == (HEIGHT, WIDTH, 3) for frame in frames)
    assert changed(frames[0], frames[-1]).any()
    env.recorded_frames, env.recording = [], False  # nothing is left to encode


def test_gymnasium_makes_batches_that_render(config, source):
    envs = gymnasium.make_vec(
        "prnav/PointGoalNav-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        config=config,
        source=source,
        render_mode="rgb_array",
    )
    envs.reset(seed=0)
    assert [frame.shape for frame in envs.render()] == [(HEIGHT, WIDTH, 3)] * 2
