"""One renderer, asked by four threads at once, gives each what it gives one."""

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

THREADS = 4


def hammer(question, cases, rounds):
    want = [question(*case) for case in cases]
    gate = threading.Barrier(THREADS)

    def ask(first):
        gate.wait()
        order = [(k + first) % len(cases) for k in range(len(cases))] * rounds
        return [i for i in order if not np.array_equal(question(*cases[i]), want[i])]

    with ThreadPoolExecutor(THREADS) as pool:
        return sorted({i for part in list(pool.map(ask, range(THREADS))) for i in part})


def requests(batch, count):
    """Requests of other sizes, scenes and agents each, cut from one batch."""
    scenes, positions, yaws, designs = batch
    rng = np.random.default_rng(0)
    rows = [rng.integers(0, len(scenes), rng.integers(1, 7)) for _ in range(count)]
    return [(scenes[r], positions[r], yaws[r] + 0.1 * i, designs[r]) for i, r in enumerate(rows)]


@pytest.mark.parametrize("method", ["read", "image", "depth"])
def test_a_renderer_answers_four_threads_as_one(caster, rooms, batch, method):
    renderer = caster(rooms, rays_per_receptor=4)
    size = {"read": {"grid": 4}, "image": {"size": 9}, "depth": {"size": 9}}[method]
    assert hammer(lambda *case: getattr(renderer, method)(*case, **size), requests(batch, 40), 3) == []


def test_scenes_that_come_and_go_meanwhile_change_nothing(caster, rooms, batch):
    """A budget of one scene: every request may evict what another one is about to use."""
    renderer = caster(rooms, rays_per_receptor=4, memory_gb=1e-6)
    assert hammer(lambda *case: renderer.read(*case), requests(batch, 20), 2) == []


@pytest.mark.slow
@pytest.mark.parametrize("method", ["read", "image", "depth"])
def test_ten_thousand_requests_from_four_threads(caster, rooms, batch, method):
    renderer = caster(rooms, rays_per_receptor=4)
    size = {"read": {"grid": 2}, "image": {"size": 4}, "depth": {"size": 4}}[method]
    assert hammer(lambda *case: getattr(renderer, method)(*case, **size), requests(batch, 100), 25) == []
