import numpy as np
import pytest
from matplotlib.path import Path

from prnav.domains.navigation.maps import FloorMap, floor_heights, floor_of, load_maps, make_maps, rasterise, save_maps
from prnav.errors import RecordError
from prnav.navmesh import load_navmesh
from prnav.scene import load_scene


def test_heights_group_into_floors():
    assert floor_heights([0.2, 0.1, 0.2, 3.0, 3.1, 2.9]) == [0.2, 3.0]
    assert floor_heights([]) == []


def test_maps_come_back_as_they_were(tmp_path):
    walkable = np.random.default_rng(0).random((5, 7)) > 0.5
    maps = [FloorMap("a", 0.0, (1.0, -2.0), 0.05, walkable), FloorMap("a", 3.0, (1.0, -2.0), 0.05, ~walkable)]
    save_maps(tmp_path, maps)
    lower, upper = load_maps(tmp_path)
    np.testing.assert_array_equal(lower.walkable, walkable)
    assert (lower.scene_id, lower.height, lower.origin, lower.metres_per_pixel) == ("a", 0.0, (1.0, -2.0), 0.05)
    assert lower.extent == pytest.approx((1.0, 1.35, -1.75, -2.0))
    assert floor_of([lower, upper], "a", 2.0) is upper
    assert floor_of([lower, upper], "b", 2.0) is None


def test_rasterised_triangles_hold_the_centres_that_lie_in_them():
    generator = np.random.default_rng(1)
    triangles = generator.uniform(-1.0, 4.0, size=(4, 3, 2))
    cells = rasterise(triangles, (0.0, 0.5), 0.1, (20, 30))
    paths = [Path(triangle) for triangle in triangles]
    for row in range(20):
        for column in range(30):
            centre = (0.1 * (column + 0.5), 0.5 + 0.1 * (row + 0.5))
            assert cells[row, column] == any(path.contains_point(centre) for path in paths)


def test_floor_plans_agree_with_the_navmesh():
    navmesh = load_navmesh(load_scene("prhouses/val/00"))
    height = navmesh.random_points(1, 0)[0, 1]
    (plan,) = make_maps([("home", navmesh, [height])])
    rows, columns = plan.walkable.shape
    x = plan.origin[0] + plan.metres_per_pixel * (np.arange(columns) + 0.5)
    z = plan.origin[1] + plan.metres_per_pixel * (np.arange(rows) + 0.5)
    points = np.stack(np.broadcast_arrays(x, height, z[:, None]), axis=-1).reshape(-1, 3)
    assert (navmesh.is_navigable(points, 1.0) == plan.walkable.ravel()).mean() > 0.99


def test_no_maps_are_named(tmp_path):
    with pytest.raises(RecordError, match=r"maps\.npz: cannot be read .*; evaluate again"):
        load_maps(tmp_path)
