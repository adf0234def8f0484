import numpy as np
import pytest

from prnav.navmesh import NavMesh, NavMeshSettings
from prnav.navmesh.build import build_polygons


@pytest.fixture(scope="session")
def slabs_on_two_storeys():
    """Two floors above each other, 4 x 4 m and 3 x 3 m."""
    points, faces = [], []
    for size, y in ((4.0, 0.0), (3.0, 3.0)):
        k = len(points)
        points += [(0, y, 0), (0, y, size), (size, y, size), (size, y, 0)]
        faces += [(k, k + 1, k + 2), (k, k + 2, k + 3)]
    return NavMesh(build_polygons(np.array(points, float), np.array(faces)), NavMeshSettings())
