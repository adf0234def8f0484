"""What a run will take of the machine's memory, worked out before any of it is taken."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from prnav.contracts import ObservationSpecs
from prnav.errors import ConfigError
from prnav.policy.config import PolicyConfig
from prnav.train.config import TrainConfig

COPIES_OF_WEIGHTS = 4
"""Weights, their gradients, and Adam's two moments."""


def rollout_bytes(config: TrainConfig, specs: ObservationSpecs, environments: int) -> int:
    """Bytes of a rollout's storage: its observations, and about a dozen numbers a step."""
    observed = sum(math.prod(spec.shape) * np.dtype(spec.dtype).itemsize for spec in specs.values())
    return config.ppo.rollout_steps * environments * (observed + 64)


def policy_bytes(config: PolicyConfig, specs: ObservationSpecs) -> int:
    """About the bytes of a policy while it learns, its largest matrices alone."""
    width, hidden = config.width, config.lstm_hidden
    read = sum(math.prod(spec.shape) for spec in specs.values())
    encoder = config.transformer_layers * (4 * width * width + 2 * width * config.feedforward)
    if config.encoder == "compact":
        encoder = read * width + width * width
    elif config.encoder == "blind":
        encoder = 0
    layers = config.lstm_layers if config.memory == "lstm" else 0
    memory = 4 * hidden * (width + hidden) + max(0, layers - 1) * 8 * hidden * hidden if layers else 0
    return 4 * COPIES_OF_WEIGHTS * (encoder + memory + 2 * config.head_hidden * max(width, hidden))


def available_bytes() -> int | None:
    """Memory that this machine, or this container, still has [bytes]; None where it does not say."""
    found: list[int] = []
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                found.append(int(line.split()[1]) * 1024)
        limit, used = (Path("/sys/fs/cgroup") / name for name in ("memory.max", "memory.current"))
        if limit.exists() and (most := limit.read_text().strip()).isdigit():
            found.append(int(most) - int(used.read_text()))
    except (OSError, ValueError):
        pass
    return min(found) if found else None


def check_memory(config: TrainConfig, specs: ObservationSpecs, environments: int) -> None:
    """Refuse a run whose rollout and policy alone are more than there is.

    Raises:
        ConfigError: they are, with what each takes and which keys decide it.
    """
    rollout, policy = rollout_bytes(config, specs, environments), policy_bytes(config.policy, specs)
    free = available_bytes()
    if free is not None and rollout + policy > free:
        raise ConfigError(
            f"run {config.name}: a rollout of {rollout / 1e9:.1f} GB (ppo.rollout_steps x num_envs x observations) and "
            f"a policy of {policy / 1e9:.1f} GB (policy.*) are more than the {free / 1e9:.1f} GB of memory that are "
            f"free; lower what decides them"
        )
