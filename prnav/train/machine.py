"""What a run finds: the device, the precision of its products, the environments' spaces."""

from __future__ import annotations

import numpy as np
import torch
from gymnasium.spaces import Dict, Discrete
from gymnasium.vector import VectorEnv

from prnav.errors import ConfigError
from prnav.policy import RecurrentPolicy
from prnav.train.config import TrainConfig


def choose_device(name: str, index: int = 0) -> torch.device:
    """The device called ``name``; "auto" is CUDA where there is one. Workers of a machine take one GPU each.

    Raises:
        ConfigError: CUDA is asked for and not there, or there are more workers than GPUs.
    """
    if name == "cuda" and not torch.cuda.is_available():
        raise ConfigError("device is 'cuda', and torch finds no CUDA device here; use device=cpu or device=auto")
    if name == "cpu" or not torch.cuda.is_available():
        return torch.device("cpu")
    if index >= torch.cuda.device_count():
        raise ConfigError(
            f"worker {index} of this machine has no GPU: there are {torch.cuda.device_count()}; start as many workers "
            f"as GPUs (torchrun --nproc-per-node), or use device=cpu"
        )
    torch.cuda.set_device(index)
    return torch.device("cuda", index) if index else torch.device("cuda")


def set_precision(policy: RecurrentPolicy, config: TrainConfig) -> None:
    """Let the policy compute as ``config.precision`` and ``config.compile`` say; parameters stay float32."""
    torch.set_float32_matmul_precision("highest" if config.precision == "float32" else "high")
    policy.encoder_type = torch.bfloat16 if config.precision == "bfloat16" else None
    if config.compile:
        policy.encoder.compile()


def types_of(envs: VectorEnv) -> dict[str, torch.dtype]:
    """Types of the observations as tensors."""
    spaces = envs.single_observation_space
    assert isinstance(spaces, Dict)
    return {key: torch.from_numpy(np.empty(0, space.dtype)).dtype for key, space in spaces.items()}


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
