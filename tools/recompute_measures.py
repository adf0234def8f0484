"""Compute success, SPL and SoftSPL again from recorded trajectories, on their own.

    python tools/recompute_measures.py runs/quickstart/eval/test-sampled

Nothing of the evaluation is used: positions and actions are read from ``trajectories.npz``, starts and goals from
``records.jsonl``, geodesic distances are asked of the scenes' navmeshes point by point, and the formulas stand below.
Prints the largest differences to the recorded numbers; exit status 1 if any is above 1e-9.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

import prnav

TOLERANCE = 1e-9
STOP = 0


def recompute(folder: Path, up: str = "y", scene_files: dict[str, str] | None = None) -> dict[str, float]:
    """Largest absolute difference between recorded and recomputed measures, by measure."""
    head = json.loads((folder / "evaluation.json").read_text())
    rows = [json.loads(line) for line in (folder / "records.jsonl").read_text().splitlines()]
    stored = np.load(folder / "trajectories.npz", allow_pickle=False)
    ends = np.cumsum(stored["steps"])
    floors: dict[str, prnav.NavMesh] = {}
    worst = dict.fromkeys(("success", "spl", "soft_spl", "soft_spl_closest"), 0.0)
    for i, row in enumerate(rows):
        assert (row["scene_id"], row["episode_id"]) == (stored["scene_id"][i], stored["episode_id"][i])
        begin = ends[i] - stored["steps"][i]
        positions = stored["positions"][begin + i : ends[i] + i + 1]
        actions = stored["actions"][begin : ends[i]]
        scene = row["scene_id"]
        if scene not in floors:
            mesh = prnav.load_scene((scene_files or {}).get(scene, scene), up=up)
            floors[scene] = prnav.load_navmesh(mesh, prnav.NavMeshSettings(**head["env"]["navmesh"]))
        left = floors[scene].distances(positions, row["goal"])
        values = measures(head, positions, actions, left, float(left[0]))
        for name, value in values.items():
            worst[name] = max(worst[name], abs(float(row[name]) - value))
    return worst


def measures(head: dict, positions: np.ndarray, actions: np.ndarray, left: np.ndarray, shortest: float) -> dict:
    """The formulas: Anderson et al. 2018 (SPL) and Datta et al. 2020 (SoftSPL), for one episode."""
    taken = sum(float(np.sqrt(((b - a) ** 2).sum())) for a, b in zip(positions[:-1], positions[1:], strict=True))
    near = left[-1] <= head["rules"]["success_distance"]
    success = float(near if head["task"] == "targetnav" else near and actions[-1] == STOP)
    direct = shortest / max(shortest, taken)
    return {
        "success": success,
        "spl": success * direct,
        "soft_spl": max(0.0, 1.0 - left[-1] / shortest) * direct,
        "soft_spl_closest": max(0.0, 1.0 - left.min() / shortest) * direct,
    }


def main() -> int:
    """Entry point."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("folder", type=Path, help="an evaluation's folder, RUN/eval/NAME")
    p.add_argument("--up", default="y", choices=("y", "z"), help="up axis of mesh files")
    p.add_argument("--scene", nargs=2, action="append", default=[], metavar=("ID", "FILE"), help="mesh of a scene id")
    options = p.parse_args()
    worst = recompute(options.folder, options.up, dict(options.scene))
    for name, value in worst.items():
        print(f"{name:18} largest difference {value:.3g}")
    return int(max(worst.values()) > TOLERANCE)


if __name__ == "__main__":
    sys.exit(main())
