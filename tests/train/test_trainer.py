"""The loop: it learns, it resumes to the same bits, it says what it did."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from toy_env import CueSlots
from toy_run import toy_config

from prnav.config import to_toml
from prnav.errors import CheckpointError, ConfigError, PrnavError
from prnav.train import ImitationConfig, PPOConfig, RunFolder, load_policy, read_metrics
from prnav.train.checkpoint import list_checkpoints, load_checkpoint
from prnav.train.imitation import expert_share
from prnav.train.validation import Validation


def trace(folder: Path) -> list[dict]:
    """Metrics without the clock's."""
    return [{key: value for key, value in row.items() if key != "times"} for row in read_metrics(folder)]


def test_ppo_learns_to_remember(make_trainer):
    ppo = PPOConfig(rollout_steps=9, learning_rate=1e-2, mini_batches=2, entropy_coefficient=0.003)
    config = toy_config(total_steps=40 * 576, num_envs=64, ppo=ppo, checkpoint_steps=10**6)
    trainer = make_trainer(config)
    assert trainer.train() is None
    rows = trace(trainer.folder.path)
    assert rows[0]["measures"]["success"] < 0.6 and rows[-1]["measures"]["success"] > 0.95
    assert rows[-1]["step"] == trainer.step == 40 * 576
    assert rows[-1]["losses"]["entropy"] < rows[0]["losses"]["entropy"]


def test_a_warm_start_learns_faster_and_says_so(make_trainer):
    imitation = ImitationConfig(steps=25 * 128, learning_rate=3e-3, epochs=2)
    trainer = make_trainer(toy_config(total_steps=40 * 128, imitation=imitation, checkpoint_steps=10**6))
    trainer.train()
    rows = trace(trainer.folder.path)
    phases = [row["phase"] for row in rows]
    assert phases == ["imitation"] * 25 + ["ppo"] * 15
    assert rows[24]["losses"]["agreement"] > 0.95
    assert rows[-1]["measures"]["success"] > 0.85  # PPO does not unlearn it
    assert rows[25]["losses"]["value_loss"] < 0.1 < rows[0]["losses"]["value_loss"]  # and its critic is warm
    facts = json.loads((trainer.folder.path / "run.json").read_text())
    assert facts["warm_start"] == "imitation of the shortest-path oracle, 3200 steps"


def test_the_oracle_fades_linearly():
    config = ImitationConfig(steps=100, expert_start=0.8, expert_end=0.2)
    assert [round(expert_share(config, step), 3) for step in (0, 50, 100, 150)] == [0.8, 0.5, 0.2, 0.2]


def test_same_seed_same_bits_another_seed_others(make_trainer, config):
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        make_trainer(replace(config, seed=seed), name).train()
    folder = make_trainer(config, "d").folder.path.parent
    assert trace(folder / "a") == trace(folder / "b") != trace(folder / "c")


@pytest.mark.parametrize("cut", [False, True])
def test_a_resumed_run_equals_an_unbroken_one(make_trainer, config, cut):
    config = replace(config, imitation=ImitationConfig(steps=512))
    unbroken = make_trainer(config, "unbroken", cut=cut)
    unbroken.train()
    first = make_trainer(replace(config, total_steps=7 * 128), "broken", cut=cut)
    first.train()
    first.close()
    second = make_trainer(config, "broken", cut=cut)
    assert second.step == 7 * 128
    second.train()
    assert trace(second.folder.path) == trace(unbroken.folder.path)
    for (name, a), b in zip(second.policy.state_dict().items(), unbroken.policy.state_dict().values(), strict=True):
        assert a.equal(b), name


