import numpy as np

from prnav.render.charts import coarsest_levels
from prnav.scene import SceneMesh, TextureAtlas


def sheet(uv_boxes, size=256, share_vertices=True):
    """Quads side by side, each showing the box (u0, v0, u1, v1) of one texture."""
    vertices, uvs, faces = [], [], []
    for i, (u0, v0, u1, v1) in enumerate(uv_boxes):
        corners = np.array([[i, 0, 0], [i + 1, 0, 0], [i + 1, 1, 0], [i, 1, 0]], dtype=float)
        places = np.array([[u0, v1], [u1, v1], [u1, v0], [u0, v0]])
        for triangle in ([0, 1, 2], [0, 2, 3]):
            start = len(vertices)
            vertices += list(corners[triangle])
            uvs += list(places[triangle])
            faces.append([start, start + 1, start + 2])
    count = len(vertices)
    return SceneMesh(
        "sheet",
        np.array(vertices, np.float32),
        np.array(uvs, np.float32),
        np.full((count, 3), 255, np.uint8),
        np.array(faces, np.int32),
        np.ones(len(faces), np.int32),
        TextureAtlas.from_images([np.zeros((size, size, 3), np.uint8)]),
    )


def test_small_charts_stay_fine_and_repeated_pictures_may_get_coarse():
    levels = coarsest_levels(sheet([(0, 0, 0.05, 0.05), (0.2, 0.2, 0.9, 0.9), (0, 0, 40, 40)]))
    small, large, repeated = levels[0], levels[2], levels[4]
    assert (levels == np.repeat([small, large, repeated], 2)).all()  # both halves of a quad alike, sharing no vertex
    assert small == 0 < large < repeated <= 8


def test_a_chart_is_what_hangs_together_in_the_picture():
    strip = [(i / 10, 0.0, (i + 1) / 10, 1.0) for i in range(10)]
    whole = coarsest_levels(sheet([(0.0, 0.0, 1.0, 1.0)]))
    np.testing.assert_array_equal(coarsest_levels(sheet(strip)), whole[0])


def test_copies_of_a_part_do_not_hide_its_border():
    once = coarsest_levels(sheet([(0, 0, 0.3, 0.3)]))
    np.testing.assert_array_equal(coarsest_levels(sheet([(0, 0, 0.3, 0.3)] * 4)), once[0])
