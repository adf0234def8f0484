"""Prepared scenes: made when needed or ahead, the least recently used first to go."""

import numpy as np
import pytest

from prnav.errors import RenderError
from prnav.render import Renderer
from prnav.render.residents import Residents

DESIGN = np.array([[0.0, 1.2, -0.1, 0.0, 0.0, 0.0, 1.5]])


class Item:
    """Ten bytes of a scene."""

    nbytes = 10

    def __init__(self, mesh):
        self.mesh = mesh
        if mesh == "broken":
            raise RenderError("scene broken: it is broken")


def request(scenes):
    n = len(scenes)
    return np.array(scenes), np.zeros((n, 3)), np.zeros(n), np.broadcast_to(DESIGN, (n, 1, 7))


def test_least_recently_used_goes_first_and_a_request_keeps_what_it_needs():
    gone = []
    store = Residents("abcdef", Item, 30, gone.append)
    for scene in (0, 1, 2, 0, 3):
        store.get([scene])
    assert store.held == (2, 0, 3) and gone == [1] and store.nbytes == 30
    assert {scene: item.mesh for scene, item in store.get([4, 2]).items()} == {4: "e", 2: "c"}
    assert store.held == (3, 4, 2)
    assert set(store.get(range(5))) == set(range(5)) and store.nbytes == 50  # more than the budget, all needed
    store.get([5])
    assert store.held == (3, 4, 5)


def test_preload_fills_the_budget_and_says_how_far_it_is():
    seen = []
    store = Residents([*"abcd"], lambda name: Item(name), 30)
    store._scenes = [type("Mesh", (), {"name": name})() for name in "abcd"]
    store.get([3])
    store.preload(lambda *step: seen.append(step)).join()
    assert store.held == (1, 0, 3)  # what was used is the last to go
    assert seen == [(0, 4, "a"), (1, 4, "b"), (2, 4, "c")]


def test_preload_leaves_a_broken_scene_to_the_request_that_needs_it():
    store = Residents(["a", "broken", "c"], Item, 100)
    store.preload().join()
    assert set(store.held) == {0, 2}
    with pytest.raises(RenderError, match="it is broken"):
        store.get([1])


def test_a_tiny_budget_costs_time_and_changes_nothing(caster, rooms):
    ample, tight = caster(rooms), caster(rooms, memory_gb=1e-9)
    for scenes in ([0], [1, 2, 1], [2], [0, 1, 2], [0]):
        np.testing.assert_array_equal(tight.read(*request(scenes)), ample.read(*request(scenes)))
    assert tight.resident_scenes == (0,)
    assert sorted(ample.resident_scenes) == [0, 1, 2]
    assert ample.resident_bytes > tight.resident_bytes > 0


def test_scenes_are_prepared_ahead(caster, rooms):
    seen = []
    renderer = caster(rooms)
    renderer.preload(lambda *step: seen.append(step)).join()
    assert sorted(renderer.resident_scenes) == [0, 1, 2]
    assert seen == [(0, 3, "room-0"), (1, 3, "room-1"), (2, 3, "room-2"), (3, 3, "")]
    slow = Renderer(rooms, engine="reference")
    slow.preload().join()
    assert slow.resident_scenes == () and slow.resident_bytes == 0
