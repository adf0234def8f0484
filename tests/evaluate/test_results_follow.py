"""Result files, the independent script, workers and resuming, on real episodes in built-in homes."""

import dataclasses
import importlib.util
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from prnav.catalog import task_spec
from prnav.domains.navigation.benchmark import BENCHMARK
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig
from prnav.domains.navigation.sights import load_sights
from prnav.domains.navigation.targetnav import TargetNavConfig, TargetNavEnvConfig
from prnav.errors import CheckpointError, ConfigError, PrnavError, RecordError
from prnav.evaluate.evaluation import evaluate, load_questions
from prnav.evaluate.learned import load_run, recipe
from prnav.evaluate.records import load_evaluation
from prnav.evaluate.submission import verify_submission, write_submission
from prnav.policy import PolicyConfig
from prnav.train import PPOConfig, RunFolder, TrainConfig, Trainer

FILES = ("records.jsonl", "trajectories.npz", "maps.npz", "evaluation.json")


def script():
    path = Path(__file__).parents[2] / "tools" / "recompute_measures.py"
    spec = importlib.util.spec_from_file_location("recompute_measures", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def config():
    return PointGoalEnvConfig(scenes="val", max_scenes=2, grid=2, rays_per_receptor=1)


@pytest.fixture(scope="module")
def target(config):
    return TargetNavEnvConfig(
        scenes="val", max_scenes=2, grid=2, rays_per_receptor=1, rules=TargetNavConfig(max_steps=200)
    )


@pytest.fixture(scope="module")
def questions(config):
    return load_questions(task_spec("pointgoal"), config, limit=50)


@pytest.fixture(scope="module")
def hunt(questions, target):
    """The same episodes for the other task."""
    return dataclasses.replace(questions, task="targetnav", config=target)


@pytest.fixture(scope="module")
def evaluated(hunt, target, tmp_path_factory):
    folder = tmp_path_factory.mktemp("evaluated")
    return evaluate(hunt, target, folder, agent="wall-follower")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A TargetNav run that was saved before its first step."""
    from prnav.domains.navigation.env import NavigationVectorEnv

    env = TargetNavEnvConfig(
        scenes="val", max_scenes=1, grid=2, rays_per_receptor=1, rules=TargetNavConfig(max_steps=40)
    )
    policy = PolicyConfig(encoder="compact", width=16, lstm_hidden=16)
    config = TrainConfig(task="targetnav", num_envs=2, env=env, policy=policy, ppo=PPOConfig(mini_batches=1))
    folder = RunFolder(tmp_path_factory.mktemp("run"))
    trainer = Trainer(config, NavigationVectorEnv(2, env), folder, data={"benchmark": BENCHMARK})
    trainer.begin()
    trainer.close()
    return folder


@pytest.mark.parametrize("agent", ["goal-follower", "shortest-path"])
def test_an_independent_script_finds_the_same_measures(questions, config, tmp_path, agent):
    evaluate(questions, config, tmp_path, agent=agent)
    assert max(script().recompute(tmp_path).values()) <= 1e-9


def test_an_independent_script_finds_the_same_measures_of_targetnav(evaluated):
    assert 0.0 < evaluated.header["measures"]["success"]["mean"] < 1.0
    assert max(script().recompute(evaluated.directory).values()) <= 1e-9


def test_the_script_sees_a_wrong_number(evaluated, tmp_path):
    shutil.copytree(evaluated.directory, tmp_path / "copy")
    rows = [dict(row) for row in evaluated.rows]
    rows[3]["spl"] += 1e-6
    (tmp_path / "copy" / "records.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    assert script().recompute(tmp_path / "copy")["spl"] == pytest.approx(1e-6)


def test_workers_change_no_byte(hunt, target, run, tmp_path):
    trained, rules = load_run(run.path, print), dataclasses.replace(target, rules=TargetNavConfig(max_steps=40))
    for workers in (1, 2):
        folder = tmp_path / str(workers)
        evaluate(hunt, rules, folder, agent=trained, workers=workers, num_envs=13 * workers)
    for file in (*FILES, "sights.npz"):
        assert (tmp_path / "1" / file).read_bytes() == (tmp_path / "2" / file).read_bytes(), file
    sights, rows = load_sights(tmp_path / "2"), load_evaluation(tmp_path / "2").rows
    assert sights and all(seen.shape == (rows[index]["steps"] + 1, 2, 2, 2, 3) for index, seen in sights.items())


def test_an_agent_without_light_leaves_no_readings(evaluated):
    assert load_sights(evaluated.directory) == {}


def test_what_a_worker_meets_is_told(hunt, target, monkeypatch, tmp_path):
    monkeypatch.setattr("prnav.evaluate.workers.PATIENCE", 0.1)
    lost = dataclasses.replace(hunt, limit=30)  # workers load fewer episodes than they are asked to play
    with pytest.raises(PrnavError, match="a worker process of the evaluation ended with status 1; what is done is kep"):
        evaluate(lost, target, tmp_path, agent="forward", workers=2)


def test_a_result_file_says_what_it_is_of_and_holds(evaluated):
    path = write_submission(evaluated)
    assert path.stat().st_size < 8000
    told = json.loads(path.read_text())
    assert (told["benchmark"], told["task"], told["target"], told["sliding"]) == (
        BENCHMARK,
        "targetnav",
        "visible",
        True,
    )
    assert told["body"] == {"radius": 0.1, "height": 1.5}
    assert set(told["scenes"]) == {row["scene_id"] for row in evaluated.rows}
    assert verify_submission(path).rows == evaluated.rows


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "other"}, "no result of prnav; give a file that prnav-eval --submit wrote"),
        ({"format": 9}, "format 9; this version of prnav reads 1"),
        (
            {"benchmark": "prhouses-v999"},
            f"of benchmark prhouses-v999, and this version of prnav has {BENCHMARK}; ",
        ),
        ({"agent": "shortest-path"}, "'agent' is not that of the records"),
        ({"measures": {}}, "'measures' is not that of the records"),
        ({"sha256": {"records.jsonl": "0"}}, r"records\.jsonl is not the file it was computed from .SHA-256 differs"),
        ({"sha256": {"../evaluation.json": "0"}}, "'sha256' names '../evaluation.json'; valid: records.jsonl, traj"),
        ({"sha256": None}, "sha256 is None, which is not an object; make it anew"),
    ],
)
def test_a_changed_result_file_is_refused(evaluated, tmp_path, change, message):
    told = json.loads(write_submission(evaluated).read_text())
    path = tmp_path / "result.json"
    path.write_text(json.dumps({**told, **change}))
    with pytest.raises(RecordError, match=message):
        verify_submission(path, evaluated.directory)


def test_records_that_do_not_follow_from_their_trajectories_are_refused(evaluated, tmp_path):
    shutil.copytree(evaluated.directory, tmp_path / "copy")
    rows = [dict(row) for row in evaluated.rows]
    rows[2]["success"], rows[2]["spl"] = 1 - rows[2]["success"], 0.5
    records = tmp_path / "copy" / "records.jsonl"
    records.write_text("".join(json.dumps(row) + "\n" for row in rows))
    path = write_submission(load_evaluation(tmp_path / "copy"))
    with pytest.raises(RecordError, match=r"records\.jsonl: line 3: success is [01], and its trajectory gives"):
        verify_submission(path)


def test_a_result_that_is_no_mean_of_its_records_is_refused(evaluated, tmp_path):
    shutil.copytree(evaluated.directory, tmp_path / "copy")
    head = json.loads((tmp_path / "copy" / "evaluation.json").read_text())
    head["measures"]["spl"]["mean"] += 0.1
    (tmp_path / "copy" / "evaluation.json").write_text(json.dumps(head))
    path = write_submission(load_evaluation(tmp_path / "copy"))
    with pytest.raises(RecordError, match="spl mean is 0.[0-9]+, and the records give 0.[0-9]+"):
        verify_submission(path)


def test_a_run_of_another_benchmark_version_is_named(run, tmp_path):
    shutil.copytree(run.path, tmp_path / "old")
    path = tmp_path / "old" / "run.json"
    facts = json.loads(path.read_text())
    facts["data"]["benchmark"] = "prhouses-v999"
    path.write_text(json.dumps(facts))
    with pytest.raises(CheckpointError, match=f"trained for benchmark prhouses-v999, and this .* has {BENCHMARK}; "):
        load_run(tmp_path / "old", print)


def test_a_missing_checkpoint_is_named(run, tmp_path):
    shutil.copytree(run.path, tmp_path / "empty")
    for path in (tmp_path / "empty" / "checkpoints").iterdir():
        path.unlink()
    with pytest.raises(CheckpointError, match="no checkpoint in checkpoints/; start it anew with another --run"):
        load_run(tmp_path / "empty", print)


def test_a_run_is_evaluated_on_its_own_task_alone(run, questions, config, tmp_path):
    trained = load_run(run.path, print)
    with pytest.raises(ConfigError, match="is for targetnav and cannot be evaluated on pointgoal"):
        evaluate(questions, config, tmp_path, agent=trained)


def test_a_recipe_forgets_name_and_seed_alone(run):
    config = run.load_config()
    assert recipe(dataclasses.replace(config, seed=5, name="other", threads=1)) == recipe(config)
    assert recipe(dataclasses.replace(config, total_steps=5)) != recipe(config)


@pytest.mark.slow
def test_a_killed_evaluation_leaves_no_worker_and_goes_on(questions, target, tmp_path):
    """Kill the command while two workers play; nothing of it stays, and the same command ends with the same bytes."""
    asked = ["--agent", "random", "--task", "targetnav", "--split", "val", "--episodes", "160", "--workers", "2"]
    command = [sys.executable, "-m", "prnav.cli.eval", *asked, "--out", str(tmp_path / "killed")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    records = tmp_path / "killed" / "records.jsonl"
    while not (records.exists() and records.stat().st_size) and process.poll() is None:
        time.sleep(0.05)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    assert process.poll() is None and len(children) >= 2
    process.kill()
    process.communicate()
    for _ in range(200):
        if not any(Path(f"/proc/{child}").exists() for child in children):
            break
        time.sleep(0.1)
    assert not any(Path(f"/proc/{child}").exists() for child in children)
    assert 0 < len(records.read_text().splitlines()) < 160
    subprocess.run(command, check=True, capture_output=True)
    whole = [*command[:-3], "1", "--out", str(tmp_path / "whole")]
    subprocess.run(whole, check=True, capture_output=True)
    for file in FILES:
        assert (tmp_path / "killed" / file).read_bytes() == (tmp_path / "whole" / file).read_bytes(), file
