"""MuJoCo's rasteriser behind the caster's interface, and the caster held to it."""

from __future__ import annotations

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

from prnav.domains.control.caster import Caster, WorldPoses  # noqa: E402
from prnav.domains.control.models import reacher_hard, walker  # noqa: E402
from prnav.domains.control.raster import Rasteriser  # noqa: E402
from prnav.errors import RenderError  # noqa: E402


@pytest.fixture(params=[reacher_hard, walker])
def scene(request):
    model = request.param()
    data = mujoco.MjData(model)
    data.qpos[:] += 0.3
    mujoco.mj_forward(model, data)
    try:
        return model, WorldPoses.of(data), Rasteriser(model, pixels=128)
    except RenderError as error:
        pytest.skip(f"{error}")


@pytest.mark.gl
def test_the_caster_agrees_with_the_rasteriser(scene):
    model, poses, rasteriser = scene
    high = 0.4 * model.stat.extent + float(poses.geom_xpos[0, :, 2].max())
    rng = np.random.default_rng(0)
    places = np.array([0.0, 0.0, high]) + 0.1 * model.stat.extent * rng.normal(size=(1, 6, 3))
    axes = np.linalg.qr(np.eye(3) + 0.4 * rng.normal(size=(1, 6, 3, 3)))[0]
    axes *= np.sign(np.einsum("...ii->...i", axes))[..., None, :]
    axes[..., 0] *= np.linalg.det(axes)[..., None]
    truth = rasteriser.read(poses, places, axes, 1.2)
    read = Caster(model, rays_per_receptor=256).read(poses, places, axes, 1.2)
    assert np.abs(read - truth).mean() < 1.0 / 255.0
    rasteriser.close()


@pytest.mark.gl
def test_a_picture_that_cannot_be_cut_is_named(scene):
    _, poses, rasteriser = scene
    with pytest.raises(RenderError, match="a picture of 128 pixels a side cannot be cut into 3 x 3 receptors"):
        rasteriser.read(poses, np.zeros((1, 1, 3)), np.eye(3)[None, None], 1.0, grid=3)
