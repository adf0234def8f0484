"""Which benchmark a result belongs to: results of different ones do not compare."""

from __future__ import annotations

from prnav.domains.navigation.env.config import NavigationConfig
from prnav.episodes import BUILTIN_NAME

BENCHMARK = BUILTIN_NAME
"""The built-in homes and episodes of this version of prnav."""

FAMILY = BENCHMARK.rpartition("-")[0] + "-"
"""What the names of all its versions begin with."""


def benchmark_of(config: NavigationConfig) -> str | None:
    """The benchmark that an environment plays: the built-in homes, or a data set; None for episodes of one's own."""
    if config.episodes is not None:
        return None
    return BENCHMARK if config.data is None else config.data
