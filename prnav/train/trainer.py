"""The training loop: collect, advantages, update, log, save."""

from __future__ import annotations

import math
import platform
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Dict, Discrete
from gymnasium.vector import VectorEnv

from prnav.config import config_hash
from prnav.errors import ConfigError, PrnavError
from prnav.policy import RecurrentPolicy, build_policy
from prnav.train import checkpoint, ppo
from prnav.train.config import TrainConfig, available_cores
from prnav.train.distributed import join_workers
from prnav.train.imitation import expert_share, imitation_loss
from prnav.train.learner import Learner
from prnav.train.rollout import Collector, Rollout
from prnav.train.run_folder import RunFolder
from prnav.train.signals import StopRequest
from prnav.version import __version__

Row = dict[str, Any]


class Trainer:
    """Trains a policy in a batch of environments that restart in the same step, and keeps its run directory.

    The environments have spaces, ``get_state`` and ``set_state``, and, for a warm start, ``expert_actions``.
    """

    def __init__(
        self,
        config: TrainConfig,
        envs: VectorEnv,
        folder: RunFolder,
        report: Callable[[Row], None] = lambda row: None,
        warn: Callable[[str], None] = lambda text: None,
        data: Mapping[str, Any] | None = None,
    ) -> None:
        """Trainer of a run that starts in ``folder`` or, where one was started, goes on from its last checkpoint.

        Args:
            config: What to do.
            envs: ``config.num_envs`` environments.
            folder: The run's files; locked until :meth:`close`.
            report: Called with each row of metrics.
            warn: Called with what the user should know and the run survives.
            data: What the run was made from, for ``run.json``.
        """
        self.config, self.envs, self.folder, self.report, self.warn = config, envs, folder, report, warn
        workers = join_workers()
        folder.acquire()
        self.device = choose_device(config.device)
        self.threads = (config.threads or available_cores()) if self.device.type == "cpu" else 1
        if self.device.type == "cpu":
            torch.set_num_threads(1)  # the learner's parts and the simulator are what runs side by side
        shapes, actions = spaces_of(envs)
        self.policy = build_policy(config.policy, shapes, actions, config.seed).to(self.device)
        self.learner = Learner(self.policy, config.seed + 1, self.threads, config.ppo.adam_epsilon, workers)
        self.collector = Collector(envs, self.policy, config.seed)
        self.rollout = Rollout(config.ppo.rollout_steps, config.num_envs, self.policy)
        self.step = self.updates = self.episodes = self.saved_step = 0
        self.seconds = 0.0
        self.recent: deque[dict[str, float]] = deque(maxlen=config.window)
        if folder.exists():
            folder.check_resumable(config)
            checkpoint.load_latest(folder.checkpoints, self.load_state_dict, warn)
            folder.cut_metrics(self.step)
        else:
            folder.start(config, self._facts(shapes, actions, data or {}))
            self.save()

    def train(self) -> str | None:
        """Train to the end of the budget, or until a signal asks to stop: its name, else None."""
        from torch.utils.tensorboard import SummaryWriter

        with StopRequest() as stop, SummaryWriter(self.folder.tensorboard, purge_step=self.step) as board:
            while self.step < self.config.total_steps and not stop:
                began = time.perf_counter()
                phase, share = self.phase()
                ended = self.collector.collect(self.rollout, share)
                self.estimate_advantages()
                collected = time.perf_counter()
                losses = self.update(phase)
                self.count(ended, seconds=time.perf_counter() - began)
                self.log(board, phase, losses, collected - began, time.perf_counter() - collected)
                if self.step - self.saved_step >= self.config.checkpoint_steps:
                    self.save()
            self.save()
        return stop.name

    def phase(self) -> tuple[str, float | None]:
        """What the next rollout is for, and the oracle's share of its steps (None: it is not asked)."""
        if self.step < self.config.imitation.steps:
            return "imitation", expert_share(self.config.imitation, self.step)
        return "ppo", None

    def estimate_advantages(self) -> None:
        """Add "advantages" and "returns" to the rollout."""
        rollout, config = self.rollout, self.config.ppo
        values, terminated, truncated = rollout["values"], rollout["terminated"], rollout["truncated"]
        following = ppo.following_values(values, rollout.last_values, truncated, rollout["final_values"])
        advantages = ppo.advantages(
            rollout["rewards"], values, following, terminated, truncated, config.discount, config.gae_lambda
        )
        rollout["returns"] = advantages + values
        rollout["advantages"] = ppo.normalized(advantages) if config.normalize_advantages else advantages

    def update(self, phase: str) -> dict[str, float]:
        """Learn from the rollout; mean losses.

        Raises:
            PrnavError: they are not finite.
        """
        if phase == "imitation":
            imitation = self.config.imitation
            rate = imitation.learning_rate
            losses = self.learner.update(
                self.rollout,
                partial(imitation_loss, config=imitation),
                imitation.epochs,
                imitation.mini_batches,
                rate,
                imitation.max_grad_norm,
            )
        else:
            config = self.config.ppo
            rate = config.learning_rate * (1.0 - self._ppo_progress() if config.linear_decay else 1.0)
            losses = self.learner.update(
                self.rollout,
                partial(ppo.ppo_loss, config=config),
                config.epochs,
                config.mini_batches,
                rate,
                config.max_grad_norm,
            )
        if not all(map(math.isfinite, losses.values())):
            raise PrnavError(
                f"run {self.folder.path}: a loss is not finite at step {self.step} ({losses}); lower "
                f"{phase}.learning_rate and start again, or --resume from the last checkpoint to look closer"
            )
        explained = ppo.explained_variance(self.rollout["values"], self.rollout["returns"])
        return {**losses, "explained_variance": explained, "learning_rate": rate}

    def _ppo_progress(self) -> float:
        begin = self.config.imitation.steps
        return min(1.0, (self.step - begin) / max(1, self.config.total_steps - begin))

    def count(self, ended: list[dict[str, float]], seconds: float) -> None:
        """Book a finished update."""
        self.step += self.rollout.steps * self.rollout.environments
        self.updates += 1
        self.episodes += len(ended)
        self.recent.extend(ended)
        self.seconds += seconds

    def log(self, board: Any, phase: str, losses: Mapping[str, float], collecting: float, learning: float) -> None:
        """Write and report one row of metrics."""
        keys = self.recent[-1].keys() if self.recent else ()
        measures = {key: float(np.mean([episode[key] for episode in self.recent])) for key in keys}
        counts = {"step": self.step, "update": self.updates, "episodes": self.episodes, "phase": phase}
        rate = self.rollout.steps * self.rollout.environments / (collecting + learning)
        times = {"seconds": self.seconds, "steps_per_second": rate, "collecting": collecting, "learning": learning}
        row: Row = {**counts, "measures": measures, "losses": dict(losses), "times": times}
        self.folder.append_metrics(row)
        for group in ("measures", "losses", "times"):
            for name, value in row[group].items():
                board.add_scalar(f"{group}/{name}", value, self.step)
        self.report(row)

    def save(self) -> None:
        """Write a checkpoint, and delete old ones."""
        path = checkpoint.checkpoint_path(self.folder.checkpoints, self.step)
        checkpoint.save_checkpoint(path, self.state_dict())
        checkpoint.prune_checkpoints(self.folder.checkpoints, self.config.keep_checkpoints)
        self.saved_step = self.step

    def state_dict(self) -> dict[str, Any]:
        """All that the rest of the run depends on."""
        return {
            "version": __version__,
            "config_hash": config_hash(self.config),
            "shapes": self.policy.shapes,
            "actions": self.policy.actions,
            "policy": self.policy.state_dict(),
            "learner": self.learner.state_dict(),
            "collector": self.collector.state_dict(),
            "counters": {"step": self.step, "updates": self.updates, "episodes": self.episodes},
            "seconds": self.seconds,
            "recent": list(self.recent),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on from :meth:`state_dict`."""
        checkpoint.load_policy_weights(self.policy, state["policy"], str(self.folder.path))
        self.learner.load_state_dict(state["learner"])
        self.collector.load_state_dict(state["collector"])
        counters = state["counters"]
        self.step, self.updates, self.episodes = counters["step"], counters["updates"], counters["episodes"]
        self.saved_step, self.seconds = self.step, state["seconds"]
        self.recent.extend(state["recent"])

    def close(self) -> None:
        """Let go of the run directory."""
        self.folder.release()

    def _facts(self, shapes: Mapping[str, tuple[int, ...]], actions: int, data: Mapping[str, Any]) -> Row:
        imitation = self.config.imitation
        return {
            "prnav": __version__,
            "python": platform.python_version(),
            "torch": torch.__version__,
            "platform": f"{sys.platform} {platform.machine()}",
            "device": str(self.device),
            "threads": self.threads,
            "task": self.config.task,
            "seed": self.config.seed,
            "config_hash": config_hash(self.config),
            "warm_start": f"imitation of the shortest-path oracle, {imitation.steps} steps"
            if imitation.steps
            else "none",
            "agent": self.config.policy.encoder,
            "observations": {key: list(shape) for key, shape in shapes.items()},
            "actions": actions,
            "parameters": sum(parameter.numel() for parameter in self.policy.parameters()),
            "data": dict(data),
        }


def choose_device(name: str) -> torch.device:
    """The device called ``name``; "auto" is CUDA where there is one.

    Raises:
        ConfigError: CUDA is asked for and not there.
    """
    if name == "cuda" and not torch.cuda.is_available():
        raise ConfigError("device is 'cuda', and torch finds no CUDA device here; use device=cpu or device=auto")
    return torch.device("cuda" if name == "cuda" or (name == "auto" and torch.cuda.is_available()) else "cpu")


def spaces_of(envs: VectorEnv) -> tuple[dict[str, tuple[int, ...]], int]:
    """Observation shapes and number of actions of an environment.

    Raises:
        ConfigError: the spaces are not a dictionary of arrays and a set of actions.
    """
    observations, actions = envs.single_observation_space, envs.single_action_space
    if not isinstance(observations, Dict) or not isinstance(actions, Discrete):
        raise ConfigError(
            f"environment has observations {type(observations).__name__} and actions {type(actions).__name__}; "
            f"the trainer needs a Dict of arrays and Discrete actions"
        )
    return {key: tuple(space.shape or ()) for key, space in observations.items()}, int(actions.n)


def load_policy(folder: RunFolder, warn: Callable[[str], None] = lambda text: None) -> tuple[RecurrentPolicy, Row]:
    """The policy of a run's last checkpoint, ready to act, and its counters ("step", "updates", "episodes").

    Raises:
        CheckpointError: there is none, or it does not fit the run's config.
    """
    config = folder.load_config()

    def use(tree: dict[str, Any]) -> tuple[RecurrentPolicy, Row]:
        shapes = {key: tuple(shape) for key, shape in tree["shapes"].items()}
        policy = build_policy(config.policy, shapes, tree["actions"])
        checkpoint.load_policy_weights(policy, tree["policy"], str(folder.path))
        return policy.eval(), tree["counters"]

    return checkpoint.load_latest(folder.checkpoints, use, warn)
