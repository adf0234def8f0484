"""The policy of a run, as arrays that any process can build it from, and what it was trained on."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from prnav.aliases import Array, JSONObject
from prnav.cache import hash_arrays
from prnav.catalog import task_spec
from prnav.config import config_hash
from prnav.contracts import ActionSpec, ObservationSpecs
from prnav.errors import CheckpointError
from prnav.evaluate.run_facts import read_facts
from prnav.policy import Policy, build_policy
from prnav.train.checkpoint import load_policy_weights
from prnav.train.config import TrainConfig
from prnav.train.run_folder import RunFolder
from prnav.train.trainer import load_policy


@dataclass(frozen=True, eq=False)
class TrainedRun:
    """The policy of a run, as arrays that any process can build it from, and what it was trained on."""

    name: str
    config: TrainConfig
    observation_specs: ObservationSpecs
    """Of the observations that the policy takes."""
    action_spec: ActionSpec
    weights: dict[str, Array]
    facts: JSONObject
    """Where the weights come from: encoder, budget, seed, hashes of the weights and of the recipe."""

    def build(self) -> Policy:
        """The policy, ready to act."""
        policy = build_policy(self.config.policy, self.observation_specs, self.action_spec)
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
    told = read_facts(path, CheckpointError)
    told = {**told, **told.get("data", {})}
    made_for = told.get("benchmark")
    current = task_spec(config.task).evaluation.current_benchmark(made_for) if isinstance(made_for, str) else made_for
    if made_for != current:
        raise CheckpointError(
            f"run {directory}: it was trained for benchmark {made_for}, and this version of prnav has {current}; "
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
    name = path.resolve().name
    return TrainedRun(name, config, policy.observation_specs, policy.action_spec, weights, facts)


def recipe(config: TrainConfig) -> str:
    """Hash of all that a run's config says but for its name, its seed and the machine: runs of one recipe are seeds."""
    plain = TrainConfig()
    same = {name: getattr(plain, name) for name in ("name", "seed", "device", "threads", "checkpoint_steps", "window")}
    return config_hash(dataclasses.replace(config, keep_checkpoints=plain.keep_checkpoints, **same))
