"""One worker of a run, for tests: ``python worker_process.py JOB FOLDER [arguments]`` with torchrun's variables."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

sys.path.insert(0, str(Path(__file__).parent))

from toy_env import CueEnv
from toy_run import toy_config

from prnav.errors import PrnavError
from prnav.policy import PolicyConfig, build_policy
from prnav.train import PPOConfig, RunFolder, Trainer, join_workers, ppo
from prnav.train.crew import Crew
from prnav.train.learner import Learner
from prnav.train.rollout import Rollout


def say(*words: object) -> None:
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


class SlowEnv(CueEnv):
    """Takes its time."""

    def step(self, actions):
        time.sleep(0.05)
        return super().step(actions)


def gradients(workers, columns: slice) -> list[torch.Tensor]:
    """Gradients of one PPO step on some columns of a rollout that every worker can make."""
    envs = CueEnv(8, length=4)
    config = PolicyConfig(encoder="compact", width=16, lstm_hidden=16)
    policy = build_policy(config, envs.observation_specs, envs.action_spec)
    rollout, _ = Crew([envs], policy, seed=0, threads=1).collect(Rollout(12, 8, policy))
    generator = torch.Generator().manual_seed(0)
    rollout["advantages"] = torch.randn(12, 8, generator=generator)
    rollout["returns"] = torch.randn(12, 8, generator=generator)
    part = rollout.window(environments=columns)
    part["advantages"] = ppo.normalized(part["advantages"], workers.sums(ppo.moments(part["advantages"])))
    learner = Learner(policy, seed=0, threads=1, epsilon=1e-5, workers=workers)
    learner.update(part, lambda *a: ppo.ppo_loss(*a, PPOConfig()), 1, 1, 1e-4, 1e9)
    workers.check_same(learner.parameters, 0)
    return [parameter.grad for parameter in learner.parameters]


def main(job: str, folder: Path, *arguments: str) -> None:
    workers = join_workers()
    if job == "gradients":
        # shares of 2 and 6 environments, so that weights matter
        found = gradients(workers, slice(0, 2) if workers.first else slice(2, 8))
        np.savez(folder / f"{workers.rank}.npz", *[gradient.numpy() for gradient in found])
        workers.check_same([torch.zeros(3), torch.full((2,), float(workers.rank))], 7)
    elif job == "train":
        config = replace(toy_config(total_steps=int(arguments[0])), sync_fraction=float(arguments[1]))
        envs = SlowEnv(8) if config.sync_fraction < 1 and workers.rank == 1 else CueEnv(8)
        trainer = Trainer(config, envs, RunFolder(folder / "run"), report=lambda row: say(row["update"]))
        trainer.begin()
        trainer.train()
        say("lengths", workers.rank, trainer.rollout.steps, trainer.storage.steps)


if __name__ == "__main__":
    try:
        main(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:])
    except PrnavError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(2)
