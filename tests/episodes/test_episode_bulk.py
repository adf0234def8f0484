"""Many scenes at once: the same files however they are drawn, and nothing lost when a run is cut short."""

import gzip
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from test_episode_command import write_floor

from prnav.episodes import (
    EpisodeDataset,
    EpisodeTable,
    generate_table,
    load_episode_table,
    load_episodes,
    save_episodes,
)
from prnav.episodes.bulk import BulkConfig, generate_files
from prnav.episodes.files import read_header, write_episode_stream
from prnav.episodes.generate import CHUNK, generate_chunks
from prnav.errors import EpisodeError, NavMeshError

CONFIG = BulkConfig(per_scene=70, seed=2)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    return {f"{k}.ply": str(write_floor(folder / f"{k}.ply", 8.0 + k)) for k in range(3)}


@pytest.fixture(scope="module")
def drawn(sources, tmp_path_factory):
    path = tmp_path_factory.mktemp("drawn") / "s.json.gz"
    assert generate_files(sources, path, CONFIG, workers=1).kept == 0
    return path


def contents(path):
    files = [path, *sorted((path.parent / "content").iterdir())]
    return {file.name: file.read_bytes() for file in files}


def test_columns_and_objects_give_the_same_text(corner):
    table = generate_table(corner, 'a "quoted" naïve/scene.glb', 40, seed=5)
    nan = np.where(np.arange(40) == 3, np.nan, table.geodesic_distance)
    table = EpisodeTable(table.scene_ids, **{**table.to_arrays(), "geodesic_distance": nan})
    import json

    from prnav.episodes.episode import episode_to_record

    want = [json.dumps(episode_to_record(episode)) for episode in table.to_episodes()]
    assert list(table.to_json()) == want


def test_a_streamed_file_reads_as_a_saved_one(corner, tmp_path):
    table = generate_table(corner, "corner", 2100, seed=5)  # more than one piece of the writer
    header = {"prnav": {"seed": 5}, "other": "episodes"}
    write_episode_stream(tmp_path / "stream.json.gz", header, table.to_json())
    save_episodes(EpisodeDataset(tuple(table.to_episodes()), header), tmp_path / "saved.json.gz")
    assert gzip.decompress((tmp_path / "stream.json.gz").read_bytes()) == gzip.decompress(
        (tmp_path / "saved.json.gz").read_bytes()
    )
    assert read_header(tmp_path / "stream.json.gz") == header
    write_episode_stream(tmp_path / "empty.json.gz", {}, ())
    assert read_header(tmp_path / "empty.json.gz") == {}
    assert read_header(tmp_path / "missing.json.gz") is None
    (tmp_path / "damaged.json.gz").write_bytes((tmp_path / "stream.json.gz").read_bytes()[:30])
    assert read_header(tmp_path / "damaged.json.gz") is None


def test_pieces_are_those_of_the_whole(corner):
    whole = generate_table(corner, "corner", CHUNK + 100, seed=1)
    pieces = list(generate_chunks(corner, "corner", CHUNK + 100, seed=1))
    assert [len(piece) for piece in pieces] == [CHUNK, 100]
    few = generate_table(corner, "corner", 100, seed=1)
    np.testing.assert_array_equal(whole.start_position[:100], few.start_position)
    np.testing.assert_array_equal(whole.episode_ids[[0, -1]], ["0", str(CHUNK + 99)])
    np.testing.assert_array_equal(whole.goal_position[CHUNK:], pieces[1].goal_position)


def test_each_scene_has_its_file_and_all_are_read(sources, drawn):
    assert sorted(contents(drawn)) == ["0.json.gz", "1.json.gz", "2.json.gz", "s.json.gz"]
    table, header = load_episode_table(drawn)
    assert len(table) == 210 and table.scene_ids == tuple(sources)
    assert set(header["prnav"]["scenes"]) == set(sources)
    assert load_episodes(drawn.parent).scene_ids == tuple(sources)


