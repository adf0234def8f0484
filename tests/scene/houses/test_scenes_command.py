"""prnav-scenes."""

import numpy as np
import pytest

from prnav.cli.scenes import contact_sheet, main
from prnav.scene.houses.manifest import MANIFEST


@pytest.fixture(autouse=True)
def cache(monkeypatch, tmp_path_factory):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path_factory.getbasetemp() / "scenes-command"))


def test_list_names_the_homes_of_a_split(capsys):
    assert main(["list", "--split", "val"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 8
    assert lines[0] == "prhouses/val/00  seed 20000"


def test_generate_fills_the_cache_and_checks_the_hashes(capsys):
    assert main(["generate", "--split", "val"]) == 0
    assert "8 homes in the cache, hashes as in the manifest" in capsys.readouterr().out


def test_generate_with_a_manifest_wants_all_homes(capsys, tmp_path):
    assert main(["generate", "--split", "val", "--manifest", str(tmp_path / "m.json")]) == 2
    assert "leave out --split" in capsys.readouterr().err


@pytest.mark.slow
def test_generate_writes_the_manifest_that_is_shipped(tmp_path):
    assert main(["generate", "--manifest", str(tmp_path / "m.json")]) == 0
    assert (tmp_path / "m.json").read_text() == MANIFEST.read_text()


def test_info_says_size_and_walkable_area(capsys):
    assert main(["info", "prhouses/val/00"]) == 0
    out = capsys.readouterr().out
    assert "triangles" in out and "textures" in out and "% on the largest" in out


def test_info_of_an_unknown_scene_is_one_line(capsys):
    assert main(["info", "prhouses/val/77"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "prhouses/val/77" in error


def test_preview_and_export_write_files(capsys, tmp_path):
    from PIL import Image

    picture = tmp_path / "sheet.png"
    assert main(["preview", "prhouses/val/00", "--out", str(picture), "--views", "5", "--size", "64"]) == 0
    pixels = np.asarray(Image.open(picture))
    assert pixels.shape == (2 * 68 + 4, 3 * 68 + 4, 3) and pixels.std() > 20
    assert main(["export", "prhouses/val/00", "--out", str(tmp_path / "home.glb")]) == 0
    assert (tmp_path / "home.glb").read_bytes()[:4] == b"glTF"
    assert main(["export", "prhouses/val/00", "--out", str(tmp_path / "home.obj")]) == 2
    assert "must end in .glb" in capsys.readouterr().err


def test_contact_sheets_place_pictures_row_by_row():
    cells = [np.full((4, 4, 3), value, dtype=np.uint8) for value in (10, 20, 30, 40, 50, 60)]
    sheet = contact_sheet(cells, gap=1)
    assert sheet.shape == (11, 16, 3)
    assert [int(sheet[2, 2 + 5 * k, 0]) for k in range(3)] == [10, 20, 30]
    assert int(sheet[7, 2, 0]) == 40
