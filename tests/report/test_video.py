import sys

import numpy as np
import pytest

from prnav.domains.navigation.maps import load_maps
from prnav.domains.navigation.pictures.film import HEIGHT, WIDTH, draw_frames, write_videos
from prnav.errors import PrnavError
from prnav.evaluate.records import load_evaluation, load_traces


def test_frames_show_receptors_collisions_and_every_step(run):
    evaluation = load_evaluation(run / "eval" / "test-greedy")
    track, maps = load_traces(evaluation)[0], load_maps(evaluation.directory)
    readings = np.zeros((len(track["positions"]), 2, 4, 4, 3), np.uint8)
    readings[..., 2] = 255
    track["collisions"][:] = False
    track["collisions"][3] = True
    frames = list(draw_frames(evaluation.rows[0], track, maps, readings, "film"))
    assert len(frames) == len(track["positions"])
    assert all(frame.shape == (HEIGHT, WIDTH, 3) for frame in frames)
    assert (frames[0] == [0, 0, 255]).all(axis=-1).sum() > 10_000
    red = [((frame[..., 0] > 180) & (frame[..., 1:] < 90).all(axis=-1)).sum() for frame in frames]
    assert red[2] == 0 and red[3] > 0 and red[-1] > 0  # the word at the step, then the dot on the plan
    assert not np.array_equal(frames[0], frames[1])


def test_a_missing_encoder_is_named_with_its_remedy(run, monkeypatch):
    evaluation = load_evaluation(run / "eval" / "test-greedy")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(PrnavError, match=r"imageio-ffmpeg, which is not installed; get it with: pip install"):
        write_videos(evaluation, load_traces(evaluation))


def test_films_are_mp4(run):
    pytest.importorskip("imageio_ffmpeg", reason="films need imageio-ffmpeg: pip install 'prnav[video]'")
    evaluation = load_evaluation(run / "eval" / "test-greedy")
    paths = write_videos(evaluation, load_traces(evaluation))
    assert sorted(path.name.split("-")[0] for path in paths) == ["best", "random", "worst"]
    for path in paths:
        assert path.read_bytes()[4:8] == b"ftyp"
