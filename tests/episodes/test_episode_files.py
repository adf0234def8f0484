import copy
import gzip
import json
import math
import os

import pytest

from prnav.episodes import EpisodeDataset, EpisodeTable, load_episode_table, load_episodes, save_episodes
from prnav.episodes import files as episode_files_module
from prnav.errors import EpisodeError

RECORD = {
    "episode_id": "7",
    "scene_id": "gibson/Pablo.glb",
    "start_room": None,
    "start_position": [1, 0.5, -2.25],
    "start_rotation": [0, 0.6, 0, -0.8],
    "info": {"geodesic_distance": 3.5, "note": ["kept"]},
    "goals": [{"radius": 0.2, "position": [3.0, 0.5, -2.0], "colour": "green"}],
    "shortest_paths": None,
}
OTHER = {
    "scene_id": "gibson/Mosquito.glb",
    "episode_id": 3,
    "start_position": [0.0, 0.0, 0.0],
    "start_rotation": [0, 0, 0, 1],
    "info": None,
    "goals": [{"position": [1e-7, 0, 1]}],
}


def write(path, values):
    text = values if isinstance(values, bytes) else json.dumps(values).encode()
    path.write_bytes(gzip.compress(text) if path.name.endswith(".gz") else text)
    return path


def test_every_key_and_its_order_survive_to_the_byte(tmp_path):
    values = {"version": 3, "episodes": [RECORD, OTHER]}
    source = write(tmp_path / "a.json", values)
    dataset = load_episodes(source)
    assert dataset.header == {"version": 3}
    save_episodes(dataset, tmp_path / "b.json")
    assert (tmp_path / "b.json").read_bytes() == source.read_bytes()
    first, second = dataset.episodes
    assert first.extra == {"start_room": None, "shortest_paths": None}
    assert first.goals[0].extra == {"colour": "green"}
    assert (second.episode_id, second.info, second.goals[0].radius) == ("3", {}, None)
    assert first.start_yaw == pytest.approx(2 * math.atan2(-0.6, 0.8))


def test_packed_files_are_the_same_bytes_every_time(tmp_path):
    dataset = load_episodes(write(tmp_path / "a.json", {"episodes": [RECORD]}))
    save_episodes(dataset, tmp_path / "b.json.gz")
    save_episodes(dataset, tmp_path / "other" / "c.json.gz")
    assert (tmp_path / "b.json.gz").read_bytes() == (tmp_path / "other" / "c.json.gz").read_bytes()
    assert load_episodes(tmp_path / "b.json.gz") == dataset


def test_content_layout_goes_out_and_in(tmp_path):
    dataset = load_episodes(write(tmp_path / "a.json", {"made": "here", "episodes": [RECORD, OTHER]}))
    written = save_episodes(dataset, tmp_path / "val" / "val.json.gz", content=True)
    assert [path.relative_to(tmp_path).as_posix() for path in written] == [
        "val/content/Pablo.json.gz",
        "val/content/Mosquito.json.gz",
        "val/val.json.gz",
    ]
    again = load_episodes(tmp_path, "val")
    assert again.header == dataset.header
    assert sorted(again.episodes, key=lambda e: e.scene_id) == sorted(dataset.episodes, key=lambda e: e.scene_id)
    assert load_episodes(tmp_path / "val") == again == load_episodes(tmp_path / "val" / "val.json.gz")


def test_scenes_with_the_same_file_name_get_files_of_their_own(tmp_path):
    second = {**RECORD, "scene_id": "hm3d/Pablo.glb"}
    dataset = load_episodes(write(tmp_path / "a.json", {"episodes": [RECORD, second]}))
    save_episodes(dataset, tmp_path / "s" / "s.json.gz", content=True)
    assert len(load_episodes(tmp_path / "s").episodes) == 2


