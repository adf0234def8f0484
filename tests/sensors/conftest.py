"""A scene for tests of sensors."""

import numpy as np
import pytest

from prnav.scene import SceneMesh, TextureAtlas


@pytest.fixture(scope="session")
def shards():
    """Coloured triangles all around."""
    rng = np.random.default_rng(0)
    centres = rng.normal(size=(200, 1, 3))
    centres *= 3.0 / np.linalg.norm(centres, axis=-1, keepdims=True)
    vertices = (centres + rng.normal(scale=0.5, size=(200, 3, 3)) + [0, 1, 0]).reshape(-1, 3).astype(np.float32)
    return SceneMesh(
        "shards",
        vertices,
        np.zeros((600, 2), np.float32),
        np.repeat(rng.integers(0, 256, (200, 3)), 3, axis=0).astype(np.uint8),
        np.arange(600, dtype=np.int32).reshape(-1, 3),
        np.zeros(200, np.int32),
        TextureAtlas.from_images([]),
    )
