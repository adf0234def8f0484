import dataclasses

import numpy as np
import pytest

from prnav.episodes import (
    check_scenes,
    concatenate_tables,
    generate_table,
    load_builtin_episodes,
    load_builtin_table,
    make_header,
    train_table,
)
from prnav.episodes.check import duplicate_ids, misplaced
from prnav.errors import EpisodeError
from prnav.navmesh import NavMeshSettings, load_navmesh
from prnav.scene import load_scene, scene_ids


@pytest.mark.parametrize(("split", "scenes"), [("val", 8), ("test", 18)])
def test_shipped_episodes_are_56_in_each_house(split, scenes):
    dataset = load_builtin_episodes(split)
    assert dataset.scene_ids == tuple(scene_ids(split))
    assert len(dataset.episodes) == scenes * 56
    distances = np.array([episode.geodesic_distance for episode in dataset.episodes])
    assert distances.min() >= 1.0 and distances.max() <= 30.0
    assert set(dataset.header["prnav"]["scenes"]) == set(scene_ids(split))


def test_shipped_episodes_belong_to_the_houses_as_they_are():
    table, header = load_builtin_table("val", max_scenes=1)
    scene = load_scene("prhouses/val/00")
    check_scenes(header, {"prhouses/val/00": scene}, "val")
    assert len(table) == 56 and table.scene_ids == ("prhouses/val/00",)
    navmesh = load_navmesh(scene)
    assert misplaced(table, "prhouses/val/00", navmesh) == []
    np.testing.assert_allclose(
        navmesh.distances(table.start_position, table.goal_position), table.geodesic_distance, rtol=1e-6
    )


def test_another_scene_under_the_same_name_is_refused(slabs):
    header = make_header(NavMeshSettings(), "y", 0, {"a.glb": "0123456789abcdef"})
    with pytest.raises(EpisodeError, match=r"set: its episodes in a.glb belong to a scene with hash 0123456789ab"):
        check_scenes(header, {"a.glb": slabs((0, 1, 0, 1, 0))}, "set")
    check_scenes({}, {"a.glb": slabs((0, 1, 0, 1, 0))}, "a data set of Habitat's")
    with pytest.raises(EpisodeError, match="header key 'prnav' is 5"):
        check_scenes({"prnav": 5}, {}, "set")


def test_train_episodes_are_drawn_once_and_kept(corner, slabs, tmp_path, monkeypatch):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path))
    scene = slabs((0, 10, 0, 2, 0))
    first = train_table("corner", 5, 0, scene, corner)
    assert len(list((tmp_path / "episodes").iterdir())) == 1
    again = train_table("corner", 5, 0, scene, corner)
    for name, values in first.to_arrays().items():
        np.testing.assert_array_equal(values, again.to_arrays()[name])
    assert not np.array_equal(train_table("corner", 5, 1, scene, corner).start_position, first.start_position)


def test_unknown_splits_are_named():
    with pytest.raises(EpisodeError, match="no built-in episodes 'dev'; valid: train, val, test"):
        load_builtin_episodes("dev")


def test_check_finds_what_cannot_be_played(corner):
    table = generate_table(corner, "corner", 6, 0)
    starts, goals = table.start_position.copy(), table.goal_position.copy()
    starts[1] = [500.0, 0.0, 0.0]
    goals[2] = [20.8, 2.0, 0.8]
    ids = table.episode_ids.copy()
    ids[4] = ids[3]
    bad = dataclasses.replace(table, start_position=starts, goal_position=goals, episode_ids=ids)
    assert misplaced(bad, "corner", corner) == [
        "corner: episode '1': start farther than 0.5 m from the floor",
        "corner: episode '2': its goal cannot be reached from its start",
    ]
    assert duplicate_ids(bad) == ["corner: episode id '3' stands 2 times"]
    assert duplicate_ids(table) == []


def test_tables_of_several_scenes_keep_their_scenes(corner):
    parts = [generate_table(corner, name, 2, 0) for name in ("a", "b", "a")]
    table = concatenate_tables(parts)
    assert table.scene_ids == ("a", "b")
    assert [table.scene_id(row) for row in range(6)] == ["a", "a", "b", "b", "a", "a"]
