"""Environments whose agents get a new sensor design with each episode, drawn from the design policy.

The design is action 0 of its episode (the paper, section "Joint Optimization"): drawn before the first observation,
scored by the episode's SoftSPL when it ends, less the design's cost (its reward r0). Designs of agent i's episodes
depend on the seed, on i and on the policy alone. N agents, K sensors, n free coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON, JSONObject, Untyped
from prnav.contracts import BatchEnv, Designable, HasExpert, Observations, State
from prnav.contracts.envs import StepResult
from prnav.design.cost import CostConfig, design_cost
from prnav.design.gaussian import DesignPolicy
from prnav.errors import ConfigError
from prnav.sensors import Design, theta_to_pose, with_free_values

Float64 = NDArray[np.float64]


@runtime_checkable
class DesignableEnvs(BatchEnv, Designable, Protocol):
    """Environments whose agents' designs can be set."""


class DesignedVectorEnv:
    """Adds the design action to a batch of environments, and keeps what the design policy learns from."""

    def __init__(
        self,
        envs: DesignableEnvs,
        design: Design,
        policy: DesignPolicy,
        cost: CostConfig,
        score: str = "soft_spl_closest",
        seed: int = 0,
    ) -> None:
        """Environments around ``envs``.

        Args:
            envs: what is played; its agents start from ``design``.
            design: the initial design, theta = 0.
            policy: draws the free coordinates of designs.
            cost: what a design costs.
            score: measure in ``final_info`` that an episode's design is scored by.
            seed: of the drawn designs.
        """
        self.envs, self.design, self.policy, self.cost, self.score, self.seed = envs, design, policy, cost, score, seed
        self.num_envs = envs.num_envs
        self.observation_specs, self.action_spec = envs.observation_specs, envs.action_spec
        size, count = len(policy.mean), self.num_envs
        self.drawn = np.zeros(count, np.int64)  #: designs drawn by each agent
        self.current = np.zeros((count, size))  #: design of the episode that is played
        self.current_log_prob = np.zeros(count)
        self.following = np.zeros((count, size))  #: design of the one after it
        self.following_log_prob = np.zeros(count)
        self.clear()

    def clear(self) -> None:
        """Forget the episodes that were played so far."""
        size = len(self.policy.mean)
        self.values, self.log_probs = np.zeros((0, size)), np.zeros(0)
        self.scores, self.covariates = np.zeros(0), np.zeros((0, 1))

    def learn(self) -> dict[str, float]:
        """Update the design policy from the episodes since the last :meth:`clear`, and forget them."""
        facts = self.policy.update(self.values, self.scores, self.log_probs, self.covariates)
        self.clear()
        self._draw(np.arange(self.num_envs))  # episodes that have not begun get designs of the new policy
        return facts

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: JSONObject | None = None
    ) -> tuple[Observations, JSONObject]:
        """Begin an episode with a new design in each agent."""
        everyone = np.arange(self.num_envs)
        self._draw(everyone)
        result = self.envs.reset(seed=seed, options=options)
        self._begin(everyone)
        return result

    def step(self, actions: Untyped) -> StepResult:
        """One step in each agent; the rewards are the task's own."""
        result = self.envs.step(actions)
        terminated, truncated, info = np.asarray(result[2]), np.asarray(result[3]), result[4]
        over = np.flatnonzero(terminated | truncated)
        if len(over):
            self._book(over, info["final_info"])
            self._begin(over)
        return result

    def expert_actions(self) -> NDArray[np.int64]:
        """The oracle's actions, (N,).

        Raises:
            ConfigError: the environments have no oracle.
        """
        if not isinstance(self.envs, HasExpert):
            raise ConfigError("the environments have no oracle to imitate; train with imitation.steps=0")
        return self.envs.expert_actions()

    def snapshot(self) -> State:
        """All that :meth:`restore` needs, the design policy included."""
        return {
            "envs": self.envs.snapshot(),
            "policy": self.policy.state_dict(),
            **{name: getattr(self, name).copy() for name in _STATE},
        }

    def restore(self, state: State) -> None:
        """Resume where :meth:`snapshot` was called."""
        self.envs.restore(state["envs"])
        self.policy.load_state_dict(state["policy"])
        for name in _STATE:
            setattr(self, name, np.array(state[name]))

    def _book(self, over: NDArray[np.int64], final: Mapping[str, JSON]) -> None:
        scores = np.asarray(final[self.score], np.float64)[over]
        if not self.cost.free:
            poses = theta_to_pose(with_free_values(self.current[over], self.design), self.design)
            scores = scores - design_cost(poses, self.design, self.cost)
        far = np.asarray(final.get("geodesic_distance", np.zeros(self.num_envs)), np.float64)[over]
        self.values = np.concatenate([self.values, self.current[over]])
        self.log_probs = np.concatenate([self.log_probs, self.current_log_prob[over]])
        self.scores = np.concatenate([self.scores, scores])
        self.covariates = np.concatenate([self.covariates, np.log1p(far)[:, None]])

    def _begin(self, agents: NDArray[np.int64]) -> None:
        """The designs drawn for these agents' episodes are now played; draw those of the next ones."""
        self.current[agents] = self.following[agents]
        self.current_log_prob[agents] = self.following_log_prob[agents]
        self._draw(agents)

    def _draw(self, agents: NDArray[np.int64]) -> None:
        noise = np.empty((len(agents), len(self.policy.mean)))
        for row, agent in enumerate(agents.tolist()):
            key = np.random.SeedSequence([self.seed, agent, int(self.drawn[agent])])
            noise[row] = np.random.Generator(np.random.PCG64(key)).standard_normal(noise.shape[1])
            self.drawn[agent] += 1
        self.following[agents], self.following_log_prob[agents] = self.policy.sample(noise)
        self.envs.set_designs(agents, with_free_values(self.following[agents], self.design))


_STATE = (
    "drawn",
    "current",
    "current_log_prob",
    "following",
    "following_log_prob",
    "values",
    "log_probs",
    "scores",
    "covariates",
)
