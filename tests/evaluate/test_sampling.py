import numpy as np

from prnav.play.noise import episode_key, uniforms, uniforms_of_width


def test_uniforms_are_uniform_and_uncorrelated_between_steps_and_episodes():
    keys = np.array([episode_key(0, "scene", str(i)) for i in range(400)], dtype=np.uint64)
    draws = np.stack([uniforms(keys, np.full(400, step)) for step in range(50)])
    assert (draws >= 0).all() and (draws < 1).all()
    histogram = np.bincount((draws.ravel() * 10).astype(int), minlength=10)
    assert np.abs(histogram / draws.size - 0.1).max() < 0.01
    assert abs(np.corrcoef(draws[:-1].ravel(), draws[1:].ravel())[0, 1]) < 0.03
    assert abs(np.corrcoef(draws[:, :-1].ravel(), draws[:, 1:].ravel())[0, 1]) < 0.03


def test_a_draw_belongs_to_its_episode_and_step_alone():
    keys = np.array([episode_key(7, "a", "1"), episode_key(7, "a", "2"), episode_key(7, "b", "1")], dtype=np.uint64)
    assert len(set(keys.tolist())) == 3
    together = uniforms(keys, np.array([4, 9, 2]))
    alone = np.concatenate([uniforms(keys[i : i + 1], np.array([step])) for i, step in enumerate([4, 9, 2])])
    np.testing.assert_array_equal(together, alone)


def test_known_value_is_the_same_on_every_machine():
    key = np.array([episode_key(0, "prhouses/test/00", "0")], dtype=np.uint64)
    assert uniforms(key, np.array([0]))[0] == 0.7428277803319073


def test_several_numbers_for_a_step_are_all_different():
    keys = np.array([episode_key(7, "a", "1"), episode_key(7, "a", "2")], dtype=np.uint64)
    steps = np.array([4, 9])
    np.testing.assert_array_equal(uniforms_of_width(keys, steps, 1)[:, 0], uniforms(keys, steps))
    drawn = np.concatenate([uniforms_of_width(keys, np.full(2, step), 3).ravel() for step in range(100)])
    assert len(np.unique(drawn)) == 600
