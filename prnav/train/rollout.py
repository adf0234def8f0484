"""The rollout buffer, which is allocated once, and the collector that fills it.

Letters in shapes: T steps, N environments, W uniform numbers that sampling an action takes. An action's own axes are
written "...": none for discrete actions, (D,) for vectors.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.dlpack import from_dlpack

from prnav.aliases import JSON, Array, JSONObject, Untyped
from prnav.contracts import BatchEnv, HasExpert
from prnav.errors import ConfigError
from prnav.policy import Policy
from prnav.train.progress import RolloutProgress


class Rollout:
    """T steps of N environments, and what the policy thought of them."""

    def __init__(self, steps: int, environments: int, policy: Policy) -> None:
        """Storage of zeros.

        Args:
            steps: T.
            environments: N.
            policy: Says what is observed, how actions are stored, what its memory holds and on which device all this
                lies.
        """
        shape, self.device = (steps, environments), policy.device
        self.observations = {
            name: torch.zeros(*shape, *spec.shape, device=self.device, dtype=getattr(torch, spec.dtype))
            for name, spec in policy.observation_specs.items()
        }
        self.core = policy.core
        self.state = policy.initial_state(environments)
        """The memory's state before the first step."""
        self.last_values = torch.zeros(environments, device=self.device)
        """Value of the state after the last step, (N,)."""
        self.arrays = {name: torch.zeros(shape, device=self.device) for name in _FLOATS}
        self.arrays |= {name: policy.head.none_yet(*shape, device=self.device) for name in _ACTIONS}
        self.arrays |= {name: torch.zeros(shape, dtype=torch.bool, device=self.device) for name in _FLAGS}

    @property
    def steps(self) -> int:
        """T."""
        return self.arrays["rewards"].shape[0]

    @property
    def environments(self) -> int:
        """N."""
        return self.arrays["rewards"].shape[1]

    def __getitem__(self, name: str) -> Tensor:
        """One of the (T, N) arrays, or (T, N, ...) of actions, by name."""
        return self.arrays[name]

    def __setitem__(self, name: str, value: Tensor) -> None:
        self.arrays[name] = value

    def window(self, steps: slice = slice(None), environments: slice = slice(None)) -> Rollout:
        """Some of the steps and environments: what is written there is written here."""
        part = object.__new__(Rollout)
        part.device = self.device
        part.observations = {key: value[steps, environments] for key, value in self.observations.items()}
        part.arrays = {name: array[steps, environments] for name, array in self.arrays.items()}
        part.core, part.state = self.core, self.core.select(self.state, environments)
        part.last_values = self.last_values[environments]
        return part


_FLOATS = ("rewards", "values", "log_probs", "final_values")
_ACTIONS = ("actions", "previous_actions", "expert")
_FLAGS = ("starts", "terminated", "truncated")


