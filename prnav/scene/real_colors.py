"""Colours as real numbers, which some programs write up to 1 and others up to 255."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def color_range(values: NDArray[np.float64]) -> float:
    """What stands for full: 1, or 255 or 65535 where numbers go beyond what 1 could mean; NaN does not count."""
    known = values[np.isfinite(values)]
    top = float(known.max(initial=0.0))
    if top <= 1.0 or (top <= 2.0 and not (known == np.round(known)).all()):
        return 1.0  # slightly more than 1 is a rounding error of 1
    return 255.0 if top <= 255.5 else 65535.0
