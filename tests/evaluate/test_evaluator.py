import json

import numpy as np
import pytest

from prnav.contracts import Turn
from prnav.domains.navigation.agents import (
    FORWARD,
    LEFT,
    RIGHT,
    STOP,
    ForwardAgent,
    GoalFollowerAgent,
    RandomNavigator,
    ShortestPathAgent,
)
from prnav.errors import RecordError
from prnav.evaluate.records import (
    RecordWriter,
    find_evaluations,
    load_evaluation,
    load_traces,
)
from prnav.play import TraceRecorder, play

HEADER = {"agent": "random", "actions": "sampled", "seed": 3, "split": "plane"}


def evaluate(slots, directory, agent=None, stop_after=None, header=HEADER):
    """Play all episodes into a folder, or the first few and then die without a word."""
    order = list(slots.episode_ids)
    with RecordWriter(directory, header) as writer:
        todo = [i for i, episode in enumerate(order) if episode not in writer.rows]

        def keep(played):
            writer.add(played)
            if stop_after is not None and len(writer.rows) + len(writer._block) >= stop_after:
                raise KeyboardInterrupt

        play(agent or RandomNavigator(), slots, todo, 3, [TraceRecorder(keep)])
        return writer.finish(order, {})


def turn(pointgoal):
    count = len(pointgoal)
    return Turn(
        {"pointgoal": np.array(pointgoal, dtype=np.float32)},
        np.zeros(count, bool),
        np.ones(count, bool),
        np.arange(count, dtype=np.uint64),
        np.zeros(count, np.int64),
    )


def test_reference_agents_do_what_their_papers_say():
    far_left, far_right, ahead, there = [2.0, 0.5], [2.0, -0.5], [2.0, 0.1], [0.19, 3.0]
    actions = GoalFollowerAgent().act(turn([far_left, far_right, ahead, there]))
    assert actions.tolist() == [LEFT, RIGHT, FORWARD, STOP]
    assert ForwardAgent().act(turn([far_left, there])).tolist() == [FORWARD, STOP]
    drawn = RandomNavigator().act(turn([ahead] * 3000 + [there]))
    assert drawn[-1] == STOP
    assert set(drawn[:-1].tolist()) == {FORWARD, LEFT, RIGHT}
    np.testing.assert_allclose(np.bincount(drawn[:-1])[1:] / 3000, 1 / 3, atol=0.04)
    oracle = ShortestPathAgent(lambda: np.array([2]))
    assert oracle.act(turn([ahead])).tolist() == [2]


def test_each_episode_is_played_once(plane, tmp_path):
    slots = plane(7)
    evaluation = evaluate(slots, tmp_path)
    assert sorted(slots.begun) == list(range(40))
    assert [(row["scene_id"], row["episode_id"]) for row in evaluation.rows] == list(slots.episode_ids)


@pytest.mark.parametrize("agent", [RandomNavigator(), GoalFollowerAgent()], ids=["random", "goal-follower"])
def test_records_are_the_same_bytes_for_any_number_of_slots(plane, tmp_path, agent):
    for count in (1, 8, 64):
        evaluate(plane(count), tmp_path / str(count), agent)
    for name in ("records.jsonl", "trajectories.npz", "evaluation.json"):
        contents = {(tmp_path / str(count) / name).read_bytes() for count in (1, 8, 64)}
        assert len(contents) == 1, name


def test_trajectories_retell_the_records(plane, tmp_path):
    slots = plane(5)
    evaluation = evaluate(slots, tmp_path)
    trajectories = load_traces(load_evaluation(tmp_path))
    for i, (row, trajectory) in enumerate(zip(evaluation.rows, trajectories, strict=True)):
        assert len(trajectory) == row["steps"] == len(trajectory["positions"]) - 1 == len(trajectory["yaws"]) - 1
        assert trajectory["collisions"].sum() == row["collisions"]
        np.testing.assert_array_equal(trajectory["positions"][0], slots.starts[i])
        distance = np.linalg.norm(slots.goals[i] - trajectory["positions"][-1])
        assert distance == pytest.approx(row["distance_to_goal"], abs=1e-12)


