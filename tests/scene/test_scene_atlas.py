from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from prnav.scene import TextureAtlas
from prnav.scene.atlas import mip_levels


def exact_mip(image, level):
    """Mean over the area of the full image, in fractions."""
    height, width, channels = image.shape
    h, w = max(1, height >> level), max(1, width >> level)
    result = np.zeros((h, w, channels))
    for y in range(h):
        for x in range(w):
            total = [Fraction(0)] * channels
            for row in range(height):
                dy = min(Fraction(row + 1), Fraction((y + 1) * height, h)) - max(Fraction(row), Fraction(y * height, h))
                for column in range(width):
                    dx = min(Fraction(column + 1), Fraction((x + 1) * width, w)) - max(
                        Fraction(column), Fraction(x * width, w)
                    )
                    if dx > 0 and dy > 0:
                        for c in range(channels):
                            total[c] += dx * dy * int(image[row, column, c])
            result[y, x] = [float(value / Fraction(height * width, h * w)) for value in total]
    return result


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 11), st.integers(1, 11), st.integers(0, 2**32 - 1))
def test_every_level_is_the_mean_of_the_area_it_covers(width, height, seed):
    image = np.random.default_rng(seed).integers(0, 256, (height, width, 4), dtype=np.uint8)
    levels = mip_levels(image)
    assert levels[-1].shape == (1, 1, 4)
    for level, found in enumerate(levels):
        exact = exact_mip(image, level)
        assert found.shape == exact.shape
        assert np.abs(found - exact).max() <= 0.5 + 1e-4


def test_table_says_where_each_level_lies():
    rng = np.random.default_rng(3)
    images = [rng.integers(0, 256, (8, 4, 3), dtype=np.uint8), rng.integers(0, 256, (5, 7, 4), dtype=np.uint8)]
    atlas = TextureAtlas.from_images(images)
    assert atlas.num_textures == 3
    assert atlas.image(0).tolist() == [[[255, 255, 255, 255]]]
    assert atlas.table.tolist() == [[0, 1, 1, 1], [1, 4, 8, 4], [1 + 32 + 8 + 2 + 1, 7, 5, 3]]
    assert len(atlas.texels) == 44 + 35 + 3 * 2 + 1
    assert np.array_equal(atlas.image(1)[..., :3], images[0]) and (atlas.image(1)[..., 3] == 255).all()
    assert np.array_equal(atlas.image(2), images[1])
    for texture, image in ((1, atlas.image(1)), (2, images[1])):
        for level, expected in enumerate(mip_levels(np.array(image))):
            assert np.array_equal(atlas.image(texture, level), expected)
    with pytest.raises(IndexError, match="texture 2 has 3 levels, not level 3"):
        atlas.image(2, 3)


def test_no_images_is_an_atlas_of_white():
    assert TextureAtlas.from_images([]).table.tolist() == [[0, 1, 1, 1]]


@pytest.mark.parametrize("image", [np.zeros((2, 2, 3)), np.zeros((2, 2), np.uint8), np.zeros((0, 2, 3), np.uint8)])
def test_other_arrays_are_no_texture(image):
    with pytest.raises(ValueError, match=r"a texture must be \(H, W, 3 or 4\) uint8"):
        TextureAtlas.from_images([image])
