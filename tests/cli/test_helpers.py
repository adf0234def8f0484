"""Workers of a search: what they warn of is kept and told."""

from prnav.cli import _helpers
from prnav.cli._helpers import Helpers


def test_warnings_and_errors_of_workers_are_told_once_and_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(
        _helpers, "BEGIN", "import sys; print('warning: losses grow', 'loading', sep='\\n', file=sys.stderr)"
    )
    (tmp_path / "worker-1.log").write_text("warning: of yesterday\n")
    with Helpers(["optimize"], tmp_path, 2) as helpers:
        helpers.wait()
    assert helpers.told() == ["worker-1.log: warning: losses grow"]
    assert (tmp_path / "worker-2.log").read_text().splitlines() == ["warning: losses grow", "loading"]
    assert "of yesterday" in (tmp_path / "worker-1.log").read_text()


def test_a_worker_that_fails_says_why(tmp_path):
    with Helpers(["optimize", "--config", "nonsense"], tmp_path, 1) as helpers:
        helpers.wait()
    (line,) = helpers.told()
    assert "error: config 'nonsense' is not known" in line and line.startswith("worker-1.log: ")


def test_workers_end_with_the_search(tmp_path, monkeypatch):
    monkeypatch.setattr(_helpers, "BEGIN", "import time; time.sleep(600)")
    with Helpers([], tmp_path, 1) as helpers:
        pass
    assert helpers._processes[0].returncode is not None
