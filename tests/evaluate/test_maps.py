import numpy as np
import pytest

from prnav.errors import RecordError
from prnav.evaluate.maps import FloorMap, floor_heights, floor_of, load_maps, save_maps


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


def test_no_maps_are_named(tmp_path):
    with pytest.raises(RecordError, match=r"maps\.npz: cannot be read .*; evaluate again"):
        load_maps(tmp_path)
