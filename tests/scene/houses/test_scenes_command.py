"""prnav-scenes."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest

from prnav.cli._scene_views import contact_sheet, floor_levels
from prnav.cli.scenes import main
from prnav.navmesh import load_navmesh
from prnav.scene import load_scene
from prnav.scene.houses import plan_house
from prnav.scene.houses.manifest import MANIFEST
from prnav.scene.houses.pool import make_missing_homes
from prnav.scene.library import missing_homes


@pytest.fixture(autouse=True)
def cache(monkeypatch, tmp_path_factory):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path_factory.getbasetemp() / "scenes-command"))


def test_list_names_the_homes_of_a_split(capsys):
    assert main(["list", "--split", "val"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 8
    assert lines[0] == "prhouses/val/00  seed 20000"


def test_generate_fills_the_cache_and_checks_the_hashes(capsys):
    assert main(["generate", "--split", "val", "--workers", "1"]) == 0
    assert "8 homes in the cache, hashes as in the manifest" in capsys.readouterr().out


def test_generate_with_a_manifest_wants_all_homes(capsys, tmp_path):
    assert main(["generate", "--split", "val", "--manifest", str(tmp_path / "m.json")]) == 2
    assert "leave out --split" in capsys.readouterr().err


def test_homes_that_are_missing_are_made_on_all_cores_before_they_are_loaded(monkeypatch, tmp_path):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path))
    wanted = ["prhouses/val/02", "mine.glb", "prhouses/val/05"]
    assert missing_homes(wanted) == ["prhouses/val/02", "prhouses/val/05"]
    told = []
    make_missing_homes(wanted, lambda done, total, name: told.append((done, total, name)))
    assert [row[:2] for row in told] == [(1, 2), (2, 2)]
    assert {row[2] for row in told} == set(wanted) - {"mine.glb"}
    assert missing_homes(wanted) == []


@pytest.mark.slow
def test_generate_writes_the_manifest_that_is_shipped(tmp_path):
    assert main(["generate", "--manifest", str(tmp_path / "m.json")]) == 0
    assert (tmp_path / "m.json").read_text() == MANIFEST.read_text()


def test_info_says_size_and_walkable_area(capsys):
    assert main(["info", "prhouses/val/00"]) == 0
    out = capsys.readouterr().out
    assert "triangles" in out and "% on the largest" in out and "bytes" in out
    assert "storeys    1\n" in out and "rooms" in out and "kinds" in out and "doors shut" in out


def test_floors_of_a_home_on_two_storeys_are_found():
    navmesh = load_navmesh(load_scene("prhouses/val/02"))
    level = plan_house(20002)[1].level / 1000
    assert floor_levels(navmesh) == pytest.approx([0.2, level + 0.2], abs=0.05)


def run_generate(cache, *more):
    code = f"from prnav.cli.scenes import main; raise SystemExit(main({['generate', '--split', 'val', *more]!r}))"
    environment = {**os.environ, "PRNAV_CACHE": str(cache)}
    return subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def test_two_runs_at_once_do_no_harm(tmp_path):
    runs = [run_generate(tmp_path, "--workers", "2") for _ in range(2)]
    outputs = [run.communicate(timeout=300)[0] for run in runs]
    assert [run.returncode for run in runs] == [0, 0], outputs
    assert all("8 homes in the cache, hashes as in the manifest" in output for output in outputs)
    files = sorted(path.name for path in (tmp_path / "houses").iterdir())
    assert len(files) == 8 and all(name.endswith(".npz") and not name.startswith(".") for name in files)


def test_a_run_that_was_killed_goes_on_where_it_was(tmp_path, monkeypatch, capsys):
    def done():
        return {path.name: path.stat().st_mtime_ns for path in (tmp_path / "houses").glob("[!.]*.npz")}

    run = run_generate(tmp_path, "--workers", "1")
    while len(done()) < 2 and run.poll() is None:
        time.sleep(0.01)
    run.kill()
    run.communicate()
    before = done()
    assert len(before) >= 2
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path))
    assert main(["generate", "--split", "val", "--workers", "1"]) == 0
    assert "8 homes in the cache" in capsys.readouterr().out
    after = done()
    assert len(after) == 8 and before.items() <= after.items()


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
