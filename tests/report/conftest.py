"""A run directory with a made-up evaluation and metrics."""

import json

import numpy as np
import pytest

from prnav.contracts import Played, Trace
from prnav.domains.navigation.maps import FloorMap, save_maps
from prnav.evaluate.records import RecordWriter
from prnav.evaluate.summary import summarise


def write_evaluation(directory, agent, actions="greedy", episodes=9, floors=(0.0,), starts=False, **header):
    generator = np.random.default_rng(len(agent))
    order = [("home/<1>", str(i)) for i in range(episodes)]
    with RecordWriter(directory, {"agent": agent, "actions": actions, "split": "test", **header}) as writer:
        for i, (scene, episode) in enumerate(order):
            steps = 10 + i
            turns = np.cumsum(generator.normal(0, 0.5, steps))
            moves = 0.25 * np.stack([np.sin(turns), 0 * turns, np.cos(turns)], axis=1)
            positions = np.concatenate([np.zeros((1, 3)), np.cumsum(moves, axis=0)])
            trace = Trace(
                {"positions": positions, "yaws": np.zeros(steps + 1)},
                {"actions": np.ones(steps, np.int8), "collisions": generator.random(steps) < 0.2},
            )
            row = {
                "scene_id": scene,
                "episode_id": episode,
                "success": int(i % 2),
                "spl": i / episodes,
                "soft_spl": i / episodes,
                "distance_to_goal": None if i == 0 else float(episodes - i),
                "collisions": int(trace["collisions"].sum()),
                "steps": steps,
                "geodesic_distance": 5.0,
                "goal": [2.0, 0.0, 2.0],
            }
            if starts:
                row |= {"start": [0.0, 0.0, 0.1 * i], "geodesic_distance": 3.0 + i}
            writer.add(Played(i, row, trace))
        measures = {key: vars(value) for key, value in summarise(writer.all_rows(order), resamples=50).items()}
        plan = np.ones((60, 80), bool)
        save_maps(directory, [FloorMap("home/<1>", height, (-3.0, -3.0), 0.1, plan) for height in floors])
        return writer.finish(order, {"measures": measures})


@pytest.fixture
def make_evaluation():
    return write_evaluation


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "run"
    write_evaluation(folder / "eval" / "test-greedy", "run")
    rows = [
        {"step": 100 * i, "measures": {"spl": i / 50, "success": i / 40}, "times": {"steps_per_second": 900.0}}
        for i in range(1, 41)
    ]
    (folder / "metrics.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    (folder / "run.json").write_text(json.dumps({"warm_start": "none", "seed": 0}))
    return folder