KILLED = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from toy_run import toy_config
from toy_env import CueEnv, CueSlots
from toy_env import CueEnv, CueSlots
from prnav.train import RunFolder, Trainer
config = toy_config(total_steps=int(sys.argv[3]))
report = lambda row: print(row["update"], flush=True)
trainer = Trainer(config, CueEnv(config.num_envs), RunFolder(Path(sys.argv[2])), report)
trainer.begin()
trainer.train()
"""


@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_run_resumes_to_the_same_bits(tmp_path, make_trainer, sent):
    command = [sys.executable, "-c", KILLED, str(Path(__file__).parent), str(tmp_path / "run"), str(10**9)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        while int(process.stdout.readline()) < 8:
            pass
        process.send_signal(sent)
        process.stdout.read()
    step = load_checkpoint(list_checkpoints(tmp_path / "run" / "checkpoints")[-1])["counters"]["step"]
    assert process.returncode == (0 if sent == signal.SIGTERM else -signal.SIGKILL)
    assert step >= (8 if sent == signal.SIGTERM else 6) * 128
    config = toy_config(total_steps=step + 6 * 128)
    resumed = make_trainer(config, "run")
    assert resumed.step == step
    resumed.train()
    unbroken = make_trainer(config, "unbroken")
    unbroken.train()
    assert trace(resumed.folder.path) == trace(unbroken.folder.path)


def test_ctrl_c_saves_and_a_second_one_interrupts(make_trainer, config):
    sent = []

    def interrupt(row):
        sent.append(row["update"])
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)

    trainer = make_trainer(config, report=interrupt)
    before = signal.getsignal(signal.SIGINT)
    assert trainer.train() == "SIGINT" and sent == [1]
    assert signal.getsignal(signal.SIGINT) == before
    assert list_checkpoints(trainer.folder.checkpoints)[-1].name == "step-000000000128.safetensors"

    def insist(row):
        interrupt(row)
        interrupt(row)

    trainer.report = insist
    with pytest.raises(KeyboardInterrupt):
        trainer.train()


def test_the_run_directory_is_whole_before_the_first_step(make_trainer, config):
    folder = make_trainer(config, data={"episodes": "toy"}).folder
    assert folder.load_config() == config
    assert folder.config_path.read_text() == to_toml(config)
    facts = json.loads(folder.facts_path.read_text())
    assert facts["warm_start"] == "none" and facts["seed"] == 0 and facts["data"] == {"episodes": "toy"}
    assert facts["actions"] == 3 and facts["observations"]["photoreceptors"] == [1, 1, 3]
    assert len(list_checkpoints(folder.checkpoints)) == 1


def test_only_the_last_checkpoints_are_kept(make_trainer, config):
    trainer = make_trainer(config)
    trainer.train()
    steps = [int(path.stem[5:]) for path in list_checkpoints(trainer.folder.checkpoints)]
    assert steps == [768, 1152, 1280]
    assert list((trainer.folder.path / "tb").iterdir())


def test_a_corrupt_last_checkpoint_falls_back_and_gives_the_same_bits(make_trainer, config):
    trainer = make_trainer(config)
    trainer.train()
    expected = trace(trainer.folder.path)
    trainer.close()
    last = list_checkpoints(trainer.folder.checkpoints)[-1]
    last.write_bytes(last.read_bytes()[:1000])
    warnings: list[str] = []
    again = make_trainer(config, warn=warnings.append)
    assert again.step == 1152 and "falling back" in warnings[0]
    again.train()
    assert trace(again.folder.path) == expected


def test_two_runs_do_not_share_a_directory(make_trainer, config):
    make_trainer(config)
    with pytest.raises(ConfigError, match="is being trained by another process"):
        make_trainer(config)


def test_a_resumed_run_keeps_its_config(make_trainer, config):
    make_trainer(config).close()
    with pytest.raises(ConfigError, match="seed is 0 in its config.toml and 3 now; a resumed run may only change"):
        make_trainer(replace(config, seed=3))


def test_a_loss_that_is_not_finite_ends_the_run_and_says_what_to_do(make_trainer, config):
    trainer = make_trainer(config)
    next(trainer.policy.parameters()).data[:] = float("nan")
    with pytest.raises(PrnavError, match=r"a loss is not finite at step 0 .* lower ppo.learning_rate"):
        trainer.train()


def test_the_trained_policy_loads(make_trainer, config):
    trainer = make_trainer(config)
    trainer.train()
    policy, counters = load_policy(trainer.folder)
    assert counters["step"] == 1280 and not policy.training
    for a, b in zip(policy.parameters(), trainer.policy.parameters(), strict=True):
        assert a.equal(b)
    with pytest.raises(CheckpointError, match="there is no config.toml; give the folder of a run"):
        load_policy(RunFolder(trainer.folder.path / "nowhere"))


def test_workers_need_a_launcher(make_trainer, config, monkeypatch):
    monkeypatch.setenv("WORLD_SIZE", "2")
    monkeypatch.delenv("RANK", raising=False)
    with pytest.raises(
        ConfigError, match="WORLD_SIZE is 2, but the workers cannot be joined .* start them with torchrun"
    ):
        make_trainer(config)
    monkeypatch.setenv("WORLD_SIZE", "two")
    with pytest.raises(ConfigError, match="WORLD_SIZE is 'two'; it must be a number, as torchrun sets it"):
        make_trainer(config)


def test_a_full_disk_costs_a_checkpoint_and_not_the_run(make_trainer, config):
    """The system itself refuses to write more than 4 kB to a file."""
    resource = pytest.importorskip("resource", reason="limits of file sizes need a Unix")
    warnings: list[str] = []
    trainer = make_trainer(config, warn=warnings.append)
    trainer.step = 128
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        trainer.save_or_warn()
        with pytest.raises(CheckpointError, match="step-000000000128.safetensors: cannot be written .* make room"):
            trainer.save()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "training continues, the last checkpoint is of step 0" in warnings[0]
    assert [path.name for path in trainer.folder.checkpoints.iterdir()] == ["step-000000000000.safetensors"]


def test_validation_keeps_the_best_policy_and_does_not_disturb_training(make_trainer, config):
    plain = make_trainer(config, "plain")
    plain.train()
    watched = replace(config, validate_steps=256, validation_episodes=16)
    trainer = make_trainer(watched, "watched", validation=lambda: Validation(CueSlots(16)))
    trainer.train()
    rows = trace(trainer.folder.path)
    scores = {row["step"]: row.pop("validation")["success"] for row in rows if "validation" in row}
    assert list(scores) == [256, 512, 768, 1024, 1280] and rows == trace(plain.folder.path)
    _, counters = load_policy(trainer.folder, best=True)
    assert counters["step"] == max(scores, key=scores.get)  # the first of the best
    with pytest.raises(CheckpointError, match="it has no best checkpoint; train with validate_steps above 0"):
        load_policy(plain.folder, best=True)


def test_the_recorded_trace_is_reproduced(make_trainer):
    """Losses and measures of a fixed seed, to 1e-3: products round differently from one processor to another."""
    trainer = make_trainer(toy_config(total_steps=6 * 128, imitation=ImitationConfig(steps=256)))
    trainer.train()
    recorded = json.loads((Path(__file__).parent / "trace.json").read_text())
    for row, expected in zip(trace(trainer.folder.path), recorded, strict=True):
        assert (row["step"], row["phase"], row["episodes"]) == (
            expected["step"],
            expected["phase"],
            expected["episodes"],
        )
        assert row["losses"] == pytest.approx(expected["losses"], rel=1e-3, abs=1e-4)


@pytest.mark.slow
def test_killed_at_three_random_moments_the_trace_is_the_unbroken_one(tmp_path, make_trainer):
    generator = random.Random(time.time_ns())
    total = 150 * 128
    command = [sys.executable, "-c", KILLED, str(Path(__file__).parent), str(tmp_path / "run"), str(total)]
    for _ in range(3):
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            process.stdout.readline()
            time.sleep(generator.uniform(0.0, 1.0))
            process.kill()
            process.stdout.read()
        assert process.returncode in (-signal.SIGKILL, 0)
    resumed = make_trainer(toy_config(total_steps=total), "run")
    resumed.train()
    unbroken = make_trainer(toy_config(total_steps=total), "unbroken")
    unbroken.train()
    assert trace(resumed.folder.path) == trace(unbroken.folder.path)
