import pytest

from prnav.cli.design import main
from prnav.sensors import library_designs


def test_library_is_listed(capsys):
    assert main(["list"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in library_designs())


def test_a_design_is_drawn(tmp_path, capsys):
    path = tmp_path / "design.png"
    small = ["--size", "16", "--rays", "4", "--scene", "prhouses/val/00"]
    assert main(["show", "forward", "--out", str(path), *small]) == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    assert str(path) in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["forwards"], ["forward", "--scene", "nowhere.glb"]])
def test_mistakes_end_in_one_line(arguments, tmp_path, capsys):
    path = tmp_path / "design.png"
    assert main(["show", *arguments, "--out", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not path.exists()
