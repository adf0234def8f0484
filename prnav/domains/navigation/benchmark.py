"""Which benchmark a result belongs to: results of different ones do not compare."""

from __future__ import annotations

from prnav.domains.navigation.env.config import EnvConfig
from prnav.episodes import BUILTIN_NAME

BENCHMARK = BUILTIN_NAME
"""The built-in homes and episodes of this version of prnav."""


def benchmark_of(config: EnvConfig) -> str | None:
    """The benchmark that an environment plays; None for episodes of one's own."""
    return BENCHMARK if config.episodes is None else None
