import numpy as np
import pytest

from prnav.navmesh import NavMesh
from prnav.scene import SceneMesh, TextureAtlas


def make_slabs(*boxes):
    """A scene of flat floors, each (x0, x1, z0, z1, height)."""
    vertices, faces = [], []
    for x0, x1, z0, z1, y in boxes:
        k = len(vertices)
        vertices += [(x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0)]
        faces += [(k, k + 1, k + 2), (k, k + 2, k + 3)]
    count = len(vertices)
    return SceneMesh(
        name="slabs",
        vertices=np.array(vertices, np.float32),
        uvs=np.zeros((count, 2), np.float32),
        colors=np.full((count, 3), 255, np.uint8),
        faces=np.array(faces, np.int32),
        face_texture=np.zeros(len(faces), np.int32),
        atlas=TextureAtlas.from_images([]),
    )


@pytest.fixture(scope="session")
def slabs():
    return make_slabs


@pytest.fixture(scope="session")
def corner():
    """An L of two corridors, and a platform too high and too small to matter."""
    return NavMesh.build(make_slabs((0, 10, 0, 2, 0), (0, 2, 2, 10, 0), (20, 21.6, 0, 1.6, 2)))


@pytest.fixture(scope="session")
def tiny():
    return NavMesh.build(make_slabs((0, 1.8, 0, 1.8, 0)))
