import numpy as np
import pytest

from prnav.domains.navigation.env.order import EpisodeOrder, shuffled
from prnav.errors import ConfigError


@pytest.mark.parametrize("count", [1, 2, 3, 7, 64, 100, 1008])
def test_each_round_plays_every_episode_once(count):
    for epoch in range(3):
        assert sorted(shuffled(place, count, 5, epoch) for place in range(count)) == list(range(count))


def test_rounds_seeds_and_places_differ_as_chance_would_have_it():
    count = 500
    first, again, other = (
        np.array([shuffled(place, count, seed, epoch) for place in range(count)])
        for seed, epoch in ((0, 0), (0, 1), (1, 0))
    )
    for a, b in ((first, again), (first, other), (again, other), (first, np.arange(count))):
        assert np.sum(a == b) < 8
        assert abs(np.corrcoef(a, b)[0, 1]) < 0.15
    steps = np.diff(first)
    assert abs(np.mean(steps > 0) - 0.5) < 0.07


def test_a_slots_order_depends_on_its_seed_alone():
    many, one = EpisodeOrder(30, np.array([4, 9, 2])), EpisodeOrder(30, np.array([9]))
    alone = [int(one.draw(np.array([0]))[0]) for _ in range(70)]
    for t in range(70):
        assert many.draw(np.array([0, 1] if t % 2 else [2, 1]))[1] == alone[t]


def test_millions_of_episodes_need_no_memory():
    order = EpisodeOrder(4_880_000, np.arange(64))
    drawn = np.concatenate([order.draw(np.arange(64)) for _ in range(20)])
    assert len(np.unique(drawn)) > 1270 and drawn.max() > 4_000_000


def test_a_negative_seed_is_refused():
    with pytest.raises(ConfigError, match="seed is -1; it must be 0 or above"):
        EpisodeOrder(3, np.array([-1]))
