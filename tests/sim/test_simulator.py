import numpy as np
import pytest

from prnav.sim import FORWARD, HOLD, LEFT, RIGHT, STOP, SimConfig, Simulator, load_world


@pytest.fixture(scope="module")
def world():
    return load_world(["prhouses/val/00", "prhouses/val/01"])


def test_turns_walk_and_hold(world):
    simulator = Simulator(world, 4)
    start = world.navmeshes[0].random_points(64, 0)
    middle = start[np.argmax(world.navmeshes[0].clearance(start))]  # nothing within reach of a step
    simulator.reset(np.arange(4), np.zeros(4), np.tile(middle, (4, 1)), np.zeros(4))
    moved = simulator.step([FORWARD, LEFT, RIGHT, STOP])
    np.testing.assert_allclose(moved, [0.25, 0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(simulator.positions[0] - middle, [0, 0, -0.25], atol=1e-9)
    np.testing.assert_allclose(simulator.yaws, [0, np.pi / 6, -np.pi / 6, 0])
    before = simulator.snapshot()
    simulator.step([HOLD] * 4)
    for name, value in simulator.snapshot().items():
        np.testing.assert_array_equal(value, before[name])


def test_twelve_turns_come_full_circle(world):
    simulator = Simulator(world, 1)
    simulator.reset([0], [0], np.zeros((1, 3)), [0.7])
    begin = simulator.yaws[0]
    for _ in range(12):
        simulator.step([LEFT])
    assert simulator.yaws[0] == begin
    simulator.step([RIGHT])
    assert simulator.yaws[0] == pytest.approx(begin - np.pi / 6)
    simulator.step([LEFT])
    assert simulator.yaws[0] == begin


def test_rows_do_not_depend_on_the_batch(world):
    generator = np.random.Generator(np.random.PCG64(0))
    scenes = np.arange(32) % 2
    starts = np.stack([world.navmeshes[s].random_points(32, 7)[i] for i, s in enumerate(scenes)])
    actions = generator.integers(1, 4, (40, 32))
    batch = Simulator(world, 32)
    batch.reset(np.arange(32), scenes, starts, np.zeros(32))
    for row in actions:
        batch.step(row)
    for i in (0, 13, 31):
        alone = Simulator(world, 1)
        alone.reset([0], [scenes[i]], starts[i : i + 1], [0.0])
        for row in actions:
            alone.step(row[i : i + 1])
        np.testing.assert_array_equal(alone.positions[0], batch.positions[i])
        assert alone.yaws[0] == batch.yaws[i]


@pytest.mark.parametrize("values", [{"forward_step": 0.0}, {"turn_angle_deg": 0.0}, {"turn_angle_deg": 181.0}])
def test_impossible_bodies_are_refused(values):
    with pytest.raises(ValueError, match="it must be above 0"):
        SimConfig(**values)