def test_a_killed_evaluation_goes_on_and_ends_with_the_same_bytes(plane, tmp_path, monkeypatch):
    monkeypatch.setattr("prnav.evaluate.records.BLOCK_EPISODES", 6)
    evaluate(plane(8), tmp_path / "whole")
    killed = tmp_path / "killed"
    for stop_after in (9, 20, 33):
        with pytest.raises(KeyboardInterrupt):
            evaluate(plane(4), killed, stop_after=stop_after)
        with open(killed / "records.jsonl", "a") as file:
            file.write('{"scene_id": "plane/0", "episo')  # a row the kill cut short
    with pytest.raises(RecordError, match="is unfinished; give the same prnav-eval command"):
        load_evaluation(killed)
    last = plane(3)
    evaluate(last, killed)
    assert 0 < len(last.begun) < 40
    for name in ("records.jsonl", "trajectories.npz", "evaluation.json"):
        assert (killed / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name
    assert not (killed / "trajectories.partial").exists()


def test_a_finished_evaluation_is_made_anew(plane, tmp_path):
    evaluate(plane(4), tmp_path)
    again = plane(4)
    evaluate(again, tmp_path, ForwardAgent(), header={**HEADER, "agent": "forward"})
    assert len(again.begun) == 40
    assert load_evaluation(tmp_path).header["agent"] == "forward"


def test_unfinished_work_of_another_evaluation_is_not_mixed_in(plane, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        evaluate(plane(4), tmp_path, stop_after=9)
    with pytest.raises(RecordError, match="unfinished evaluation with another seed; run that one to its end, give"):
        RecordWriter(tmp_path, {**HEADER, "seed": 4})
    with RecordWriter(tmp_path, {**HEADER, "seed": 4}, restart=True) as writer:
        assert writer.rows == {}


def test_two_evaluations_in_one_folder_are_refused(tmp_path):
    with RecordWriter(tmp_path, HEADER), pytest.raises(RecordError, match="another evaluation writes here"):
        RecordWriter(tmp_path, HEADER)


def test_broken_records_are_named_with_the_remedy(plane, tmp_path):
    with pytest.raises(RecordError, match=r"evaluation\.json: cannot be read .*; evaluate again with prnav-eval"):
        load_evaluation(tmp_path / "nothing")
    evaluation = evaluate(plane(4), tmp_path)
    records = tmp_path / "records.jsonl"
    text = records.read_text()
    records.write_text("".join(text.splitlines(keepends=True)[:-1]))
    with pytest.raises(RecordError, match="39 rows where evaluation.json says 40"):
        load_evaluation(tmp_path)
    records.write_text(text.replace("{", "[", 1))
    with pytest.raises(RecordError, match=r"records\.jsonl: line 1 is not a record; evaluate again"):
        load_evaluation(tmp_path)
    (tmp_path / "trajectories.npz").write_bytes(b"PK")
    with pytest.raises(RecordError, match=r"trajectories\.npz: cannot be read"):
        load_traces(evaluation)
    (tmp_path / "evaluation.json").write_text(json.dumps({**evaluation.header, "format": 99}))
    with pytest.raises(RecordError, match="format 99 is newer than 1, the newest known; update prnav"):
        load_evaluation(tmp_path)
    (tmp_path / "evaluation.json").write_text("[]")
    with pytest.raises(RecordError, match="it holds .*, which is not an object"):
        load_evaluation(tmp_path)


def test_evaluations_of_a_run_are_found(plane, tmp_path):
    evaluate(plane(4), tmp_path / "run" / "eval" / "test")
    assert find_evaluations(tmp_path / "run") == [tmp_path / "run" / "eval" / "test"]
    assert find_evaluations(tmp_path / "run" / "eval" / "test") == [tmp_path / "run" / "eval" / "test"]
    assert find_evaluations(tmp_path) == []
