"""What a set of records says: each measure's mean over episodes with its interval, as the commands print it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON
from prnav.contracts.measures import BY_KEY, MEASURES
from prnav.errors import RecordError
from prnav.evaluate.intervals import RESAMPLES, Interval, bootstrap_intervals


def column(rows: Sequence[Mapping[str, JSON]], key: str) -> NDArray[np.float64]:
    """Values of a measure, one per episode, shape (E,); infinity where a record says null (never reached)."""
    try:
        return np.array([np.inf if row[key] is None else float(row[key]) for row in rows], dtype=np.float64)
    except (KeyError, TypeError, ValueError) as error:
        raise RecordError(f"records: a row lacks the measure {key!r} or it is no number; evaluate again") from error


def summarise(rows: Sequence[Mapping[str, JSON]], resamples: int = RESAMPLES, seed: int = 0) -> dict[str, Interval]:
    """Mean and 95 % interval of every measure the rows have, in the order of :data:`prnav.contracts.MEASURES`.

    A measure that is infinite in some episode (the distance to a goal that cannot be reached) has an infinite mean.
    """
    if not rows:
        raise RecordError("records: there is no episode to summarise; evaluate at least one")
    keys = [measure.key for measure in MEASURES if measure.key in rows[0]]
    values = np.stack([column(rows, key) for key in keys], axis=1)
    finite = np.isfinite(values)
    intervals = bootstrap_intervals(np.where(finite, values, 0.0), resamples=resamples, seed=seed)
    unbounded = Interval(np.inf, np.inf, np.inf)
    return {key: intervals[i] if finite[:, i].all() else unbounded for i, key in enumerate(keys)}


def format_interval(key: str, interval: Interval) -> tuple[str, str]:
    """The mean and its interval as text, for example ("0.924", "0.918 to 0.931")."""
    decimals = BY_KEY[key].decimals if key in BY_KEY else 3
    return f"{interval.mean:.{decimals}f}", f"{interval.low:.{decimals}f} to {interval.high:.{decimals}f}"
