import numpy as np
import pytest

from prnav.errors import DesignError
from prnav.render import Renderer
from prnav.sensors import load_design, random_design
from prnav.sensors.camera import Camera, CameraConfig
from prnav.sensors.photoreceptor import PhotoreceptorConfig, Photoreceptors

POSES = (np.zeros(3, int), np.array([[0, 0, 0], [0.2, 0, 0], [0, 0, 0.3]]), np.array([0.0, 1.0, 2.0]))


def test_photoreceptors_read_their_design(shards):
    eye = Photoreceptors(PhotoreceptorConfig("fan", rays_per_receptor=4), [shards])
    readings = eye.read(*POSES)
    assert readings.shape == (3, *eye.shape) == (3, 4, 16, 3)
    assert readings.dtype == np.float32 and 0.0 <= readings.min() < readings.max() <= 1.0
    designs = np.broadcast_to(load_design("fan").sensors, (3, 4, 7))
    grids = Renderer([shards], rays_per_receptor=4).read(*POSES, designs, grid=4)
    np.testing.assert_array_equal(readings, grids.reshape(3, 4, 16, 3))


def test_each_agent_may_have_its_own_design(shards):
    eye = Photoreceptors(PhotoreceptorConfig("forward", grid=8, rays_per_receptor=1), [shards])
    designs = np.stack([random_design(seed, 2).sensors for seed in range(3)])
    readings = eye.read(*POSES, designs)
    assert readings.shape == (3, 2, 64, 3)
    for i in range(3):
        alone = eye.read(*(a[i : i + 1] for a in POSES), designs[i : i + 1])
        np.testing.assert_array_equal(alone[0], readings[i])


def test_camera_takes_pictures(shards):
    camera = Camera(CameraConfig(size=32), [shards])
    pictures, depths = camera.read(*POSES), camera.depth(*POSES)
    assert pictures.shape == (3, *camera.shape) == (3, 32, 32, 3)
    assert depths.shape == (3, 32, 32)
    np.testing.assert_array_equal(np.isinf(depths), (pictures == 0).all(-1))


def test_configs_are_checked(shards):
    with pytest.raises(DesignError, match="design fan has 4 sensors; 1 are needed"):
        Camera(CameraConfig("fan"), [shards])
    with pytest.raises(ValueError, match="grid is 0; it must be at least 1"):
        PhotoreceptorConfig(grid=0)
    with pytest.raises(ValueError, match="size is 0; it must be at least 1"):
        CameraConfig(size=0)


def test_readings_may_stay_on_the_device(shards):
    eye = Photoreceptors(PhotoreceptorConfig("fan", rays_per_receptor=4), [shards])
    np.testing.assert_array_equal(np.from_dlpack(eye.read_on_device(*POSES)), eye.read(*POSES))
    coarse = Photoreceptors(PhotoreceptorConfig("fan", bits=(4,)), [shards])
    with pytest.raises(DesignError, match="exposure, noise and bits are applied on the host"):
        coarse.read_on_device(*POSES)
