import json
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from prnav.contracts.records import pick_episodes
from prnav.domains.navigation.benchmark import BENCHMARK
from prnav.domains.navigation.sights import SIGHTS
from prnav.errors import RecordError
from prnav.evaluate.records import RecordWriter
from prnav.report.page import make_page, read_run
from prnav.sensors import load_design


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
    assert len(images) == 6
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
    assert "Side by side" not in page
    assert "Differences" not in page
    assert "These evaluations are of different episodes" in page
    assert "<b>" not in page


def test_page_of_a_run_without_evaluation_shows_its_curves(run):
    records = read_run(run)
    page = make_page([type(records)(records.name, (), records.metrics, records.facts)])
    assert "<h2>Learning</h2>" in page
    assert "<h2>Results</h2>" not in page


def test_greedy_evaluations_come_after_those_that_act_as_in_training(tmp_path, make_evaluation):
    for name, actions in (("a", "greedy"), ("b", "sampled")):
        make_evaluation(tmp_path / "run" / "eval" / name, "run", actions)
    assert [one.header["actions"] for one in read_run(tmp_path / "run").evaluations] == ["sampled", "greedy"]


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


def test_designs_receptors_seeds_and_differences_are_on_the_page(run, tmp_path, make_evaluation):
    design = load_design("forward")
    body = {"radius": design.body.radius, "height": design.body.height}
    told = {"name": "forward", "grid": 2, "body": body, "sensors": design.sensors.tolist()}
    facts = {"recipe": "abc", "steps": 10}
    for seed in (0, 1):
        folder = tmp_path / f"seed{seed}" / "eval" / "test"
        checkpoint = {**facts, "seed": seed}
        evaluation = make_evaluation(folder, f"pr{seed}", "sampled", starts=True, design=told, checkpoint=checkpoint)
        index = pick_episodes(evaluation.rows)["random"][0]
        seen = np.full((evaluation.rows[index]["steps"] + 1, 2, 4, 3), 9, np.uint8)
        np.savez_compressed(folder / SIGHTS, rows=[index], grid=2, **{f"readings_{index}": seen})
    page = make_page([read_run(tmp_path / "seed0"), read_run(tmp_path / "seed1")])
    text = re.sub(r"data:[^\"]*", "", page)
    for words in (
        "Over seeds",
        "pr0, pr1 (sampled)",
        "Differences, paired by episode",
        "The design forward on the body",
    ):
        assert words in text
    assert text.count("what every receptor read") == 4  # alt and caption, twice
    (tmp_path / "seed0" / "eval" / "test" / SIGHTS).write_bytes(b"PK")
    with pytest.raises(RecordError, match=r"sights\.npz: cannot be read .*; evaluate again"):
        make_page([read_run(tmp_path / "seed0")])


def test_records_of_another_benchmark_version_are_named(run):
    path = run / "eval" / "test-greedy" / "evaluation.json"
    head = json.loads(path.read_text())
    path.write_text(json.dumps({**head, "benchmark": "prhouses-v999", "version": "9.9"}))
    with pytest.raises(RecordError, match=f"of benchmark prhouses-v999, and this version of prnav has {BENCHMARK}; "):
        read_run(run)


@pytest.mark.browser
def test_the_page_looks_right_in_a_browser(run, tmp_path, make_evaluation):
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium here; install it (Debian: apt-get install chromium) to look at pages")
    make_evaluation(tmp_path / "other" / "eval" / "test", "random", "sampled", starts=True)
    page, picture = tmp_path / "page.html", tmp_path / "page.png"
    page.write_text(make_page([read_run(run), read_run(tmp_path / "other")]))
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1280,5000"]
    shot = [chromium, *options, f"--user-data-dir={tmp_path / 'profile'}", f"--screenshot={picture}", page.as_uri()]
    subprocess.run(shot, check=True, timeout=120, capture_output=True)
    image = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    assert image.shape[1] == 1280
    red = (image[..., 0] > 180) & (image[..., 1] < 90) & (image[..., 2] < 90)
    assert red.sum() > 200  # collisions
    inked = (image.sum(axis=-1) < 600).any(axis=1)
    assert inked[:200].any() and inked.mean() > 0.2
    margin = image[:, 1240:]
    assert (margin > 250).all()  # nothing runs over the page's right side
