"""A trained policy as an agent.

Forward passes always have the same batch shape: slots are dealt to blocks of :data:`BLOCK` rows, the last one filled
up. A row's answer then does not depend on how many slots there are, which is what makes an episode's result its own.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from prnav.cache import hash_arrays
from prnav.config import config_hash
from prnav.domains.navigation.benchmark import BENCHMARK
from prnav.errors import CheckpointError
from prnav.evaluate.agents import Turn
from prnav.evaluate.sampling import sample_categorical, uniforms
from prnav.policy import RecurrentPolicy, build_policy
from prnav.schema import read_json
from prnav.train.checkpoint import load_policy_weights
from prnav.train.config import TrainConfig
from prnav.train.run_folder import FACTS, RunFolder
from prnav.train.trainer import load_policy

BLOCK = 32
"""Rows of a forward pass."""

ActionChoice = Literal["greedy", "sampled"]


@dataclass(frozen=True, eq=False)
class TrainedRun:
    """The policy of a run, as arrays that any process can build it from, and what it was trained on."""

    name: str
    config: TrainConfig
    shapes: dict[str, tuple[int, ...]]
    """Of the observations that the policy takes."""
    actions: int
    weights: dict[str, NDArray[Any]]
    facts: dict[str, Any]
    """Where the weights come from: encoder, budget, seed, hashes of the weights and of the recipe."""

    def build(self) -> RecurrentPolicy:
        """The policy, ready to act."""
        policy = build_policy(self.config.policy, self.shapes, self.actions)
        load_policy_weights(policy, self.weights, self.name)
        return policy.eval()


def load_run(directory: str | Path, warn: Callable[[str], None]) -> TrainedRun:
    """Policy of a run's last readable checkpoint; ``warn`` is told of broken ones.

    Raises:
        CheckpointError: there is no such run, no checkpoint, one that does not fit the run's config, or the run is of
            another version of the built-in homes.
        ConfigError: the run's config cannot be read.
    """
    path = Path(directory)
    if not path.is_dir():
        raise CheckpointError(f"run {directory}: there is no such folder; give one that prnav-train made (--run DIR)")
    folder = RunFolder(path)
    config = folder.load_config()
    told = _facts(folder.facts_path)
    made_for = told.get("benchmark")
    if made_for is not None and made_for != BENCHMARK:
        raise CheckpointError(
            f"run {directory}: it was trained for benchmark {made_for}, and this version of prnav has {BENCHMARK}; "
            f"evaluate it with prnav {told.get('prnav', 'as it was then')}, or train it again"
        )
    policy, counters = load_policy(folder, warn)
    weights = {name: value.detach().cpu().numpy() for name, value in policy.state_dict().items()}
    facts = {
        "encoder": config.policy.encoder,
        "steps": counters["step"],
        "imitation_steps": min(config.imitation.steps, counters["step"]),
        "seed": config.seed,
        "recipe": recipe(config),
        "parameters": int(sum(value.size for value in weights.values())),
        "weights": hash_arrays(weights)[:16],
    }
    shapes = {key: tuple(shape) for key, shape in policy.shapes.items()}
    return TrainedRun(path.resolve().name, config, shapes, policy.actions, weights, facts)


def recipe(config: TrainConfig) -> str:
    """Hash of all that a run's config says but for its name, its seed and the machine: runs of one recipe are seeds."""
    plain = TrainConfig()
    same = {name: getattr(plain, name) for name in ("name", "seed", "device", "threads", "checkpoint_steps", "window")}
    return config_hash(dataclasses.replace(config, keep_checkpoints=plain.keep_checkpoints, **same))


def _facts(path: Path) -> dict[str, Any]:
    """The run's ``run.json``; a run without one says nothing."""
    if not path.exists():
        return {}
    facts: dict[str, Any] = read_json(path, FACTS, CheckpointError, "restore it or delete it")
    return {**facts, **facts.get("data", {})}


class PolicyAgent:
    """Acts by a recurrent policy, greedily or by sampling with the episode's own random numbers."""

    def __init__(
        self,
        policy: RecurrentPolicy,
        name: str,
        actions: ActionChoice,
        num_slots: int,
        device: torch.device | str = "cpu",
        first_action: int = 0,
    ) -> None:
        """Agent for ``num_slots`` slots.

        Args:
            policy: what acts; moved to ``device``.
            name: in records and tables.
            actions: how it chooses.
            num_slots: N.
            device: where it runs.
            first_action: the simulator's number of the policy's action 0.
        """
        self.name = name
        self.actions = actions
        self.first_action = first_action
        self.device = torch.device(device)
        self.policy = policy.to(self.device).eval()
        if self.device.type == "cpu":
            torch.set_num_threads(1)  # blocks are too small to share, and sums must not depend on the machine's cores
        blocks = -(-num_slots // BLOCK)
        self._states = [policy.initial_state(BLOCK).to(self.device) for _ in range(blocks)]
        self._previous = np.zeros(num_slots, dtype=np.int64)

    def act(self, turn: Turn) -> NDArray[np.int64]:
        """Actions (N,).

        Raises:
            CheckpointError: the policy's answer is not finite.
        """
        probabilities = self._probabilities(turn)
        lost = turn.active & ~np.isfinite(probabilities).all(axis=1)
        if lost.any():
            step = int(turn.steps[lost].min())
            raise CheckpointError(
                f"policy {self.name}: its action probabilities are not finite at step {step} of an episode; "
                "the weights are damaged: take an earlier checkpoint, or train again with a lower learning rate"
            )
        if self.actions == "greedy":
            actions = np.argmax(probabilities, axis=1).astype(np.int64)
        else:
            actions = sample_categorical(probabilities, uniforms(turn.keys, turn.steps))
        self._previous = actions
        return actions + self.first_action

    @torch.inference_mode()
    def _probabilities(self, turn: Turn) -> NDArray[np.float64]:
        """Action probabilities (N, A) in float64; forgets what came before in slots that start."""
        count = len(turn.starts)
        rows = []
        for block, state in enumerate(self._states):
            part = slice(block * BLOCK, min((block + 1) * BLOCK, count))
            if not turn.active[part].any():
                rows.append(np.zeros((part.stop - part.start, self.policy.actions)))
                continue
            observations = {key: self._block(turn.observations[key][part]) for key in self.policy.shapes}
            step = self.policy.step(
                observations, self._block(self._previous[part]), self._block(turn.starts[part]), state
            )
            self._states[block] = step.state
            rows.append(step.logits[: part.stop - part.start].double().cpu().numpy())
        logits = np.concatenate(rows)
        weights = np.exp(logits - logits.max(axis=1, keepdims=True))
        return weights / weights.sum(axis=1, keepdims=True)

    def _block(self, values: NDArray[Any]) -> torch.Tensor:
        """The rows (n, ...) followed by zeros up to BLOCK, on the device."""
        filled = np.zeros((BLOCK, *values.shape[1:]), dtype=values.dtype)
        filled[: len(values)] = values
        return torch.from_numpy(filled).to(self.device)
