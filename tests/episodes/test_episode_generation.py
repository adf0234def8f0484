import numpy as np
import pytest

from prnav.episodes import GenerationConfig, generate_episodes, generate_table
from prnav.episodes.generate import keep_probability
from prnav.errors import EpisodeError


@pytest.fixture(scope="module")
def table(corner):
    return generate_table(corner, "corner", 300, seed=1)


def test_habitats_rules_hold(corner, table):
    starts, goals = table.start_position, table.goal_position
    distances = corner.distances(starts, goals)
    np.testing.assert_allclose(distances, table.geodesic_distance, rtol=1e-9)
    assert ((distances >= 1.0) & (distances <= 30.0)).all()
    assert (np.abs(starts[:, 1] - goals[:, 1]) <= 0.5).all()
    islands = corner.island_of(np.concatenate([starts, goals]))
    assert (islands == islands[0]).all() and corner.islands[islands[0]].radius >= 1.5
    assert corner.is_navigable(np.concatenate([starts, goals])).all()
    np.testing.assert_allclose(np.linalg.norm(table.start_rotation, axis=1), 1.0)
    counts, _ = np.histogram(np.mod(table.start_yaw, 2 * np.pi), bins=4, range=(0, 2 * np.pi))
    assert (counts > 45).all()


def test_near_straight_pairs_are_thinned_out_as_habitat_does(corner, table):
    ratio = table.geodesic_distance / np.linalg.norm(table.goal_position - table.start_position, axis=1)
    points = corner.random_points(4000, 3)
    a, b = points[:2000], points[2000:]
    distances = corner.distances(a, b)
    euclid = np.linalg.norm(a - b, axis=1)
    fine = np.isfinite(distances) & (distances >= 1.0)
    drawn = distances[fine] / euclid[fine]
    kept = keep_probability(drawn, GenerationConfig())
    expected = np.sum(kept * (drawn < 1.1)) / np.sum(kept)
    assert abs(np.mean(ratio < 1.1) - expected) < 0.06
    assert expected < 0.25 < np.mean(drawn < 1.1)


def test_an_episode_depends_on_seed_scene_and_its_number_alone(corner, table):
    few = generate_table(corner, "corner", 70, seed=1)
    for name, values in few.to_arrays().items():
        np.testing.assert_array_equal(values, table.to_arrays()[name][:70])
    for scene_id, seed in (("corner", 2), ("other", 1)):
        assert not np.allclose(generate_table(corner, scene_id, 70, seed).start_position, few.start_position)


def test_episodes_carry_what_habitat_writes(corner):
    episode = generate_episodes(corner, "corner", 3, seed=4)[2]
    assert (episode.episode_id, episode.scene_id) == ("2", "corner")
    assert episode.info["geodesic_distance"] == pytest.approx(
        corner.distance(episode.start_position, episode.goals[0].position)
    )
    assert episode.info["difficulty"] in ("easy", "medium", "hard")


def test_limits_can_be_set(corner):
    config = GenerationConfig(closest_dist_limit=5.0, furthest_dist_limit=6.0)
    distances = generate_table(corner, "corner", 20, 0, config).geodesic_distance
    assert distances.min() >= 5.0 and distances.max() <= 6.0


def test_scenes_that_cannot_give_episodes_say_why(corner, tiny):
    with pytest.raises(EpisodeError, match=r"scene tiny: its largest island has radius 1\.\d+ m, episodes need 1.5 m"):
        generate_table(tiny, "tiny", 5, 0)
    config = GenerationConfig(closest_dist_limit=40.0, furthest_dist_limit=50.0, max_targets=3)
    with pytest.raises(
        EpisodeError, match="scene corner: no start and goal for episode 0 among 3 goals with 10 starts"
    ):
        generate_table(corner, "corner", 5, 0, config)
    with pytest.raises(EpisodeError, match="asked for 0 episodes with seed 0"):
        generate_table(corner, "corner", 0, 0)
    with pytest.raises(ValueError, match="closest < furthest"):
        GenerationConfig(closest_dist_limit=4.0, furthest_dist_limit=3.0)
