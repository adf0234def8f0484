"""Readings, pictures and depths against Habitat's own pictures of a real house."""

import numpy as np
import pytest

from prnav.render import Renderer


@pytest.fixture(scope="module")
def engines(small_house):
    """Renderers by (rays per receptor, pattern)."""
    return {
        (rays, pattern): Renderer([small_house], rays_per_receptor=rays, pattern=pattern)
        for rays, pattern in ((16, "grid"), (256, "grid"), (16, "lattice"), (256, "lattice"))
    }


def requests(views, fov):
    count = len(views["yaw"])
    designs = np.zeros((count, 1, 7))
    designs[..., :3] = views["sensor_offset"]
    designs[..., 6] = np.radians(fov)
    return np.zeros(count, int), views["position"], views["yaw"], designs


def patches(picture, grid):
    count, size = picture.shape[:2]
    return picture.reshape(count, grid, size // grid, grid, size // grid, 3).mean((2, 4))


@pytest.mark.parametrize("fov", [60, 90, 120])
def test_pictures_and_depths_are_habitats(engines, golden_views, fov):
    renderer = engines[256, "grid"]
    rgb, depth = golden_views[f"rgb_{fov}"].astype(float), golden_views[f"depth_{fov}"].astype(float)
    picture = renderer.image(*requests(golden_views, fov), size=256)[:, 0] * 255
    # Habitat blends texels where these pictures take the nearest: 4 x 4 pixels average that out
    assert np.abs(patches(picture, 64) - patches(rgb, 64)).mean() < 1.0
    assert np.abs(patches(picture, 4) - patches(rgb, 4)).mean() < 0.4
    ours = renderer.depth(*requests(golden_views, fov), size=256)[:, 0]
    assert (np.isinf(ours) == (depth == 0.0)).mean() > 0.9999  # Habitat writes 0 on a miss
    seen = np.isfinite(ours) & (depth > 0.0)
    error = np.abs(ours - depth)[seen] / depth[seen]  # stored in half precision: 1 part in 2,048
    assert np.percentile(error, 99) < 1e-3


@pytest.mark.parametrize("fov", [60, 90, 120])
@pytest.mark.parametrize("grid", [4, 8])
def test_readings_are_habitats_as_far_as_their_rays_can_tell(engines, golden_views, fov, grid):
    """The house is ceilingless, white against black: nearly all of the error is coverage at edges.

    Reading only the very pixels of Habitat's picture that the rays meet errs as much (the last assertion).
    """
    rgb = golden_views[f"rgb_{fov}"].astype(float)
    truth = patches(rgb, grid)
    error = {
        key: np.abs(renderer.read(*requests(golden_views, fov), grid=grid)[:, 0] * 255 - truth)
        for key, renderer in engines.items()
    }
    assert error[256, "grid"].mean() < 1.6
    assert error[256, "lattice"].mean() < 0.8
    assert np.percentile(error[256, "lattice"], 99) < 5.5
    assert error[16, "lattice"].mean() < 5.0
    assert error[16, "lattice"].mean() < 1.05 * error[16, "grid"].mean()
    step = 256 // (4 * grid)
    pixels = rgb[:, step // 2 :: step, step // 2 :: step]
    assert error[16, "grid"].mean() < 1.1 * np.abs(patches(pixels, grid) - truth).mean()


@pytest.mark.parametrize("fov", [60, 90, 120])
@pytest.mark.parametrize(("grid", "rays"), [(4, 4096), (8, 1024)])
def test_rays_through_the_very_pixels_leave_nothing_but_filtering(small_house, golden_views, fov, grid, rays):
    readings = Renderer([small_house], rays_per_receptor=rays).read(*requests(golden_views, fov), grid=grid)[:, 0]
    error = np.abs(readings * 255 - patches(golden_views[f"rgb_{fov}"].astype(float), grid))
    assert error.mean() < 0.35
    assert np.percentile(error, 99) < 2.2
