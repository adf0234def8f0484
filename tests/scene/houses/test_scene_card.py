"""The data card's tables and pictures."""

import numpy as np
import pytest
from PIL import Image

from prnav.cli import _scene_card
from prnav.cli._scene_card import HomeRow, card_table, episode_lines, measure_homes, write_figure, write_sheet
from prnav.cli.scenes import main
from prnav.episodes import load_builtin_table
from prnav.scene import scene_ids


@pytest.fixture(autouse=True)
def cache(monkeypatch, tmp_path_factory):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path_factory.getbasetemp() / "scenes-command"))


def test_the_table_has_lowest_median_and_highest_by_split():
    rows = [HomeRow("val", 1 + k % 2, 4 + k, 50.0 + k, 1.0 - k / 100, 10_000 + k, 9) for k in range(3)]
    table = card_table([*rows, HomeRow("test", 2, 20, 99.0, 0.95, 1234567, 8)])
    assert "|  | val | test |" in table and "| homes | 3 | 1 |" in table and "| on two storeys | 1 | 1 |" in table
    assert "| rooms | 4 - 5 - 6 | 20 - 20 - 20 |" in table
    assert "| share on the largest island | 0.980 - 0.990 - 1.000 |" in table and "1,234,567" in table


def test_frames_are_of_twelve_places_in_built_in_homes():
    known = {name for split in ("train", "val", "test") for name in scene_ids(split)}
    assert len(set(_scene_card.FRAMES)) == 12
    assert {name for name, _ in _scene_card.FRAMES} <= known


def test_homes_are_measured_and_drawn(tmp_path, monkeypatch):
    rows = measure_homes(["prhouses/val/00"])
    assert rows[0].split == "val" and rows[0].storeys == 1 and rows[0].rooms >= 4
    assert 40.0 <= rows[0].walkable <= 300.0 and 0.9 <= rows[0].share <= 1.0
    tables = {"val": load_builtin_table("val")[0]}
    assert "| val | 448 | " in episode_lines(tables)
    write_figure(tmp_path / "figure.png", rows, tables)
    assert np.asarray(Image.open(tmp_path / "figure.png")).std() > 10
    monkeypatch.setattr(_scene_card, "FRAMES", (("prhouses/val/00", 1), ("prhouses/val/00", 2)))
    write_sheet(tmp_path / "sheet.png", 32)
    assert np.asarray(Image.open(tmp_path / "sheet.png")).std() > 20


def test_the_card_refuses_pictures_that_are_too_small(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["card", "--out", str(tmp_path), "--size", "4"])
    assert ended.value.code == 2
    assert "--size: '4' is not a whole number from 16 to 4096" in capsys.readouterr().err
