import subprocess
import sys

import pytest

from prnav.cli import _doctor
from prnav.cli.prnav import main


@pytest.fixture
def quick(monkeypatch):
    """No process is started: every probe succeeds but the rasterisers'."""
    monkeypatch.setattr(_doctor, "_fails", lambda script, seconds: "no library" if '"egl"' in script else "")
    monkeypatch.setattr(_doctor, "_run", lambda arguments, seconds: "no answer")


def test_what_is_missing_says_how_to_get_it_and_is_no_failure(quick, capsys):
    assert main(["doctor"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Everything that is required works." in printed
    assert "no library" in printed
    assert "libegl1" in printed


def test_what_is_required_and_broken_fails(quick, capsys, monkeypatch):
    monkeypatch.setattr(_doctor, "_fails", lambda script, seconds: "bad ABI" if "torch" in script else "")
    assert main(["doctor"]) == 1
    assert "required and not working: torch" in capsys.readouterr().err


def test_a_probe_that_hangs_is_given_up():
    assert _doctor._fails("import time; time.sleep(60)", 0.5) == "no answer within 0 s"
    assert _doctor._fails("raise ValueError('why')", 60.0) == "ValueError: why"
    assert _doctor._fails("import os; os.abort()", 60.0).startswith("ended with status")


def test_a_cache_that_cannot_be_written_is_named(monkeypatch, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("PRNAV_CACHE", str(blocked / "cache"))
    finding = _doctor._cache()
    assert finding.status == "broken"
    assert "PRNAV_CACHE" in finding.remedy


@pytest.mark.slow
def test_this_machine_is_healthy():
    answer = subprocess.run([sys.executable, "-m", "prnav.cli.prnav", "doctor"], capture_output=True, timeout=300)
    assert answer.returncode == 0
