import dataclasses

import numpy as np
import pytest

from prnav.errors import SceneError
from prnav.scene import SceneMesh, TextureAtlas


@pytest.fixture
def square():
    return SceneMesh(
        name="square",
        vertices=np.array([[0, 0, 0], [2, 0, 0], [2, 0, -3], [0, 0, -3], [99, 99, 99]], np.float32),
        uvs=np.zeros((5, 2), np.float32),
        colors=np.full((5, 3), 255, np.uint8),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_texture=np.array([0, 1], np.int32),
        atlas=TextureAtlas.from_images([np.zeros((2, 2, 3), np.uint8)]),
    )


def test_bounds_are_of_the_triangles(square):
    assert square.bounds.tolist() == [[0, 0, -3], [2, 0, 0]]


def test_arrays_there_and_back(square):
    again = SceneMesh.from_arrays("again", square.to_arrays())
    assert again.name == "again" and again.hash == square.hash
    for name, array in square.to_arrays().items():
        assert np.array_equal(array, again.to_arrays()[name])


@pytest.mark.parametrize("field", ["vertices", "uvs", "colors", "faces", "face_texture"])
def test_hash_sees_every_array(square, field):
    array = getattr(square, field).copy()
    array[0] = 1 - array[0] if field != "colors" else 7
    if field == "faces":
        array[0] = [2, 1, 0]
    assert dataclasses.replace(square, **{field: array}).hash != square.hash


@pytest.mark.parametrize(
    ("field", "change", "message"),
    [
        ("vertices", lambda a: a.astype(np.float64), r"vertices is \(5, 3\) float64; it must be \(n, 3\) float32"),
        ("colors", lambda a: a[:, :2], r"colors is \(5, 2\) uint8; it must be \(n, 3\) uint8"),
        ("uvs", lambda a: a[:4], "5 vertices, 4 uvs, 5 colours"),
        ("faces", lambda a: a + 3, r"a face refers to a vertex outside 0\.\.4"),
        ("faces", lambda a: a[:0], "face_texture is|no triangles"),
        ("face_texture", lambda a: a + 1, r"a face refers to a texture outside 0\.\.1"),
        ("face_texture", lambda a: a[:1], r"face_texture is \(1,\) int32; it must be \(2,\) int32"),
        ("vertices", lambda a: a * np.float32("nan"), "5 of 5 vertices are not finite, the first is number 0"),
        ("uvs", lambda a: a + np.float32("inf"), "5 of 5 uvs are not finite"),
    ],
)
def test_wrong_arrays_are_refused(square, field, change, message):
    with np.errstate(all="ignore"), pytest.raises(SceneError, match=message):
        dataclasses.replace(square, **{field: change(getattr(square, field))})
