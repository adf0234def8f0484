import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest

from prnav.errors import RecordError
from prnav.evaluate.records import RecordWriter
from prnav.report.page import make_page, read_run


class Tags(HTMLParser):
    """Tags of a page, and whether each that opens is closed."""

    def __init__(self):
        super().__init__()
        self.open, self.seen = [], []

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_page_is_whole_and_holds_its_pictures(run, tmp_path, make_evaluation):
    make_evaluation(tmp_path / "other" / "eval" / "test", "random", "sampled")
    page = make_page([read_run(run), read_run(tmp_path / "other")])
    tags = Tags()
    tags.feed(page)
    assert not tags.open
    images = [attributes["src"] for tag, attributes in tags.seen if tag == "img"]
    assert len(images) == 5
    assert all(source.startswith("data:image/png;base64,") for source in images)
    assert not re.search(r'(src|href)="(?!data:)', page)
    text = re.sub(r"data:[^\"]*", "", page)
    assert "run (greedy) on test" in text
    assert "other: random on test" in text
    assert "4,000 environment steps; warm start: none" in text
    assert "<b>" in text
    assert "home/<1>" not in text


def test_different_episodes_are_not_ranked(run, tmp_path, make_evaluation):
    path = make_evaluation(tmp_path / "other" / "eval" / "test", "random").directory / "evaluation.json"
    path.write_text(path.read_text().replace('"split"', '"episodes_hash": "0123", "split"'))
    page = make_page([read_run(run), read_run(tmp_path / "other")])
    assert "These evaluations are of different episodes" in page
    assert "<b>" not in page


def test_page_of_a_run_without_evaluation_shows_its_curves(run):
    records = read_run(run)
    page = make_page([type(records)(records.name, (), records.metrics, records.facts)])
    assert "<h2>Learning</h2>" in page
    assert "<h2>Results</h2>" not in page


def test_unfinished_evaluations_are_said_to_be_so(run):
    with RecordWriter(run / "eval" / "half", {"agent": "run"}):
        pass
    assert "run: the evaluation half is unfinished and not shown." in make_page([read_run(run)])


def test_nothing_to_report_is_named(tmp_path):
    with pytest.raises(RecordError, match="there is no such folder"):
        read_run(tmp_path / "nothing")
    with pytest.raises(RecordError, match=r"holds no finished evaluation and no metrics\.jsonl"):
        read_run(tmp_path)


def test_broken_metrics_are_named(run):
    metrics = run / "metrics.jsonl"
    whole = metrics.read_text()
    metrics.write_text(whole + '{"step": 5')
    assert len(read_run(run).metrics) == 40
    metrics.write_text('{"step"\n' + whole)
    with pytest.raises(RecordError, match=r"metrics\.jsonl: line 1 is not valid JSON"):
        read_run(run)


def test_report_needs_no_torch():
    script = "import sys, prnav.report.page, prnav.report.designs; assert 'torch' not in sys.modules, 'torch'"
    subprocess.run([sys.executable, "-c", script], check=True, timeout=120)
