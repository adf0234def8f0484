"""Several workers on one run: the only file that may import ``torch.distributed``.

There is one worker today. A launcher that asks for more gets a clear answer instead of several runs that overwrite
one another.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from torch import Tensor

from prnav.errors import ConfigError


@dataclass(frozen=True)
class Workers:
    """The workers that share a run."""

    rank: int = 0
    size: int = 1

    def average(self, gradients: Sequence[Tensor]) -> Sequence[Tensor]:
        """Mean of each gradient over all workers."""
        return gradients


def join_workers() -> Workers:
    """The workers that the launcher started.

    Raises:
        ConfigError: more than one.
    """
    size = os.environ.get("WORLD_SIZE", "1")
    if size != "1":
        raise ConfigError(f"WORLD_SIZE is {size}; training runs in one process, so start it without torchrun")
    return Workers()
