import io

import numpy as np
import pytest
from PIL import Image

from prnav.errors import SceneError
from prnav.scene.images import reduction
from prnav.scene.load import load_mesh
from prnav.scene.source import read_source
from prnav.scene.texture_budget import budget_factors


def png(texels):
    stream = io.BytesIO()
    Image.fromarray(texels).save(stream, "PNG")
    return stream.getvalue()


@pytest.fixture
def pictures(quad):
    """Three squares of 1, 4 and 16 m2, each with another picture of 64 x 64 texels."""
    generator = np.random.default_rng(0)
    texels = generator.integers(0, 256, (3, 64, 64, 3), dtype=np.uint8)
    primitive = quad.document["meshes"][0]["primitives"][0]
    quad.document["meshes"], quad.document["nodes"] = [], []
    quad.document["scenes"][0]["nodes"] = []
    for k in range(3):
        quad.add("images", {"bufferView": quad.view(png(texels[k]))})
        quad.add("textures", {"source": k})
        quad.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}})
        quad.node(mesh=quad.mesh({**primitive, "material": k}), scale=[2**k, 2**k, 1])
    return quad, texels


def sizes(path, **limits):
    scene = load_mesh(read_source(path), **limits)
    return scene.atlas.table[1:, 1].tolist(), scene


def test_within_the_budget_nothing_changes(pictures, tmp_path):
    glb, texels = pictures
    widths, scene = sizes(glb.write(tmp_path / "a.glb"), texture_budget=3 * 64 * 64)
    assert widths == [64, 64, 64]
    for k in range(3):
        assert (scene.atlas.image(k + 1)[..., :3] == texels[k]).all()


@pytest.mark.parametrize(
    ("budget", "expected"),
    [
        (3 * 4096 - 1, [32, 64, 64]),  # the smallest square has the most texels per square metre
        (2 * 4096 + 1024, [32, 64, 64]),
        (2 * 4096 + 1023, [32, 32, 64]),  # now the first two are equally fine, and the second has more texels
        (4096 + 1024 + 256, [16, 32, 64]),
        (4096 + 1024 + 255, [16, 32, 32]),  # all three are equally fine, and the third has the most texels
        (1600, [16, 16, 32]),
        (3, [1, 1, 1]),
        (1, [1, 1, 1]),
    ],
)
def test_the_finest_texture_gives_way_first(pictures, tmp_path, budget, expected):
    assert sizes(pictures[0].write(tmp_path / "a.glb"), texture_budget=budget)[0] == expected


def test_what_is_left_is_the_mean_of_what_was_there(pictures, tmp_path):
    glb, texels = pictures
    _, scene = sizes(glb.write(tmp_path / "a.glb"), texture_budget=4096)
    for k, factor in enumerate((4, 2, 2)):
        exact = texels[k].reshape(64 // factor, factor, 64 // factor, factor, 3).mean(axis=(1, 3))
        assert np.abs(scene.atlas.image(k + 1)[..., :3] - exact).max() <= 0.5 + 1e-9


def test_repeats_count_as_finer():
    one, twice = np.array([1.0, 1.0]), np.array([1.0, 4.0])
    assert budget_factors([(8, 8)] * 2, [1, 1], one, one, 100) == [2, 1]
    assert budget_factors([(8, 8)] * 2, [1, 1], one, twice, 100) == [1, 2]
    assert budget_factors([(8, 8)] * 2, [1, 1], np.array([1.0, 0.0]), twice, 100) == [1, 2]  # seen nowhere


def test_budget_law():
    """Never over the budget unless all are single texels, and no coarser than one more halving would be."""
    generator = np.random.default_rng(0)
    for _ in range(200):
        count = int(generator.integers(1, 8))
        shapes = [tuple(map(int, generator.integers(1, 100, 2))) for _ in range(count)]
        factors = [reduction(shape, 64) for shape in shapes]
        budget = int(generator.integers(1, 20_000))
        result = budget_factors(shapes, factors, generator.random(count), generator.random(count), budget)
        texels = [-(-w // f) * -(-h // f) for (w, h), f in zip(shapes, result, strict=True)]
        assert sum(texels) <= budget or max(texels) == 1
        assert all(f >= g and f & (f - 1) == 0 for f, g in zip(result, factors, strict=True))


def test_budget_below_one(pictures, tmp_path):
    with pytest.raises(SceneError, match="texture_budget 0 is not a number of texels >= 1"):
        sizes(pictures[0].write(tmp_path / "a.glb"), texture_budget=0)