def broken(path, value):
    """The record with one key replaced; "..." removes it."""
    record = copy.deepcopy(RECORD)
    *parents, last = path
    target = record
    for key in parents:
        target = target[key]
    if value is ...:
        del target[last]
    else:
        target[last] = value
    return record


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["scene_id"], ..., "key 'scene_id' is missing"),
        (["start_position"], [1, 2], "'start_position' is [1, 2]; it must be a list of 3 finite numbers"),
        (["start_position"], [1, 2, math.nan], "'start_position' is [1, 2, nan]"),
        (["start_position"], [1, 2, math.inf], "'start_position' is [1, 2, inf]"),
        (["start_position"], [1, 2, True], "'start_position' is [1, 2, True]"),
        (["start_position"], [1, 2, 10**400], "'start_position' is [1, 2, 1000"),
        (["start_position"], "here", "'start_position' is 'here'"),
        (["start_rotation"], [0, 0, 0, 0], "it must be a unit quaternion x, y, z, w"),
        (["episode_id"], None, "'episode_id' is None; it must be a non-empty string"),
        (["scene_id"], "", "'scene_id' is ''"),
        (["info"], [1], "'info' is [1]; it must be an object"),
        (["info", "geodesic_distance"], math.nan, "'info.geodesic_distance' is nan"),
        (["info", "geodesic_distance"], "3", "'info.geodesic_distance' is '3'"),
        (["goals"], [], "'goals' is []; it must be a list with at least one goal"),
        (["goals"], [5], "'goals[0]' is 5; it must be an object"),
        (["goals", 0, "position"], ..., "key 'goals[0].position' is missing"),
        (["goals", 0, "radius"], -1.0, "'goals[0].radius' is -1.0"),
    ],
)
def test_a_broken_episode_names_file_place_and_key(tmp_path, path, value, text):
    file = write(tmp_path / "bad.json.gz", {"episodes": [RECORD, broken(path, value)]})
    with pytest.raises(EpisodeError) as error:
        load_episodes(file)
    assert text in str(error.value)
    assert f"{file}: episode 1" in str(error.value)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "not valid JSON"),
        (b"\xff\xfe\x00", "not valid JSON"),
        (b"[" * 100_000, "not valid JSON"),
        (b'{"episodes": [' + b"9" * 5000 + b"]}", "not valid JSON"),
        (b"[]", "no list 'episodes' at the top level"),
        (b'{"episodes": {}}', "no list 'episodes' at the top level"),
        (b'{"episodes": []}', "holds no episodes"),
        (b'{"episodes": [3]}', "episode 0 is 3; it must be an object"),
    ],
)
@pytest.mark.parametrize("name", ["x.json", "x.json.gz"])
def test_a_broken_file_is_one_clear_error(tmp_path, name, content, text):
    with pytest.raises(EpisodeError, match="x.json") as error:
        load_episodes(write(tmp_path / name, content))
    assert text in str(error.value)


