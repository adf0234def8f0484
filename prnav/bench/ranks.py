"""Two workers of a run beside one: the quick-start at the same number of environments per worker.

A worker has one core (``threads=1``, its environments in one group), alone or beside another, as torchrun would start
it: what is measured is how much a second core with a second worker brings. By the clock, since waiting is what it is
about; the two take turns, and the best of each counts, since other work on the machine only slows down.

``python -m prnav.bench.ranks FOLDER UPDATES`` is one worker, with torchrun's variables; the first prints steps/s.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from prnav.bench.table import Row, device_name, row
from prnav.errors import WorkerError

TURNS = 3
"""Times that each is measured."""
UPDATES_PER_SECOND = 0.5
"""Of one worker, about."""


def measure_ranks(seconds: float) -> list[Row]:
    """Rows of one worker and of two, each measured ``TURNS`` times for about so many seconds."""
    updates = max(2, round(seconds * UPDATES_PER_SECOND))
    speeds: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(TURNS):
        for size, seen in speeds.items():
            seen.append(run_workers(size, updates))
    one, two = max(speeds[1]), max(speeds[2])
    return [
        row("train", "one_rank", one, "steps/s", device_name(1)),
        row("train", "two_ranks", two, "steps/s", device_name(2)),
        row("train", "two_ranks_over_one", two / one, "x", device_name(2)),
    ]


def run_workers(size: int, updates: int) -> float:
    """Steps per second of ``size`` workers together.

    Raises:
        WorkerError: one of them failed.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    common = {"WORLD_SIZE": str(size), "LOCAL_WORLD_SIZE": str(size), "OMP_NUM_THREADS": "1"}
    common |= {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
    with tempfile.TemporaryDirectory() as folder:
        processes = [
            subprocess.Popen(
                [sys.executable, "-m", "prnav.bench.ranks", folder, str(updates)],
                env={**os.environ, **common, "RANK": str(rank), "LOCAL_RANK": str(rank)},
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            for rank in range(size)
        ]
        results = [process.communicate() for process in processes]
    for process, (_, error) in zip(processes, results, strict=True):
        if process.returncode:
            raise WorkerError(f"a worker of the benchmark failed: {' '.join(error.split())[-300:]}")
    return float(results[0][0])


def work(folder: Path, updates: int) -> float:
    """Steps per second of all workers, as one of them; the first update compiles and does not count."""
    from prnav.domains.navigation.pointgoal import PointGoalNavVectorEnv
    from prnav.train import RunFolder, Trainer, join_workers, load_train_config

    config = load_train_config("quickstart", ("env.max_scenes=12", "imitation.expert_end=1.0", "threads=1", "groups=1"))
    workers = join_workers()
    envs = PointGoalNavVectorEnv(config.num_envs, config.env)
    trainer = Trainer(config, envs, RunFolder(folder / "run"), workers=workers)
    steps, begin = 0, 0.0
    for update in range(updates + 1):
        if update == 1:
            workers.gather(True)
            steps, begin = 0, time.perf_counter()
        trainer.collect(1.0)
        trainer.estimate_advantages()
        trainer.update("imitation")
        steps += trainer.rollout.steps * trainer.rollout.environments
    total = sum(workers.gather(steps))
    speed = total / (time.perf_counter() - begin)
    trainer.close()
    workers.leave()
    return speed


if __name__ == "__main__":
    result = work(Path(sys.argv[1]), int(sys.argv[2]))
    if os.environ["RANK"] == "0":
        sys.stdout.write(f"{result}\n")
