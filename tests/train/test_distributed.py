"""Several workers on one run, as processes on this machine."""

import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import torch
from worker_process import gradients

from prnav.train import RunFolder, Workers, read_metrics
from prnav.train.checkpoint import list_checkpoints
from prnav.train.distributed import checksum
from prnav.train.progress import RolloutProgress

SCRIPT = Path(__file__).parent / "worker_process.py"


def start(job: str, folder: Path, *arguments: str, size: int = 2) -> list[subprocess.Popen]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    common = {"WORLD_SIZE": str(size), "LOCAL_WORLD_SIZE": str(size), "MASTER_ADDR": "127.0.0.1"}
    common |= {"MASTER_PORT": str(port), "OMP_NUM_THREADS": "1"}
    return [
        subprocess.Popen(
            [sys.executable, str(SCRIPT), job, str(folder), *arguments],
            env={**os.environ, **common, "RANK": str(rank), "LOCAL_RANK": str(rank)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for rank in range(size)
    ]


def finish(processes: list[subprocess.Popen], status: int = 0) -> list[tuple[str, str]]:
    results = [process.communicate(timeout=120) for process in processes]
    assert [process.returncode for process in processes] == [status] * len(processes), results
    return results


def test_two_workers_have_the_gradients_of_one(tmp_path):
    """To float32 rounding: 1e-6 of the largest gradient; with shares of 2 and 6 environments.

    The same processes then check parameters that differ.
    """
    for _, error in finish(start("gradients", tmp_path), 2):
        assert "workers have different parameters at step 7" in error
    alone = gradients(Workers(), slice(0, 8))
    first, second = np.load(tmp_path / "0.npz"), np.load(tmp_path / "1.npz")
    scale = max(float(gradient.abs().max()) for gradient in alone)
    for name, gradient in zip(first.files, alone, strict=True):
        assert (first[name] == second[name]).all()
        np.testing.assert_allclose(first[name], gradient.numpy(), atol=1e-6 * scale)


def trace(folder: Path) -> list[dict]:
    return [{key: value for key, value in row.items() if key != "times"} for row in read_metrics(folder / "run")]


@pytest.mark.slow
def test_a_lost_worker_is_said_to_be_and_the_run_resumes_to_the_same_bits(tmp_path):
    (tmp_path / "broken").mkdir()
    processes = start("train", tmp_path / "broken", "1000000000", "1.0")
    while int(processes[0].stdout.readline()) < 5:
        pass
    processes[1].send_signal(signal.SIGKILL)
    _, error = processes[0].communicate(timeout=60)
    processes[1].communicate()
    assert processes[0].returncode == 2
    assert "worker 0 of 2: another worker was lost while" in error
    assert "the run stands at its last checkpoint: start the same command with --resume" in error
    last = int(list_checkpoints(RunFolder(tmp_path / "broken" / "run").checkpoints)[-1].stem[5:])
    total = str(last + 3 * 256)
    finish(start("train", tmp_path / "broken", total, "1.0"))
    (tmp_path / "unbroken").mkdir()
    finish(start("train", tmp_path / "unbroken", total, "1.0"))
    rows = trace(tmp_path / "broken")
    assert rows[-1]["step"] == int(total) and rows == trace(tmp_path / "unbroken")
    # one worker cannot resume what two have left
    processes = start("train", tmp_path / "broken", total, "1.0", size=1)
    [(_, error)] = finish(processes, 2)
    assert "it is of 2 worker(s), and 1 would resume it; resume with torchrun --nproc-per-node 2" in error


@pytest.mark.slow
def test_a_signal_to_one_worker_saves_and_ends_all(tmp_path):
    processes = start("train", tmp_path, "1000000000", "1.0")
    while int(processes[0].stdout.readline()) < 2:
        pass
    processes[1].send_signal(signal.SIGUSR1)
    finish(processes)
    last = int(list_checkpoints(RunFolder(tmp_path / "run").checkpoints)[-1].stem[5:])
    assert last == read_metrics(tmp_path / "run")[-1]["step"] >= 2 * 256
    assert (tmp_path / "run" / "checkpoints" / f"step-{last:012d}.worker-1.safetensors").exists()


def test_a_straggler_is_cut_short(tmp_path):
    results = finish(start("train", tmp_path, "400", "0.5"))
    lengths = [[line.split()[1:] for line in out.splitlines() if line.startswith("lengths")][0] for out, _ in results]
    assert lengths[0] == ["0", "16", "16"]
    assert lengths[1][0] == "1" and 4 <= int(lengths[1][1]) < 16
    rows = read_metrics(tmp_path / "run")
    assert all(12 * 8 < row["step"] - before["step"] < 2 * 16 * 8 for before, row in zip(rows, rows[1:], strict=False))


def test_a_checksum_sees_every_bit_and_every_place():
    parameters = [torch.arange(6.0).view(2, 3), torch.ones(2)]
    before = checksum(parameters)
    assert before == checksum([parameter.clone() for parameter in parameters])
    parameters[0][1, 2] = float(np.nextafter(np.float32(5), np.float32(6)))
    assert checksum(parameters) != before
    assert checksum([torch.tensor([1.0, 2.0])]) != checksum([torch.tensor([2.0, 1.0])])


def test_one_worker_exchanges_nothing():
    workers = Workers()
    values = torch.arange(3.0)
    assert workers.gather({"a": 1}) == [{"a": 1}] and workers.sums(values) is values
    assert workers.average([values], 4)[0] is values and workers.on_first(lambda: 5) == 5


def test_members_of_a_worker_stop_at_the_same_step():
    """Two threads at different speeds, and a call to end while they run."""
    asked = threading.Event()
    progress = RolloutProgress(1000, 2, asked.is_set)
    steps = [0, 0]

    def run(member: int, others: int) -> None:
        while progress.may_step(member):
            steps[member] += 1
            if steps[member] == 300 + others:
                asked.set()

    threads = [threading.Thread(target=run, args=(member, 40 * member)) for member in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert steps[0] == steps[1] == progress.limit and 300 <= progress.limit <= 1000


@pytest.mark.parametrize(("asked_at", "expected"), [(0, 4), (3, 4), (9, 9), (99, 16)])
def test_a_rollout_is_never_cut_below_a_quarter(asked_at, expected):
    step = 0
    progress = RolloutProgress(16, 1, lambda: step >= asked_at)
    while progress.may_step(0):
        step += 1
    assert step == progress.limit == expected
