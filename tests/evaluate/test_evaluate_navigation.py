"""The evaluation of real episodes in one built-in home."""

import numpy as np
import pytest

from prnav.catalog import task_spec
from prnav.domains.navigation.maps import load_maps
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig
from prnav.evaluate.evaluation import evaluate, load_questions
from prnav.evaluate.records import load_evaluation, load_traces


@pytest.fixture(scope="module")
def config():
    return PointGoalEnvConfig(scenes="val", max_scenes=1, vision=False)


@pytest.fixture(scope="module")
def questions(config):
    return load_questions(task_spec("pointgoal"), config, limit=12)


def test_the_oracle_always_arrives_and_hardly_wastes_a_step(questions, config, tmp_path):
    evaluation = evaluate(questions, config, tmp_path, agent="shortest-path", num_envs=12)
    assert evaluation.header["measures"]["success"]["mean"] == 1.0
    assert evaluation.header["measures"]["spl"]["mean"] > 0.9
    assert evaluation.header["episodes"] == 12
    assert evaluation.header["env"]["sim"]["sliding"] is True


def test_records_are_the_same_bytes_for_batches_of_1_8_and_64(questions, config, tmp_path):
    for count in (1, 8, 64):
        evaluate(questions, config, tmp_path / str(count), agent="random", num_envs=count, seed=5)
    for name in ("records.jsonl", "trajectories.npz", "maps.npz", "evaluation.json"):
        assert len({(tmp_path / str(count) / name).read_bytes() for count in (1, 8, 64)}) == 1, name
    other = evaluate(questions, config, tmp_path / "other", agent="random", seed=6)
    assert other.rows != load_evaluation(tmp_path / "1").rows


def test_measures_follow_from_the_trajectories(questions, config, tmp_path):
    evaluation = evaluate(questions, config, tmp_path, agent="goal-follower")
    source = questions.world
    for row, trajectory in zip(evaluation.rows, load_traces(evaluation), strict=True):
        navmesh = source.world.navmeshes[source.world.index[row["scene_id"]]]
        shortest = navmesh.distance(row["start"], row["goal"])
        left = navmesh.distance(trajectory["positions"][-1], row["goal"])
        taken = np.linalg.norm(np.diff(trajectory["positions"], axis=0), axis=1).sum()
        success = trajectory["actions"][-1] == 0 and left <= 0.2
        assert row["success"] == success
        assert row["spl"] == pytest.approx(success * shortest / max(shortest, taken), abs=1e-9)
        soft = max(0.0, 1.0 - left / shortest) * shortest / max(shortest, taken)
        assert row["soft_spl"] == pytest.approx(soft, abs=1e-9)
        assert row["collisions"] == trajectory["collisions"].sum()


def test_trajectories_stay_on_the_floor_plans(questions, config, tmp_path):
    evaluation = evaluate(questions, config, tmp_path, agent="random")
    (floor,) = load_maps(tmp_path)
    assert floor.scene_id == questions.world.world.scene_ids[0]
    points = np.concatenate([t["positions"] for t in load_traces(evaluation)])
    x, z = floor.origin
    columns = np.floor((points[:, 0] - x) / floor.metres_per_pixel).astype(int)
    rows = np.floor((points[:, 2] - z) / floor.metres_per_pixel).astype(int)
    height, width = floor.walkable.shape
    grown = np.pad(floor.walkable, 2)
    grown = np.any([np.roll(grown, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)
    assert grown[np.clip(rows, 0, height) + 2, np.clip(columns, 0, width) + 2].all()