def test_processes_write_the_same_files(sources, drawn, tmp_path):
    seen = []
    assert (
        generate_files(sources, tmp_path / "s.json.gz", CONFIG, 2, lambda name, count: seen.append((name, count))).kept
        == 0
    )
    assert contents(tmp_path / "s.json.gz") == contents(drawn)
    assert sorted(seen) == [(name, 70) for name in sources]


def test_what_was_done_before_an_interruption_is_kept(sources, drawn, tmp_path):
    path = tmp_path / "s.json.gz"

    def stop(name, count):
        if name == "1.ply":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate_files(sources, path, CONFIG, 1, stop)
    content = tmp_path / "content"
    assert [file.name for file in content.iterdir()] == ["0.json.gz"] and not path.exists()
    with pytest.raises(EpisodeError):
        load_episodes(tmp_path)
    (content / ".1.json.gz.abc.tmp.gz").write_bytes(b"left by a killed process")
    before = (content / "0.json.gz").stat().st_mtime_ns
    assert generate_files(sources, path, CONFIG, 1).kept == 1
    assert (content / "0.json.gz").stat().st_mtime_ns == before
    assert contents(path) == contents(drawn)


@pytest.mark.parametrize("change", [{"per_scene": 71}, {"seed": 3}, {"up": "z"}])
def test_files_drawn_otherwise_are_drawn_anew(sources, drawn, tmp_path, change):
    path = tmp_path / "s.json.gz"
    (tmp_path / "content").mkdir()
    for name, data in contents(drawn).items():
        (path if name == path.name else tmp_path / "content" / name).write_bytes(data)
    assert generate_files(sources, path, CONFIG, 1).kept == 3
    config = BulkConfig(**{"per_scene": 70, "seed": 2, **change})
    if "up" in change:  # these floors stand upright then
        with pytest.raises(NavMeshError, match="no floor that a body of radius"):
            generate_files(sources, path, config, 1)
        return
    assert generate_files(sources, path, config, 1).kept == 0
    assert len(load_episode_table(path)[0]) == 3 * config.per_scene


def test_an_error_in_a_process_is_told_as_it_is(sources, tmp_path):
    broken = tmp_path / "broken.ply"
    broken.write_text("ply\n")
    with pytest.raises(Exception, match=r"broken\.ply") as error:
        generate_files({**sources, "broken.ply": str(broken)}, tmp_path / "s.json.gz", CONFIG, 2)
    assert type(error.value).__name__ == "SceneError"
    assert not (tmp_path / "s.json.gz").exists()


@pytest.mark.slow
def test_a_killed_run_leaves_whole_files_and_no_processes(sources, tmp_path):
    command = [sys.executable, "-c", "from prnav.cli.episodes import main; main()", "generate", "--split", "s"]
    command += ["--per-scene", "40000", "--out", str(tmp_path), "--workers", "2"]
    for source in sources.values():
        command += ["--scene", source]
    process = subprocess.Popen(command, start_new_session=True)
    content = tmp_path / "s" / "content"
    deadline = time.monotonic() + 120
    while not (content.is_dir() and any(not f.name.startswith(".") for f in content.iterdir())):
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    while True:  # the workers notice that nobody listens
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            break
        assert time.monotonic() < deadline
        time.sleep(0.1)
    done = [file for file in content.iterdir() if not file.name.startswith(".")]
    assert done and not (tmp_path / "s" / "s.json.gz").exists()
    times = {file: file.stat().st_mtime_ns for file in done}
    assert subprocess.run(command, capture_output=True, check=True).stdout.endswith(b"of them there already\n")
    assert all(file.stat().st_mtime_ns == at for file, at in times.items())
    assert sorted(file.name for file in content.iterdir()) == ["0.json.gz", "1.json.gz", "2.json.gz"]
    table, _ = load_episode_table(tmp_path / "s")
    assert len(table) == 120_000
