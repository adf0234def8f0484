"""``prnav-scenes preview --navmesh``: what is on the picture."""

import numpy as np
import pytest
from PIL import Image
from rooms import random_room

from prnav.cli import _navmesh_picture as picture
from prnav.cli.scenes import main
from prnav.navmesh import NavMesh


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3).astype(int)


def share(path, colour):
    return (np.abs(pixels(path) - colour).max(axis=1) < 12).mean()


def test_a_navmesh_file_is_drawn(tmp_path, capsys):
    navmesh, *_ = random_room(5, size=6, blocked=0.45, slope=0.0)
    assert len(navmesh.islands) > 1
    navmesh.save(tmp_path / "room.navmesh")
    out = tmp_path / "room.png"
    assert main(["preview", str(tmp_path / "room.navmesh"), "--navmesh", "--out", str(out)]) == 0
    assert f"1 storey, {len(navmesh.islands)} islands" in capsys.readouterr().out
    blue, orange, yellow, red = (31, 119, 180), (255, 127, 14), (253, 231, 37), (255, 0, 0)
    assert share(out, blue) > share(out, orange) > 1e-3, "islands in the order of their areas"
    assert share(out, yellow) > 1e-4, "the field near the goal"
    assert share(out, red) > 1e-4, "the path"
    assert main(["preview", str(tmp_path / "no.navmesh"), "--navmesh", "--out", str(out)]) == 2
    with pytest.raises(SystemExit):
        main(["preview", str(tmp_path / "room.navmesh"), "--navmesh", "--seed", "-1", "--out", str(out)])
    assert "--seed: '-1' is not a whole number from 0" in capsys.readouterr().err


def test_storeys_are_found_and_each_gets_a_row(slabs_on_two_storeys, tmp_path):
    navmesh = slabs_on_two_storeys
    np.testing.assert_allclose(picture._storeys(navmesh.random_points(500, 0)[:, 1]), [0.2, 3.2], atol=0.21)
    assert picture.save_navmesh_picture(navmesh, "two", tmp_path / "two.png") == 2
    assert picture.save_navmesh_picture(random_room(1, slope=0.0)[0], "one", tmp_path / "one.png") == 1
    two, one = (Image.open(tmp_path / name).size for name in ("two.png", "one.png"))
    assert two[1] > 1.3 * one[1]
    assert isinstance(navmesh, NavMesh)
