"""Small scenes for the render tests, and the recorded views."""

import functools
import importlib.util

import numpy as np
import pytest

from prnav.render import Renderer
from prnav.render.gpu import load_warp
from prnav.scene import SceneMesh, TextureAtlas, load_scene


def quads(corners, uvs):
    """Vertices, uvs and faces of quads (Q, 4, 3), (Q, 4, 2)."""
    count = len(corners)
    faces = np.concatenate([np.arange(count)[:, None] * 4 + np.array(t) for t in ([0, 1, 2], [0, 2, 3])])
    return corners.reshape(-1, 3), uvs.reshape(-1, 2), faces


def make_scene(seed, triangles=60, ceiling=False):
    """A textured room of 8 x 3 x 6 m without a ceiling, with coloured and textured triangles floating in it."""
    rng = np.random.default_rng(seed)
    x, y, z = 4.0, 3.0, 3.0
    walls = [
        [(-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z)],
        [(-x, 0, -z), (x, 0, -z), (x, y, -z), (-x, y, -z)],
        [(x, 0, z), (-x, 0, z), (-x, y, z), (x, y, z)],
        [(x, 0, -z), (x, 0, z), (x, y, z), (x, y, -z)],
        [(-x, 0, z), (-x, 0, -z), (-x, y, -z), (-x, y, z)],
    ]
    if ceiling:
        walls.append([(-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z)])
    turn = np.array([(0.0, 2.0), (3.0, 2.0), (3.0, 0.0), (0.0, 0.0)])
    vertices, uvs, faces = quads(np.array(walls, dtype=float), np.stack([turn] * len(walls)))
    shards = rng.uniform(-0.5, 0.5, (triangles, 3, 3)) + rng.uniform([-3, 0.3, -2], [3, 2.7, 2], (triangles, 1, 3))
    shards[np.linalg.norm(shards.mean(1)[:, [0, 2]], axis=1) < 1.0] += [0, 0, 30.0]  # keep the middle free
    colors = np.concatenate([np.full((len(vertices), 3), 255), rng.integers(0, 256, (3 * triangles, 3))])
    images = [rng.integers(0, 256, (size, wide, 3), dtype=np.uint8) for size, wide in ((16, 16), (12, 20))]
    face_texture = np.concatenate([np.arange(len(faces)) % (len(walls)) % 2 + 1, rng.integers(0, 3, triangles)])
    return SceneMesh(
        f"room-{seed}",
        np.concatenate([vertices, shards.reshape(-1, 3)]).astype(np.float32),
        np.concatenate([uvs, rng.uniform(-2, 2, (3 * triangles, 2))]).astype(np.float32),
        colors.astype(np.uint8),
        np.concatenate([faces, np.arange(3 * triangles).reshape(-1, 3) + len(vertices)]).astype(np.int32),
        face_texture.astype(np.int32),
        TextureAtlas.from_images(images),
    )


CASTERS = [
    pytest.param(("embree", "cpu"), id="embree"),
    pytest.param(("warp", "cpu"), id="warp"),
    pytest.param(("warp", "cuda"), id="warp-cuda", marks=pytest.mark.gpu),
]
"""The engines that cast rays fast, each on its devices."""


@pytest.fixture(scope="session", params=CASTERS)
def caster(request):
    """Makes renderers of one engine on one device."""
    engine, device = request.param
    if engine == "warp" and importlib.util.find_spec("warp") is None:
        pytest.skip('the package warp-lang is missing; pip install "prnav[gpu]" to run this')
    if device == "cuda" and not load_warp("cpu")[0].is_cuda_available():
        pytest.skip("no CUDA device; run on a machine with one: pytest -m gpu tests/render")
    return functools.partial(Renderer, engine=engine, device=device)


@pytest.fixture(scope="session")
def room():
    return make_scene(0)


@pytest.fixture(scope="session")
def rooms(room):
    return [room, make_scene(1, 30, ceiling=True), make_scene(2, 10)]


@pytest.fixture(scope="session")
def batch():
    """Twelve agents in three scenes with three sensors each."""
    rng = np.random.default_rng(5)
    n, k = 12, 3
    positions = rng.uniform([-0.5, 0.0, -0.5], [0.5, 0.1, 0.5], (n, 3))
    designs = np.empty((n, k, 7))
    designs[..., :3] = rng.uniform([-0.1, 0.5, -0.1], [0.1, 1.5, 0.1], (n, k, 3))
    designs[..., 3:6] = rng.uniform(-1.5, 1.5, (n, k, 3))
    designs[..., 6] = np.radians(rng.uniform(20, 130, (n, k)))
    return rng.integers(0, 3, n), positions, rng.uniform(-4, 4, n), designs


@pytest.fixture(scope="session")
def small_house(real_data):
    return load_scene(real_data / "scenes" / "aws_small_house" / "small_house.glb")


@pytest.fixture(scope="session")
def golden_views(golden):
    """Habitat's pictures: feet (24, 3), yaws (24,), and per field of view in degrees rgb and depth."""
    with np.load(golden / "small_house" / "views.npz", allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}