def test_damaged_gzip_is_said_so(tmp_path):
    whole = gzip.compress(json.dumps({"episodes": [RECORD] * 50}).encode())
    for damaged in (whole[: len(whole) // 2], whole[:-4] + b"\0\0\0\0", whole[:30] + b"\xaa" * 40 + whole[70:]):
        (tmp_path / "x.json.gz").write_bytes(damaged)
        with pytest.raises(EpisodeError, match="damaged gzip|not valid JSON"):
            load_episodes(tmp_path / "x.json.gz")


def test_a_gzip_bomb_is_refused_before_it_unpacks(tmp_path, monkeypatch):
    monkeypatch.setattr(episode_files_module, "RATIO_FREE_BYTES", 1 << 20)
    file = write(tmp_path / "bomb.json.gz", b" " * (8 << 20))
    with pytest.raises(EpisodeError, match="bytes unpack to more than"):
        load_episodes(file)


def test_missing_files_and_splits_are_named(tmp_path):
    with pytest.raises(EpisodeError, match="no such file or folder"):
        load_episodes(tmp_path / "nothing")
    with pytest.raises(EpisodeError, match="no episode file"):
        load_episodes(tmp_path)
    for split in ("val", "test"):
        save_episodes(EpisodeDataset(()), tmp_path / split / f"{split}.json.gz")
    with pytest.raises(EpisodeError, match="several splits here; valid: test, val"):
        load_episodes(tmp_path)
    with pytest.raises(EpisodeError, match="no split 'train' here; valid: test, val"):
        load_episodes(tmp_path, "train")
    with pytest.raises(EpisodeError, match="episode files end in .json.gz or .json"):
        save_episodes(EpisodeDataset(()), tmp_path / "val.npz")


def test_columns_say_the_same_as_objects(tmp_path):
    file = write(tmp_path / "a.json", {"episodes": [RECORD, OTHER]})
    table, _ = load_episode_table(file)
    episodes = load_episodes(file).episodes
    assert table.scene_ids == ("gibson/Pablo.glb", "gibson/Mosquito.glb")
    for row, (column, episode) in enumerate(zip(table.to_episodes(), episodes, strict=True)):
        assert (column.episode_id, column.scene_id) == (episode.episode_id, episode.scene_id)
        assert column.start_position == episode.start_position
        assert column.goals[0].position == episode.goals[0].position
        assert table.start_yaw[row] == episode.start_yaw
    assert math.isnan(table.geodesic_distance[1]) and table.geodesic_distance[0] == 3.5


def test_several_goals_are_refused_as_point_goal_navigation(tmp_path):
    record = {**RECORD, "goals": RECORD["goals"] * 2}
    episodes = load_episodes(write(tmp_path / "a.json", {"episodes": [record]})).episodes
    with pytest.raises(EpisodeError, match="episode 7 in gibson/Pablo.glb has 2 goals"):
        EpisodeTable.from_episodes(episodes)


@pytest.fixture
def real(real_data):
    return os.path.join(real_data, "episodes")


def test_real_single_file_comes_back_to_the_byte(real, tmp_path):
    file = os.path.join(real, "gibson_v1_val_mini", "val_mini.json.gz")
    dataset = load_episodes(file)
    assert len(dataset.episodes) == 30
    save_episodes(dataset, tmp_path / "out.json")
    with gzip.open(file) as original:
        assert (tmp_path / "out.json").read_bytes() == original.read().rstrip()


def test_real_content_layout_comes_back_to_the_byte(real, tmp_path):
    dataset = load_episodes(os.path.join(real, "gibson_v2_val_mini"), "val_mini")
    assert len(dataset.episodes) == 172
    save_episodes(dataset, tmp_path / "val_mini" / "val_mini.json.gz", content=True)
    for scene in ("Greigsville", "Mosquito", "Pablo"):
        name = os.path.join("val_mini", "content", f"{scene}.json.gz")
        with gzip.open(os.path.join(real, "gibson_v2_val_mini", name)) as a, gzip.open(tmp_path / name) as b:
            assert json.load(a) == json.load(b)


def test_rotations_in_another_order_are_told_by_what_they_say(tmp_path):
    """Habitat writes x, y, z, w; a yaw in the order w, x, y, z would stand upside down or lie on its side."""
    record = {"episode_id": "0", "scene_id": "a.glb", "start_position": [0, 0, 0], "goals": [{"position": [1, 0, 1]}]}
    path = tmp_path / "e.json"
    for yaw in (0.0, 1.0, 3.0):
        half = yaw / 2
        good = [0.0, math.sin(half), 0.0, math.cos(half)]
        path.write_text(json.dumps({"episodes": [record | {"start_rotation": good}]}))
        assert load_episodes(path).episodes[0].start_yaw == pytest.approx(yaw)
        path.write_text(json.dumps({"episodes": [record | {"start_rotation": [good[3], *good[:3]]}]}))
        with pytest.raises(
            EpisodeError, match=r"e\.json.*'start_rotation'.*upright as w, x, y, z: put its first number"
        ):
            load_episodes(path)
