"""What a run finds: the device, and the precision of its products."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import torch

from prnav.errors import ConfigError
from prnav.policy import Policy
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


def set_precision(policy: Policy, config: TrainConfig) -> None:
    """Let the policy compute as ``config.precision`` and ``config.compile`` say; parameters stay float32."""
    torch.set_float32_matmul_precision("highest" if config.precision == "float32" else "high")
    policy.encoder_type = torch.bfloat16 if config.precision == "bfloat16" else None
    if config.compile:
        policy.encoder.compile()


def one_core_threads(count: int, name: str) -> ThreadPoolExecutor:
    """Threads that each compute on one core.

    torch tells a thread's libraries so at its first parallel loop. A product before that would use all cores, and its
    bits would depend on how many there are and on when the thread began.
    """
    return ThreadPoolExecutor(count, name, initializer=torch.set_num_threads, initargs=(1,))
