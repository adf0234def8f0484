"""Sensors as an interface: what is listed is what agents are shown, and a new one is a class and a line."""

import dataclasses

import numpy as np
import pytest

from prnav.catalog import task_spec
from prnav.cli import train
from prnav.contracts import ObservationSpec
from prnav.domains.navigation.env import NavigationSlots
from prnav.domains.navigation.pointgoal import PointGoalNavVectorEnv
from prnav.domains.navigation.sensors import SENSORS, make_sensors, sensor_type
from prnav.domains.navigation.sensors.sensor import box
from prnav.domains.navigation.targetnav import TargetNavEnvConfig
from prnav.errors import ConfigError
from prnav.sensors import load_design
from prnav.train import RunFolder, load_policy

TINY = (
    "env.max_scenes=1",
    "env.episodes_per_scene=6",
    "env.rays_per_receptor=1",
    "num_envs=4",
    "total_steps=128",
    "threads=1",
    "groups=1",
    "policy.width=16",
    "policy.lstm_hidden=16",
    "policy.feedforward=32",
    "imitation.steps=64",
    "imitation.mini_batches=1",
    "ppo.rollout_steps=16",
    "ppo.mini_batches=1",
)


class Clock:
    """A sensor from elsewhere: how long the episode has lasted, in hundreds of steps."""

    name = "clock"
    spec = ObservationSpec((1,), "vector", low=0.0)

    def __init__(self, config, design):
        """Nothing to set."""

    @property
    def space(self):
        """(1,)."""
        return box(self.spec)

    def read(self, now):
        """(n, 1)."""
        return (now.steps[:, None] / 100.0).astype(np.float32)


@pytest.fixture
def clock(monkeypatch):
    monkeypatch.setitem(SENSORS, "clock", f"{__name__}:Clock")


def train_tiny(folder, *settings):
    assert train.main(["pointgoal", "--run", str(folder), *TINY, *settings]) == 0
    policy = load_policy(RunFolder(folder))[0]
    assert all(bool(values.isfinite().all()) for values in policy.state_dict().values())
    return policy


def test_a_new_sensor_trains_through_the_command(clock, tmp_path):
    policy = train_tiny(tmp_path / "run", "env.sensors=['photoreceptors', 'pointgoal', 'clock']")
    assert set(policy.observation_specs) == {"photoreceptors", "design", "pointgoal", "clock"}
    assert policy.observation_specs["clock"].shape == (1,)


@pytest.mark.parametrize("encoder", ["compact", "transformer"])
def test_an_agent_trains_without_gps_and_compass(encoder, tmp_path):
    policy = train_tiny(tmp_path / "run", "env.sensors=['photoreceptors']", f"policy.encoder={encoder}")
    assert set(policy.observation_specs) == {"photoreceptors", "design"}


def test_a_new_sensor_is_read_at_each_step(clock, config, source):
    envs = PointGoalNavVectorEnv(3, dataclasses.replace(config, sensors=("clock", "gps"), vision=False), source)
    shown = [envs.reset(seed=0)[0]] + [envs.step([2, 2, 2])[0] for _ in range(3)]
    assert all(observations in envs.observation_space for observations in shown)
    np.testing.assert_allclose([one["clock"][:, 0] for one in shown], np.arange(4)[:, None] * np.full(3, 0.01))


def test_the_default_is_all_that_the_task_has(config):
    design = load_design("forward")

    def names(**changes):
        changed = dataclasses.replace(config, **changes)
        return list(make_sensors(changed.sensor_names, changed, design))

    assert names() == ["compass", "design", "gps", "pointgoal", "photoreceptors"]
    assert names(camera_size=8) == ["compass", "design", "gps", "pointgoal", "camera"]
    assert names(vision=False) == ["compass", "design", "gps", "pointgoal"]
    assert names(sensors=("photoreceptors", "pointgoal"), vision=False) == ["pointgoal"]
    target = TargetNavEnvConfig()
    assert list(make_sensors(target.sensor_names, target, design)) == ["compass", "design", "gps", "photoreceptors"]


def test_an_observation_is_the_same_whatever_else_is_listed(config, source):
    def observed(**changes):
        slots = NavigationSlots(source, 4, dataclasses.replace(config, **changes))
        slots.begin(np.arange(4), np.arange(4))
        return slots.observe()

    everything, few = observed(), observed(sensors=("gps", "photoreceptors"))
    assert list(few) == ["gps", "photoreceptors", "design"]
    for name, values in few.items():
        np.testing.assert_array_equal(values, everything[name])


def test_camera_and_photoreceptors_may_stand_side_by_side(config, source):
    both = dataclasses.replace(config, sensors=("camera", "photoreceptors"), camera_size=8)
    observations = PointGoalNavVectorEnv(2, both, source).reset(seed=0)[0]
    assert observations["camera"].shape == (2, 2, 8, 8, 3) and observations["photoreceptors"].shape == (2, 2, 16, 3)


def test_every_registered_sensor_keeps_its_spec(config, source):
    changed = dataclasses.replace(config, sensors=tuple(SENSORS), camera_size=8)
    slots = NavigationSlots(source, 3, changed)
    slots.begin(np.arange(3), np.arange(3))
    specs = slots.observation_specs
    for name, values in slots.observe().items():
        assert slots.sensors[name].name == name
        assert values.shape == (3, *specs[name].shape) and values.dtype == specs[name].dtype
        assert all(slots.sensors[name].space.contains(row) for row in values)


def test_a_blind_variant_has_no_light(config, source):
    blind = task_spec("pointgoal").blind(dataclasses.replace(config, sensors=("photoreceptors", "gps")))
    slots = NavigationSlots(source, 2, blind)
    assert slots.light is None and list(slots.sensors) == ["gps"]


def test_an_unknown_sensor_is_refused_by_name():
    with pytest.raises(ConfigError, match="sensor 'sonar' is not known; valid: 'compass', 'design', 'gps'"):
        sensor_type("sonar")