class Collector:
    """Steps some environments with a policy, and holds all that a rollout carries over to the next."""

    def __init__(self, envs: BatchEnv, policy: Policy, seed: int) -> None:
        self.envs = envs
        self.policy = policy
        self.observations, _ = envs.reset(seed=seed)
        self.starts = np.ones(envs.num_envs, dtype=bool)
        self.previous_actions = policy.initial_actions(envs.num_envs)
        self.state = policy.initial_state(envs.num_envs)

    @torch.no_grad()
    def collect(
        self,
        rollout: Rollout,
        noise: Tensor,
        progress: RolloutProgress,
        member: int = 0,
        expert_share: float | None = None,
    ) -> list[dict[str, float]]:
        """Fill ``rollout`` to the step that ``progress`` allows.

        Args:
            rollout: Columns of these environments.
            noise: Uniform numbers in (0, 1), (T, N, W + 1): those that draw the policy's action, and one to choose
                whether the oracle acts.
            progress: Asked before each step.
            member: Number of this collector to ``progress``.
            expert_share: If given, the oracle labels all steps and takes that share of them.

        Returns:
            The measures of each episode that ended.
        """
        ended: list[dict[str, float]] = []
        for name, value in self.state.items():
            rollout.state[name].copy_(value)
        t = 0
        while progress.may_step(member):
            self._show(rollout, t)
            actions = self._act(rollout, t, noise[t], expert_share)
            taken = self.policy.head.for_environment(actions)
            self.observations, rewards, terminated, truncated, info = self.envs.step(taken)
            rollout["rewards"][t] = as_tensor(np.asarray(rewards, dtype=np.float32))
            rollout["terminated"][t] = as_tensor(terminated)
            rollout["truncated"][t] = as_tensor(truncated & ~terminated)
            cut = np.flatnonzero(truncated & ~terminated)
            if cut.size:
                rollout["final_values"][t, cut] = self._values(final_observations(info, cut), cut, actions)
            self.starts = terminated | truncated
            ended += final_measures(info, np.flatnonzero(self.starts))
            self.previous_actions = actions
            t += 1
        everyone = np.arange(self.envs.num_envs)
        rollout.last_values.copy_(self._values(self.observations, everyone, self.previous_actions, self.starts))
        return ended

    def _show(self, rollout: Rollout, t: int) -> None:
        for key, storage in rollout.observations.items():
            storage[t] = as_tensor(self.observations[key])
        rollout["starts"][t] = as_tensor(self.starts)
        rollout["previous_actions"][t] = self.previous_actions

    def _act(self, rollout: Rollout, t: int, noise: Tensor, expert_share: float | None) -> Tensor:
        """The actions to take, (N, ...)."""
        head = self.policy.head
        observations = {key: value[t] for key, value in rollout.observations.items()}
        output = self.policy.step(observations, rollout["previous_actions"][t], rollout["starts"][t], self.state)
        self.state = output.state
        actions = output.distribution.sample(noise[:, :-1])
        rollout["expert"][t] = head.unlabelled
        if expert_share is not None:
            expert = as_tensor(expert_actions(self.envs)).to(rollout.device, head.dtype)
            rollout["expert"][t] = expert
            oracle_acts = (noise[:, -1] < expert_share).view(-1, *[1] * len(head.shape))
            actions = torch.where(oracle_acts, expert, actions)
        rollout["actions"][t] = actions
        rollout["values"][t] = output.values
        rollout["log_probs"][t] = output.distribution.log_prob(actions)
        return actions

    def _values(
        self,
        observations: Mapping[str, JSON],
        rows: NDArray[np.int64],
        previous_actions: Tensor,
        starts: NDArray[np.bool_] | None = None,
    ) -> Tensor:
        """Value of one more step in the environments ``rows`` (n,), without taking it; actions are those of all N."""
        device = self.policy.device
        which = torch.from_numpy(rows).to(device)
        output = self.policy.step(
            {key: as_tensor(observations[key]).to(device) for key in self.policy.observation_specs},
            previous_actions[which],
            torch.from_numpy(np.zeros(len(rows), dtype=bool) if starts is None else starts).to(device),
            self.policy.core.select(self.state, which),
        )
        return output.values

    def state_dict(self) -> JSONObject:
        """All that the next rollout depends on, the environments included."""
        return {
            "environments": self.envs.snapshot(),
            "observations": {key: as_tensor(self.observations[key]) for key in self.policy.observation_specs},
            "starts": self.starts,
            "previous_actions": self.previous_actions,
            "recurrent": self.state,
        }

    def load_state_dict(self, state: Mapping[str, JSON]) -> None:
        """Continue from :meth:`state_dict`."""
        device = self.policy.device
        self.envs.restore(state["environments"])
        self.observations = dict(state["observations"])
        self.starts = state["starts"]
        self.previous_actions = torch.from_numpy(state["previous_actions"]).to(device)
        restored = self.policy.core.restored(state["recurrent"])
        self.state = {name: value.to(device) for name, value in restored.items()}


def as_tensor(values: Untyped) -> Tensor:
    """A tensor over the same memory: of a NumPy array on the host, of anything that speaks DLPack where it lies."""
    if isinstance(values, np.ndarray):
        return torch.from_numpy(values)
    return values if isinstance(values, Tensor) else from_dlpack(values)


def expert_actions(envs: BatchEnv) -> Array:
    """The oracle's action in each environment, (N, ...).

    Raises:
        ConfigError: the environment has no oracle.
    """
    if not isinstance(envs, HasExpert):
        raise ConfigError("the environment has no shortest-path oracle to imitate; train with --warmstart none")
    return np.asarray(envs.expert_actions())


def final_observations(info: Mapping[str, JSON], rows: NDArray[np.int64]) -> JSONObject:
    """Last observations (n, ...) of the episodes that ended in ``rows``, which a same-step reset has replaced.

    They are arrays in ``info["final_obs"]``, or, as Gymnasium's own vector environments have it, one dictionary per
    row; arrays may lie on a device.
    """
    final = info["final_obs"]
    if isinstance(final, Mapping):
        return {key: value[rows] for key, value in final.items() if not key.startswith("_")}
    return {key: torch.stack([as_tensor(final[row][key]) for row in rows]) for key in final[rows[0]]}


def final_measures(info: Mapping[str, JSON], rows: NDArray[np.int64]) -> list[dict[str, float]]:
    """The numbers in ``info["final_info"]`` for the episodes that ended in ``rows``, one dictionary per episode."""
    if not rows.size:
        return []
    final = info.get("final_info", {})
    numbers = {
        key: np.asarray(value, dtype=np.float64)
        for key, value in final.items()
        if not key.startswith("_") and np.asarray(value).dtype.kind in "biuf"
    }
    return [{key: float(value[row]) for key, value in numbers.items()} for row in rows]
