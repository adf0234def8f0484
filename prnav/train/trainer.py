"""The training loop: collect, advantages, update, log, validate, save."""

from __future__ import annotations

import math
import platform
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from prnav.config import config_hash
from prnav.contracts import JSON, BatchEnv, JSONObject, ObservationSpecs, State
from prnav.errors import CheckpointError, ConfigError, PrnavError
from prnav.policy import Policy, build_policy
from prnav.resources import available_cores
from prnav.train import checkpoint, ppo
from prnav.train.board import Board, NoBoard
from prnav.train.config import TrainConfig
from prnav.train.crew import Crew
from prnav.train.distributed import Workers, join_workers
from prnav.train.imitation import expert_share, imitation_loss
from prnav.train.learner import Learner
from prnav.train.machine import choose_device, set_precision
from prnav.train.memory import check_memory
from prnav.train.rollout import Rollout
from prnav.train.rows import Counters, MetricsRow, Share
from prnav.train.run_folder import RunFolder
from prnav.train.sanity import Sanity
from prnav.train.signals import StopRequest
from prnav.train.stored_specs import specs_of, stored_specs
from prnav.train.validation import Validation, score, validate
from prnav.version import __version__


class Trainer:
    """Trains a policy in batches of environments that restart in the same step, and keeps its run directory.

    :meth:`begin` starts the run or resumes it, :meth:`train` does the work. For a warm start the environments have an
    oracle (:class:`prnav.contracts.HasExpert`).
    """

    def __init__(
        self,
        config: TrainConfig,
        envs: BatchEnv | Sequence[BatchEnv],
        folder: RunFolder,
        report: Callable[[MetricsRow], None] = lambda row: None,
        warn: Callable[[str], None] = lambda text: None,
        data: Mapping[str, JSON] | None = None,
        workers: Workers | None = None,
        validation: Callable[[], Validation] | None = None,
    ) -> None:
        """Trainer with fresh weights; nothing is read or written before :meth:`begin`.

        Args:
            config: What to do.
            envs: ``config.num_envs`` environments, or groups of them that are simulated side by side.
            folder: The run's files.
            report: Called with each row of metrics.
            warn: Called with what the user should know and the run survives.
            data: What the run was made from, for ``run.json``.
            workers: All processes that share the run; those that the launcher started if not given.
            validation: Loads the episodes of validations; called when the first one is due.
        """
        groups = list(envs) if isinstance(envs, Sequence) else [envs]
        self.config, self.folder, self.report, self.warn = config, folder, report, warn
        self.workers = join_workers() if workers is None else workers
        self.device = choose_device(config.device, self.workers.local_rank)
        cores = max(1, available_cores() // self.workers.local_size)
        self.threads = (config.threads or cores) if self.device.type == "cpu" else 1
        if self.device.type == "cpu":
            torch.set_num_threads(1)  # the learner's parts and the groups are what runs side by side
        specs = groups[0].observation_specs
        if self.device.type == "cpu":
            check_memory(config, specs, sum(one.num_envs for one in groups))
        self.policy = build_policy(config.policy, specs, groups[0].action_spec, config.seed).to(self.device)
        set_precision(self.policy, config)
        self.learner = Learner(self.policy, config.seed + 1, self.threads, config.ppo.adam_epsilon, self.workers)
        self.crew = Crew(groups, self.policy, config.seed, self.threads, self.workers.rank)
        self.storage = Rollout(config.ppo.rollout_steps, self.crew.environments, self.policy)
        self.rollout = self.storage
        self.step = self.updates = self.episodes = self.saved_step = self.validated_step = 0
        self.seconds = 0.0
        self.recent: deque[dict[str, float]] = deque(maxlen=config.window)
        self.best: dict[str, float] = {}
        self.sanity = Sanity(self.policy.head)
        self._facts = self._describe(specs, data or {})
        self._begun = False
        self._load_validation = validation
        self._validation: Validation | None = None

    def begin(self) -> None:
        """Lock the run's folder until :meth:`close`, and start the run there, or resume it from its last checkpoint.

        Raises:
            ConfigError: another process trains there, or the run has another config.
            CheckpointError: no checkpoint of the run can be read.
        """
        workers, folder = self.workers, self.folder
        workers.on_first(folder.acquire)
        if workers.on_first(folder.exists):
            workers.on_first(lambda: folder.check_resumable(self.config))
            self._resume()
        else:
            workers.on_first(lambda: folder.start(self.config, self._facts))
            self.save()
        self._begun = True

    def train(self) -> str | None:
        """Train to the end of the budget, or until a signal asks to stop: its name, else None."""
        if not self._begun:
            self.begin()
        with StopRequest() as stop, self._board() as board:
            while self.step < self.config.total_steps and not self._agree(stop.name):
                began = time.perf_counter()
                phase, share = self.phase()
                ended = self.collect(share)
                self.estimate_advantages()
                collected = time.perf_counter()
                losses = self.update(phase)
                row = self.count(ended, phase, losses, collected - began, time.perf_counter() - collected)
                self.validate(row, board)
                self.log(row, board)
                if self.step - self.saved_step >= self.config.checkpoint_steps:
                    self.save_or_warn()
            stopped = self._agree(stop.name)
            if self.step != self.saved_step:
                self.save()
        return stopped

    def collect(self, share: float | None) -> list[dict[str, float]]:
        """Fill the rollout with steps of the policy; measures of the episodes that ended."""
        workers, fraction = self.workers, self.config.sync_fraction
        waited_for = (lambda: workers.share_done() >= fraction) if workers.size > 1 and fraction < 1.0 else None
        workers.rollout_begins()
        self.rollout, ended = self.crew.collect(self.storage, share, waited_for)
        if waited_for is not None:
            workers.rollout_done()
        return ended

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
        if config.normalize_advantages:
            advantages = ppo.normalized(advantages, self.workers.sums(ppo.moments(advantages)))
        rollout["advantages"] = advantages

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
            config, left = self.config.ppo, 1.0 - self._ppo_progress()
            rate = config.learning_rate * (left if config.linear_decay else 1.0)
            if config.linear_clip_decay:
                config = replace(config, clip=max(config.clip * left, 1e-6))
            losses = self.learner.update(
                self.rollout,
                partial(ppo.ppo_loss, config=config),
                config.epochs,
                config.parts(self.crew.environments),
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

    def count(
        self, ended: list[dict[str, float]], phase: str, losses: Mapping[str, float], collecting: float, learning: float
    ) -> MetricsRow:
        """Book a finished update of all workers; its row of metrics."""
        steps = self.rollout.steps * self.rollout.environments
        share: Share = {"steps": steps, "ended": ended, "losses": dict(losses)}
        shares = self.workers.gather(share)
        taken = sum(share["steps"] for share in shares)
        episodes = [episode for share in shares for episode in share["ended"]]
        self.step += taken
        self.updates += 1
        self.episodes += len(episodes)
        self.recent.extend(episodes)
        self.seconds += collecting + learning
        keys = self.recent[-1].keys() if self.recent else ()
        return {
            "step": self.step,
            "update": self.updates,
            "episodes": self.episodes,
            "phase": phase,
            "measures": {key: float(np.mean([episode[key] for episode in self.recent])) for key in keys},
            "losses": {key: sum(share["losses"][key] * share["steps"] for share in shares) / taken for key in losses},
            "times": {
                "seconds": self.seconds,
                "steps_per_second": taken / (collecting + learning),
                "collecting": collecting,
                "learning": learning,
            },
        }

    def log(self, row: MetricsRow, board: Board | NoBoard) -> None:
        """Write and report one row of metrics."""
        if not self.workers.first:
            return
        try:
            self.folder.append_metrics(row)
        except OSError as error:
            self.warn(f"{self.folder.metrics_path}: cannot be written ({error.strerror}); training continues without")
        groups = {"measures": row["measures"], "losses": row["losses"], "times": row["times"]}
        for group, values in {**groups, "validation": row.get("validation", {})}.items():
            for name, value in values.items():
                board.add_scalar(f"{group}/{name}", value, self.step)
        for text in self.sanity.check(row):
            self.warn(text)
        self.report(row)

    def validate(self, row: MetricsRow, board: Board | NoBoard) -> None:
        """Where it is due, play the validation's episodes, add their measures to ``row``, keep the best policy."""
        every = self.config.validate_steps
        if not every or self._load_validation is None or self.step - self.validated_step < every:
            return
        self.validated_step = self.step

        def work() -> dict[str, float]:
            if self._validation is None:
                assert self._load_validation is not None
                self._validation = self._load_validation()
            measures, picture = validate(self.policy, self._validation, self.config.seed)
            if picture is not None:
                board.add_image("validation", picture, self.step, dataformats="HWC")
            return measures

        measures = self.workers.on_first(work)
        row["validation"] = measures
        if score(measures) > self.best.get("score", -math.inf):
            self.best = {"score": score(measures), "step": self.step}
            if self.workers.first:
                self._save_best()

    def _save_best(self) -> None:
        try:
            checkpoint.save_checkpoint(checkpoint.best_path(self.folder.checkpoints), self._policy_state())
        except CheckpointError as error:
            self.warn(f"{error}; training continues")

    def save_or_warn(self) -> None:
        """:meth:`save`, or warn where the disk takes nothing: the checkpoints before still stand."""
        try:
            self.save()
        except CheckpointError as error:
            self.warn(f"{error}; training continues, the last checkpoint is of step {self.saved_step:,}")

    def save(self) -> None:
        """Write a checkpoint, and delete old ones.

        Raises:
            CheckpointError: it cannot be written.
        """
        workers, folder = self.workers, self.folder.checkpoints
        workers.check_same(self.learner.parameters, self.step)
        if not workers.first:
            tree = {"version": __version__, "collector": self.crew.state_dict()}
            checkpoint.save_checkpoint(checkpoint.checkpoint_path(folder, self.step, workers.rank), tree)
        workers.gather(True)  # the first worker's file makes the others' count
        if workers.first:
            checkpoint.save_checkpoint(checkpoint.checkpoint_path(folder, self.step), self.state_dict())
            checkpoint.prune_checkpoints(folder, self.config.keep_checkpoints)
        self.saved_step = self.step

    def state_dict(self) -> State:
        """All that the rest of the run depends on; of the environments those of this worker."""
        return {
            **self._policy_state(),
            "workers": self.workers.size,
            "learner": self.learner.state_dict(),
            "collector": self.crew.state_dict(),
            "seconds": self.seconds,
            "recent": list(self.recent),
            "validated_step": self.validated_step,
            "best": self.best,
        }

    def _policy_state(self) -> State:
        """What :func:`load_policy` needs."""
        return {
            "version": __version__,
            "config_hash": config_hash(self.config),
            **stored_specs(self.policy.observation_specs, self.policy.action_spec),
            "policy": self.policy.state_dict(),
            "counters": {"step": self.step, "updates": self.updates, "episodes": self.episodes},
        }

    def _resume(self) -> None:
        """Resume from the last checkpoint that all workers can read."""
        workers, folder = self.workers, self.folder.checkpoints

        def newest() -> int:
            return checkpoint.load_latest(folder, step_of, self.warn, workers.size)

        def step_of(tree: State) -> int:
            checkpoint.needed(tree, ("counters",), folder)
            return int(tree["counters"]["step"])

        step = workers.on_first(newest)
        path = checkpoint.checkpoint_path(folder, step)
        state = checkpoint.load_checkpoint(path)
        if state.get("workers", 1) != workers.size:
            raise CheckpointError(
                f"checkpoint {path}: it is of {state.get('workers', 1)} worker(s), and {workers.size} would resume it; "
                f"resume with torchrun --nproc-per-node {state.get('workers', 1)}"
            )
        if not workers.first:
            state |= checkpoint.load_checkpoint(checkpoint.checkpoint_path(folder, step, workers.rank))
        self.load_state_dict(state, str(path))
        workers.on_first(lambda: self.folder.cut_metrics(step))

    def load_state_dict(self, state: Mapping[str, JSON], source: str) -> None:
        """Resume from :meth:`state_dict`.

        Raises:
            CheckpointError: a part is missing, or is not what this run would write.
        """
        checkpoint.needed(state, ("policy", "learner", "collector", "counters", "seconds", "recent"), source)
        checkpoint.load_policy_weights(self.policy, state["policy"], source)
        try:
            self.learner.load_state_dict(state["learner"])
            self.crew.load_state_dict(state["collector"], source)
        except (KeyError, TypeError, ValueError, IndexError, AttributeError, RuntimeError) as error:
            raise CheckpointError(
                f"checkpoint {source}: a part is not what this run would write ({' '.join(str(error).split())[:200]}); "
                f"it is damaged, or of another version: delete it to resume from the one before"
            ) from error
        counters = state["counters"]
        self.step, self.updates, self.episodes = counters["step"], counters["updates"], counters["episodes"]
        self.saved_step, self.seconds = self.step, state["seconds"]
        self.validated_step, self.best = state.get("validated_step", 0), dict(state.get("best", {}))
        self.recent.extend(state["recent"])

    def close(self) -> None:
        """Let go of the run directory."""
        self.folder.release()

    def _agree(self, stop: str | None) -> str | None:
        """The signal that any worker was sent, or None."""
        return next((name for name in self.workers.gather(stop) if name), None)

    def _board(self) -> AbstractContextManager[Board | NoBoard]:
        """TensorBoard's writer, on the worker that writes."""
        if not self.workers.first:
            return nullcontext(NoBoard())
        return Board(self.folder.tensorboard, self.step, self.warn)

    def _describe(self, specs: ObservationSpecs, data: Mapping[str, JSON]) -> JSONObject:
        imitation = self.config.imitation
        return {
            "prnav": __version__,
            "python": platform.python_version(),
            "torch": torch.__version__,
            "platform": f"{sys.platform} {platform.machine()}",
            "device": str(self.device),
            "threads": self.threads,
            "workers": self.workers.size,
            "task": self.config.task,
            "seed": self.config.seed,
            "config_hash": config_hash(self.config),
            "warm_start": f"imitation of the shortest-path oracle, {imitation.steps} steps"
            if imitation.steps
            else "none",
            "agent": self.config.policy.encoder,
            "observations": {name: list(spec.shape) for name, spec in specs.items()},
            "actions": self.policy.head.size,
            "parameters": sum(parameter.numel() for parameter in self.policy.parameters()),
            "data": dict(data),
        }


def load_policy(
    folder: RunFolder, warn: Callable[[str], None] = lambda text: None, best: bool = False
) -> tuple[Policy, Counters]:
    """The policy of a run's last checkpoint, ready to act, and its counters ("step", "updates", "episodes").

    Args:
        folder: The run's files.
        warn: Told of checkpoints that cannot be read.
        best: Take the policy that did best in validation instead.

    Raises:
        CheckpointError: there is none, or it does not fit the run's config.
    """
    config = folder.load_config()

    def use(tree: State) -> tuple[Policy, Counters]:
        checkpoint.needed(tree, ("policy", "counters"), folder.path)
        try:
            policy = build_policy(config.policy, *specs_of(tree))
        except (ConfigError, KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
            raise CheckpointError(
                f"run {folder.path}: its checkpoint's observations or actions are none ({' '.join(str(error).split())})"
            ) from error
        checkpoint.load_policy_weights(policy, tree["policy"], str(folder.path))
        return policy.eval(), tree["counters"]

    if not best:
        return checkpoint.load_latest(folder.checkpoints, use, warn)
    path = checkpoint.best_path(folder.checkpoints)
    if not path.exists():
        raise CheckpointError(f"run {folder.path}: it has no best checkpoint; train with validate_steps above 0")
    return use(checkpoint.load_checkpoint(path))
