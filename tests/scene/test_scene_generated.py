"""OBJ and PLY files of all combinations against values that follow from the formula of the sheet they show."""

import itertools

import numpy as np
import pytest
from mesh_cases import area, load
from mesh_generator import HEIGHT, LEVEL, WIDTH, obj_sheets, ply_sheets, points

SHEETS = {"obj": list(obj_sheets()), "ply": list(ply_sheets())}


def colors_under(scene, where):
    """Colours 0..255 that a scene in the plane z = LEVEL shows at points (N, 2), by the definition in SceneMesh."""
    corners = scene.vertices[scene.faces][..., :2].astype(np.float64)
    a, b, c = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    offset = where[:, None] - a
    det = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
    s = (offset[..., 0] * c[:, 1] - offset[..., 1] * c[:, 0]) / det
    t = (b[:, 0] * offset[..., 1] - b[:, 1] * offset[..., 0]) / det
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    assert (inside.sum(axis=1) == 1).all()  # under every point is one triangle
    face = inside.argmax(axis=1)
    s, t = (value[np.arange(len(where)), face] for value in (s, t))
    weights = np.stack([1 - s - t, s, t], axis=1)
    uv = np.einsum("nk,nkc->nc", weights, scene.uvs[scene.faces[face]].astype(np.float64)) % 1.0
    tint = np.einsum("nk,nkc->nc", weights, scene.colors[scene.faces[face]].astype(np.float64)) / 255.0
    texels = []
    for (u, v), texture in zip(uv, scene.face_texture[face], strict=True):
        image = scene.atlas.image(int(texture))
        texels.append(image[int(v * image.shape[0]), int(u * image.shape[1]), :3])
    return np.array(texels) * tint


@pytest.mark.parametrize("kind", SHEETS)
def test_generated_files(tmp_path, kind):
    where = points()
    for number, sheet in enumerate(SHEETS[kind]):
        folder = tmp_path / str(number)
        folder.mkdir()
        for name, data in sheet.files.items():
            (folder / name).write_bytes(data)
        scene = load(folder / sheet.name)
        assert area(scene) == pytest.approx(WIDTH * HEIGHT), sheet.name
        assert scene.bounds.tolist() == [[0, 0, LEVEL], [WIDTH, HEIGHT, LEVEL]], sheet.name
        assert np.abs(colors_under(scene, where) - sheet.colors(where)).max() <= 1.0, sheet.name
        a, b, c = (scene.vertices[scene.faces[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a)[:, 2] > 0).all(), sheet.name  # every triangle shows its front


def test_there_are_enough_of_them():
    names = [sheet.name for sheet in itertools.chain(*SHEETS.values())]
    assert len(set(names)) == len(names) >= 60
