"""Pyramids of textures."""

from __future__ import annotations

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

from prnav.domains.control.textures import build_textures, halved  # noqa: E402

XML = """
<mujoco><asset>
  <texture name="sky" type="skybox" builtin="gradient" rgb1="0.4 0.6 0.8" rgb2="0 0 0" width="16" height="16"/>
  <texture name="floor" type="2d" builtin="checker" rgb1="0 0 0" rgb2="1 1 1" width="30" height="30"/>
</asset></mujoco>
"""


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (7, 5), (8, 8), (1, 9)])
def test_halving_keeps_the_mean(size):
    pictures = np.random.default_rng(0).random((2, *size, 3))
    half = halved(pictures)
    assert half.shape == (2, max(size[0] // 2, 1), max(size[1] // 2, 1), 3)
    np.testing.assert_allclose(half.mean(axis=(1, 2)), pictures.mean(axis=(1, 2)), atol=1e-12)


def test_levels_go_from_the_models_bytes_to_their_mean():
    model = mujoco.MjModel.from_xml_string(XML)
    textures = build_textures(model)
    for texture in range(model.ntex):
        faces = 6 if model.tex_type[texture] == mujoco.mjtTexture.mjTEXTURE_SKYBOX else 1
        start, width, height = textures.table[texture, 0]
        size = faces * width * height * 3
        address = int(model.tex_adr[texture])
        assert (textures.texels[start : start + size] == model.tex_data[address : address + size]).all()
        start, width, height = textures.table[texture, textures.levels[texture] - 1]
        assert (width, height) == (1, 1)
        mean = model.tex_data[address : address + size].reshape(faces, -1, 3).mean(axis=1)
        np.testing.assert_allclose(textures.texels[start : start + 3 * faces].reshape(faces, 3), mean, atol=2.0)
