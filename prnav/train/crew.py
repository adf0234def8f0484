"""The environments of one worker, collected in groups side by side.

Each group has its own thread: while one group's policy runs, another group walks and sees, and simulator, renderer and
policy all release the interpreter. What a group does depends on its own environments, the policy and the noise it is
dealt, so that results are the same bits however the threads fall.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from prnav.aliases import JSON, JSONObject, Untyped
from prnav.contracts import BatchEnv
from prnav.errors import CheckpointError
from prnav.policy import Policy
from prnav.train.checkpoint import check_like
from prnav.train.machine import one_core_threads
from prnav.train.progress import RolloutProgress
from prnav.train.rollout import Collector, Rollout

ANY_ROWS = ("next_theta", "next_theta_agents", "values", "log_probs", "scores", "covariates")
"""Arrays of the environments' state that have a row per agent that waits for a design, or per episode that is over."""


class Crew:
    """Collectors of several groups of environments, and the noise by which they act."""

    def __init__(self, groups: Sequence[BatchEnv], policy: Policy, seed: int, threads: int, rank: int = 0) -> None:
        """Crew at the first step of all its episodes.

        Args:
            groups: Environments, group by group.
            policy: What acts in them.
            seed: Of the run. Environment i of worker r has the seed that environment r * N + i has in a single worker.
            threads: How many groups are collected at a time.
            rank: The worker's number.
        """
        sizes = [envs.num_envs for envs in groups]
        self.bounds = np.cumsum([0, *sizes]).tolist()
        self.environments = self.bounds[-1]
        self.noise_width = policy.head.noise_width + 1
        first = seed + rank * self.environments
        self.collectors = [
            Collector(envs, policy, first + begin) for envs, begin in zip(groups, self.bounds, strict=False)
        ]
        self.generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, rank])))
        workers = min(threads, len(groups))
        self._pool = one_core_threads(workers, "collector") if workers > 1 else None

    def collect(
        self, rollout: Rollout, expert_share: float | None = None, waited_for: Callable[[], bool] | None = None
    ) -> tuple[Rollout, list[dict[str, float]]]:
        """Fill ``rollout``, or as many of its steps as there is time for.

        Args:
            rollout: Storage of all environments.
            expert_share: If given, the oracle labels all steps and takes that share of them.
            waited_for: Whether other workers wait by now; None where no one ever does.

        Returns:
            The steps that were filled, and the measures of each episode that ended, group by group.
        """
        noise = self._noise(rollout)
        progress = RolloutProgress(rollout.steps, len(self.collectors), waited_for)

        def work(member: int) -> list[dict[str, float]]:
            columns = slice(self.bounds[member], self.bounds[member + 1])
            part = rollout.window(environments=columns)
            return self.collectors[member].collect(part, noise[:, columns], progress, member, expert_share)

        members = range(len(self.collectors))
        results = list(self._pool.map(work, members)) if self._pool else [work(member) for member in members]
        ended = [episode for result in results for episode in result]
        return rollout.window(steps=slice(0, progress.limit)), ended

    def _noise(self, rollout: Rollout) -> Tensor:
        """Uniform numbers (T, N, W + 1) strictly between 0 and 1."""
        shape = (rollout.steps, rollout.environments, self.noise_width)
        noise = self.generator.random(shape, dtype=np.float32).clip(1e-7, 1.0 - 1e-7)
        return torch.from_numpy(noise).to(rollout.device)

    def state_dict(self) -> JSONObject:
        """All that the next rollout depends on, the environments included."""
        return {
            "groups": [collector.state_dict() for collector in self.collectors],
            "generator": self.generator.bit_generator.state,
        }

    def load_state_dict(self, state: Mapping[str, JSON], source: str) -> None:
        """Continue from :meth:`state_dict`.

        Raises:
            CheckpointError: the environments were grouped otherwise.
        """
        groups = state["groups"] if "groups" in state else [state]
        if len(groups) != len(self.collectors):
            raise CheckpointError(
                f"checkpoint {source}: its environments are in {len(groups)} group(s), this run's in "
                f"{len(self.collectors)}; resume with groups={len(groups)}"
            )
        models = [_arrays_alone(one.state_dict()) for one in self.collectors]
        check_like([_arrays_alone(group) for group in groups], models, source, "collector", ANY_ROWS)
        for collector, group in zip(self.collectors, groups, strict=True):
            collector.load_state_dict(group)
        self.generator.bit_generator.state = state["generator"]


def _arrays_alone(state: Untyped) -> Untyped:
    """A collector's state without what its environments learn: an optimiser has parts only once it has stepped."""
    if not isinstance(state, Mapping) or not isinstance(state.get("environments"), Mapping):
        return state
    return {**state, "environments": {key: value for key, value in state["environments"].items() if key != "policy"}}
