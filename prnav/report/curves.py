"""Learning curves from a run's ``metrics.jsonl``."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from prnav import style
from prnav.aliases import JSON, JSONObject, Untyped
from prnav.errors import RecordError
from prnav.files import read_regular
from prnav.schema import MapOf, Maybe, Number, Table, Text, fit

Rows = Sequence[Mapping[str, JSON]]
"""Rows of a run's metrics."""

METRICS = "metrics.jsonl"
_VALUES = MapOf(Maybe(Number(finite=False)))
METRICS_ROW = Table(
    allowed={
        "step": Number(0, 1e18, whole=True),
        "phase": Text(),
        **dict.fromkeys(("measures", "losses", "times", "validation"), _VALUES),
    },
)
"""A line of it, as far as curves need it."""
SHARES = ("measures.spl", "measures.success", "measures.soft_spl")
"""Metrics between 0 and 1."""


def read_metrics(run: str | Path) -> list[JSONObject]:
    """Rows of a run's metrics in order; a last row that a kill cut short is left out.

    Raises:
        RecordError: the file is missing, or broken elsewhere.
    """
    path = Path(run) / METRICS
    try:
        text = read_regular(path).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(f"{path}: cannot be read ({error}); give the directory of a training run") from error
    rows = []
    lines = text.split("\n")
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (ValueError, RecursionError) as error:
            if number == len(lines):
                break
            raise RecordError(f"{path}: line {number} is not valid JSON ({error}); restore the file") from error
        rows.append(fit(row, METRICS_ROW, RecordError, f"{path}: line {number}", "restore the file"))
    return rows


def series(rows: Sequence[Mapping[str, JSON]], key: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Steps and values (n,), (n,) of the rows that have a metric, named by its path as in "measures.spl"."""
    pairs = [(row.get("step"), _metric(row, key)) for row in rows]
    known = [pair for pair in pairs if all(isinstance(number, int | float) for number in pair)]
    steps, values = np.array(known, dtype=np.float64).reshape(-1, 2).T
    return steps, values


def _metric(row: Mapping[str, JSON], key: str) -> Untyped:
    value: Untyped = row
    for name in key.split("."):
        value = value.get(name) if isinstance(value, Mapping) else None
    return value


def smooth(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Mean over a window of ``width`` values around each, narrower at the ends; shape of the input, NaN ignored."""
    known = np.isfinite(values)
    total = np.convolve(np.where(known, values, 0.0), np.ones(width), mode="same")
    count = np.convolve(known.astype(float), np.ones(width), mode="same")
    return np.divide(total, count, out=np.full(len(values), np.nan), where=count > 0)


def draw_curves(runs: Mapping[str, Sequence[Rows]], panels: Mapping[str, str]) -> Figure | None:
    """Learning curves of runs side by side; of several seeds the mean, in the band that they span.

    Args:
        runs: name to rows of :func:`read_metrics`, of each seed.
        panels: metric's key to its title; those no run has are left out.

    Returns:
        The figure, or None where no run has any of the metrics.
    """
    every = [rows for seeds in runs.values() for rows in seeds]
    shown = [key for key in panels if any(len(series(rows, key)[0]) for rows in every)]
    if not shown:
        return None
    figure = style.new_figure(min(4.1 * len(shown), 11.4), 3.1 + 0.3 * (len(runs) > 1))
    with style.styled():
        grid = figure.subplots(1, len(shown), squeeze=False)[0]
        for axes, key in zip(grid, shown, strict=True):
            for color, (name, seeds) in zip(style.SERIES * len(runs), runs.items(), strict=False):
                _draw_seeds(axes, [found for rows in seeds if len((found := series(rows, key))[0])], color, name)
            _shade_imitation(axes, every)
            if key in SHARES:
                axes.set_ylim(-0.02, 1.02)
            else:
                axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
            axes.set_title(panels[key])
            axes.set_xlabel("environment steps")
            axes.xaxis.set_major_formatter(_short)
            axes.xaxis.get_major_locator().set_params(nbins=5)
        if len(runs) > 1:
            handles, labels = grid[0].get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _draw_seeds(
    axes: Axes, seeds: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]], color: str, name: str
) -> None:
    """One run's curve, smoothed over its own pale one; or the mean of several in the band from least to most."""
    if not seeds:
        return
    smoothed = [smooth(values, max(1, len(values) // 40) | 1) for _, values in seeds]
    if len(seeds) == 1:
        steps, values = seeds[0]
        if len(values) >= 80:
            axes.plot(steps, values, color=color, linewidth=0.8, alpha=0.25)
        axes.plot(steps, smoothed[0], color=color, linewidth=2.0, label=name)
        return
    steps = min((steps for steps, _ in seeds), key=len)
    table = np.stack([np.interp(steps, own, values) for (own, _), values in zip(seeds, smoothed, strict=True)])
    axes.fill_between(steps, table.min(axis=0), table.max(axis=0), color=color, alpha=0.18, linewidth=0.0)
    axes.plot(steps, table.mean(axis=0), color=color, linewidth=2.0, label=f"{name} ({len(seeds)} seeds)")


def _shade_imitation(axes: Axes, runs: Iterable[Sequence[Mapping[str, JSON]]]) -> None:
    """Mark the steps in which an oracle acted in part: what is measured there is not the agent alone."""
    ends = [float(row["step"]) for rows in runs for row in rows if row.get("phase") == "imitation"]
    if ends:
        axes.axvspan(0.0, max(ends), color=style.FLOOR, zorder=0)
        axes.annotate(
            "imitation", (0.0, 1.0), (4, -11), xycoords="axes fraction", textcoords="offset points", fontsize=8
        )


def _short(value: float, _position: object = None) -> str:
    """A count of steps as a reader says it: 20k, 1.5M."""
    for size, suffix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:g}{suffix}"
    return f"{value:g}"
