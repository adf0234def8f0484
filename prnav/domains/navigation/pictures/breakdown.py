"""How success depends on the episode: on how far the goal is, and on how far round the way to it leads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from prnav import style
from prnav.contracts import Evaluation
from prnav.evaluate.intervals import Interval, bootstrap_interval
from prnav.evaluate.summary import column

BINS = 5
"""Groups of equally many episodes."""

RESAMPLES = 2000


def geodesic_ratio(evaluation: Evaluation) -> NDArray[np.float64]:
    """Shortest path over straight line from start to goal of each episode, (E,); 1 is a goal in plain reach."""
    starts = np.array([row["start"] for row in evaluation.rows], np.float64)
    goals = np.array([row["goal"] for row in evaluation.rows], np.float64)
    straight = np.linalg.norm(goals - starts, axis=1)
    shortest = column(evaluation.rows, "geodesic_distance")
    return np.divide(shortest, straight, out=np.ones_like(shortest), where=straight > 0)


def bin_edges(values: NDArray[np.float64], bins: int = BINS) -> NDArray[np.float64]:
    """Edges of at most ``bins`` groups of about equally many values, (bins + 1,) or fewer where values repeat."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, bins + 1)))
    return edges if len(edges) > 1 else np.array([edges[0], edges[0] + 1.0])


def means_by_bin(
    values: NDArray[np.float64], results: NDArray[np.float64], edges: NDArray[np.float64]
) -> list[tuple[float, Interval]]:
    """Median value and mean result with its 95 % interval of each group that has episodes.

    Args:
        values: (E,), what episodes are grouped by.
        results: (E,), what is averaged.
        edges: as :func:`bin_edges` gives; values beyond them count to the outer groups.
    """
    group = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return [
        (float(np.median(values[group == k])), bootstrap_interval(results[group == k], resamples=RESAMPLES))
        for k in range(len(edges) - 1)
        if (group == k).any()
    ]


def draw_breakdown(evaluations: Sequence[Evaluation], names: Sequence[str]) -> Figure | None:
    """Success by geodesic distance and by geodesic ratio, a line per evaluation; None where rows do not say."""
    known = {"success", "geodesic_distance", "start", "goal"}
    shown = [(name, e) for name, e in zip(names, evaluations, strict=True) if known <= set(e.rows[0])]
    if not shown:
        return None
    figure = style.new_figure(11.0, 3.9 + 0.24 * -(-len(shown) // 2))
    with style.styled():
        left, right = figure.subplots(1, 2, sharey=True)
        distance = [column(e.rows, "geodesic_distance") for _, e in shown]
        ratio = [geodesic_ratio(e) for _, e in shown]
        for axes, values, label in (
            (left, distance, "shortest path to the goal [m]"),
            (right, ratio, "shortest path over straight line"),
        ):
            edges = bin_edges(values[0])
            for k, ((name, evaluation), own) in enumerate(zip(shown, values, strict=True)):
                _line(axes, means_by_bin(own, column(evaluation.rows, "success"), edges), k, len(shown), name)
            axes.set_xlabel(label)
            axes.set_ylim(-0.03, 1.03)
        left.set_title("Success by distance")
        right.set_title("Success by how winding the way is")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _line(axes: Axes, groups: list[tuple[float, Interval]], index: int, count: int, name: str) -> None:
    x = np.array([value for value, _ in groups])
    reach = float(np.ptp(x)) or 1.0
    x = x + 0.008 * reach * (index - 0.5 * (count - 1))  # so that bars of several lines do not hide each other
    mean = np.array([interval.mean for _, interval in groups])
    ends = np.array([[m.mean - m.low, m.high - m.mean] for _, m in groups]).T
    color = style.SERIES[index % len(style.SERIES)]
    axes.errorbar(x, mean, yerr=np.maximum(ends, 0.0), color=color, marker="o", markersize=5, capsize=3, label=name)
