"""Exposure, noise and quantisation: what they do, and that noise knows its agent and step alone."""

import numpy as np
import pytest
from scipy import stats

from prnav.errors import DesignError
from prnav.sensors import Readout, read_out
from prnav.sensors.camera import Camera, CameraConfig
from prnav.sensors.photoreceptor import PhotoreceptorConfig, Photoreceptors
from prnav.sensors.readout import standard_normal


@pytest.fixture(scope="module")
def light():
    return np.random.default_rng(0).random((5, 2, 16, 3)).astype(np.float32)


def test_an_ideal_sensor_reads_the_light_itself(light):
    assert Readout().is_ideal
    assert read_out(light, Readout()) is light


def test_exposure_scales_and_clips_each_sensor(light):
    readings = read_out(light, Readout(exposure=(0.5, 2.0)))
    np.testing.assert_allclose(readings[:, 0], 0.5 * light[:, 0], rtol=1e-6)
    np.testing.assert_allclose(readings[:, 1], np.minimum(2.0 * light[:, 1], 1.0), rtol=1e-6)


@pytest.mark.parametrize("bits", [1, 3, 8])
def test_quantised_readings_are_the_nearest_levels(light, bits):
    readings = read_out(light, Readout(bits=(bits, 0)))
    levels = np.linspace(0.0, 1.0, 2**bits)
    nearest = levels[np.abs(light[:, 0, ..., None] - levels).argmin(-1)]
    np.testing.assert_allclose(readings[:, 0], nearest, atol=1e-6)
    np.testing.assert_array_equal(readings[:, 1], light[:, 1])


def test_noise_is_normal_and_independent():
    draws = standard_normal(np.arange(40), np.full(40, 7), (2, 16, 3))
    assert stats.kstest(draws.ravel(), "norm").pvalue > 0.01
    flat = draws.reshape(40, -1)
    assert np.abs(np.corrcoef(flat) - np.eye(40)).max() < 0.6  # of 96 draws: 5.5 sigma
    steps = standard_normal(np.zeros(200), np.arange(200), (50,))
    assert abs(np.corrcoef(steps[:-1].ravel(), steps[1:].ravel())[0, 1]) < 0.05
    swapped = standard_normal([3, 4], [4, 3], (50,))
    assert abs(np.corrcoef(swapped)[0, 1]) < 0.6  # seed 3 at step 4 is not seed 4 at step 3


def test_noise_depends_on_seed_and_step_and_not_on_the_batch(light):
    readout = Readout(noise=(0.05, 0.2))
    seeds, steps = np.array([5, 1, 9, 1, 5]), np.array([0, 3, 2, 4, 0])
    whole = read_out(light, readout, seeds, steps)
    np.testing.assert_array_equal(read_out(light, readout, seeds, steps), whole)
    for i in range(5):
        alone = read_out(light[i : i + 1], readout, seeds[i : i + 1], steps[i : i + 1])
        np.testing.assert_array_equal(alone[0], whole[i])
    gray = np.full_like(light, 0.5)
    readings = read_out(gray, readout, seeds, steps)
    np.testing.assert_array_equal(readings[0], readings[4])
    assert (readings[1] != readings[3]).all()
    np.testing.assert_allclose((readings - 0.5).std(axis=(0, 2, 3)), [0.05, 0.2], rtol=0.15)
    assert readings.min() >= 0.0 and readings.max() <= 1.0


def test_bad_settings_are_named(light):
    for options, text in (
        ({"exposure": (-1.0,)}, "exposure is -1.0; it must be a number of at least 0"),
        ({"noise": (float("nan"),)}, "noise is nan; it must be a number of at least 0"),
        ({"bits": (17,)}, "bits is 17; it must be a whole number of at least 0 and at most 16"),
        ({"bits": (2.5,)}, "bits is 2.5; it must be a whole number"),
        ({"noise": ()}, "noise is empty; give one number for all sensors, or one for each"),
    ):
        with pytest.raises(ValueError, match=text):
            Readout(**options)
        with pytest.raises(ValueError, match=text):
            PhotoreceptorConfig(**options)
    with pytest.raises(DesignError, match="noise has 3 values; the design has 2 sensors: give 1 or 2"):
        read_out(light, Readout(noise=(0.1, 0.1, 0.1)))
    with pytest.raises(DesignError, match=r"noise needs seeds and steps of shape \(5,\), one of each agent"):
        read_out(light, Readout(noise=(0.1,)), seeds=np.arange(5))
    with pytest.raises(DesignError, match="seeds of noise are float64; they must be 64-bit whole numbers"):
        read_out(light, Readout(noise=(0.1,)), seeds=[1, 2**63, 3, 4, 5], steps=np.arange(5))


def test_sensors_apply_their_settings(shards):
    poses = (np.zeros(3, int), np.zeros((3, 3)), np.array([0.0, 1.0, 2.0]))
    settings = {"exposure": (0.5,), "noise": (0.1,), "bits": (4,)}
    eye = Photoreceptors(PhotoreceptorConfig("forward", **settings), [shards])
    ideal = Photoreceptors(PhotoreceptorConfig("forward"), [shards]).read(*poses)
    who = {"seeds": np.arange(3), "steps": np.arange(3)}
    np.testing.assert_array_equal(eye.read(*poses, **who), read_out(ideal, eye.config.readout, **who))
    camera = Camera(CameraConfig(size=16, bits=1), [shards])
    assert set(np.unique(camera.read(*poses))) <= {0.0, 1.0}
    with pytest.raises(DesignError, match="bits has 7 values"):
        Photoreceptors(PhotoreceptorConfig("forward", bits=(1,) * 7), [shards])


def test_acceptance_is_the_renderers(shards):
    poses = (np.zeros(3, int), np.zeros((3, 3)), np.array([0.0, 1.0, 2.0]))
    eyes = [Photoreceptors(PhotoreceptorConfig(acceptance=name), [shards]) for name in ("uniform", "gaussian")]
    one, other = (eye.read(*poses) for eye in eyes)
    assert 0.0 < np.abs(one - other).max() < 0.3
