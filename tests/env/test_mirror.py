import dataclasses

import numpy as np
import pytest

from prnav.env import PointGoalSlots
from prnav.env.mirror import mirrored_actions, mirrored_observations, mirrored_poses
from prnav.render import Renderer
from prnav.sensors import load_design

EVERYONE = np.ones(3, np.bool_)


@pytest.mark.parametrize("design", ["forward", "ring"])
def test_readings_are_those_of_the_mirrored_mesh(source, design):
    scene = source.world.scenes[0]
    behind = dataclasses.replace(scene, vertices=scene.vertices * np.float32([-1, 1, 1]), faces=scene.faces[:, ::-1])
    positions, yaws = source.starts[source.scene_index == 0][:3], np.array([0.3, -2.0, 3.0])
    poses = np.tile(load_design(design).sensors, (3, 1, 1))
    scenes = np.zeros(3, np.int64)
    want = Renderer([behind]).read(scenes, positions * [-1, 1, 1], -yaws, poses)
    seen = Renderer([scene]).read(scenes, positions, yaws, mirrored_poses(poses, EVERYONE))
    seen = seen.reshape(3, poses.shape[1], 16, 3)
    got = mirrored_observations({"compass": np.zeros((3, 1), np.float32), "photoreceptors": seen}, EVERYONE)
    np.testing.assert_allclose(got["photoreceptors"], want.reshape(seen.shape), atol=2e-3)


def test_a_twin_behind_the_mirror_lives_the_same_episode_turned_over(config, source, random_actions):
    twins = PointGoalSlots(source, 2, dataclasses.replace(config, mirror=True))
    plain = PointGoalSlots(source, 2, config)
    for slots in (twins, plain):
        slots.begin([0, 1], [5, 5])
    who = np.array([False, True])
    for action in random_actions(30):
        observed, world = twins.observe(), plain.observe()
        for name in ("gps", "compass", "pointgoal", "design"):
            np.testing.assert_array_equal(observed[name], mirrored_observations(world, who)[name])
        np.testing.assert_array_equal(observed["photoreceptors"][0], world["photoreceptors"][0])
        assert (observed["photoreceptors"][1] != world["photoreceptors"][1]).any()
        np.testing.assert_array_equal(twins.expert_actions(), mirrored_actions(plain.expert_actions(), who))
        twins.advance(mirrored_actions(np.full(2, action), who))
        plain.advance(np.full(2, action))
        np.testing.assert_array_equal(twins.positions, plain.positions)
        np.testing.assert_array_equal(twins.yaws, plain.yaws)


def test_mirroring_twice_is_nothing():
    poses = np.arange(42.0).reshape(3, 2, 7)
    np.testing.assert_array_equal(mirrored_poses(mirrored_poses(poses, EVERYONE), EVERYONE), poses)
    actions = np.array([0, 2, 3])
    assert mirrored_actions(actions, EVERYONE).tolist() == [0, 3, 2]
