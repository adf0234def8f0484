"""Figures of designs' results: thin drawings of what :mod:`prnav.report.design_results` says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from prnav import style
from prnav.aliases import Untyped
from prnav.contracts.measures import BY_KEY
from prnav.report.design_results import Correlation, Gains, Performance


def draw_spread(found: Sequence[Performance], measure: str) -> Figure:
    """Every specialist as a point in its group's column, the group's mean and interval beside them."""
    figure = style.new_figure(max(4.2, 1.5 + 1.25 * len(found)), 4.2)
    with style.styled():
        axes = figure.add_subplot()
        rng = np.random.Generator(np.random.PCG64(0))
        for place, one in enumerate(found):
            color = style.SERIES[place % len(style.SERIES)]
            shift = rng.uniform(-0.12, 0.12, len(one.units)) if len(one.units) > 1 else np.zeros(1)
            axes.scatter(place - 0.12 + shift, one.units, s=26, color=color, alpha=0.55, linewidth=0)
            _bar(axes, place + 0.2, one, color)
        axes.set_xticks(range(len(found)), [_group(one, found) for one in found])
        axes.set_ylabel(label_of(measure))
        axes.set_title("specialists; mean and 95 % interval")
        axes.set_xlim(-0.6, len(found) - 0.4)
    return figure


def draw_bars(found: Sequence[Performance], measure: str) -> Figure:
    """A bar with its interval per group, in order; the first two are marked by lines to compare with."""
    figure = style.new_figure(max(4.2, 1.8 + 0.8 * len(found)), 3.8)
    with style.styled():
        axes = figure.add_subplot()
        for place, one in enumerate(found):
            color = style.SERIES[0 if place >= 2 else 4 + place]
            axes.bar(place, one.interval.mean, width=0.62, color=color, alpha=0.35, linewidth=0)
            _bar(axes, place, one, color)
        for place, one in enumerate(found[:2]):
            axes.axhline(one.interval.mean, color=style.SERIES[4 + place], linewidth=0.9, linestyle=(0, (4, 3)))
        axes.set_xticks(range(len(found)), [_group(one, found) for one in found])
        axes.set_ylabel(label_of(measure))
        axes.set_title("mean and 95 % interval")
    return figure


def draw_interpolation(found: Sequence[Performance], measure: str) -> Figure:
    """Performance along the way from the found design (0) to the initial one (1)."""
    figure = style.new_figure(5.4, 3.8)
    with style.styled():
        axes = figure.add_subplot()
        alphas = np.array([float(one.group) for one in found])
        order = np.argsort(alphas)
        places = np.arange(len(order))  # the paper's steps grow exponentially: evenly spaced here
        ends = [found[i].interval for i in order]
        axes.fill_between(places, [i.low for i in ends], [i.high for i in ends], color=style.SERIES[0], alpha=0.15)
        axes.plot(places, [i.mean for i in ends], color=style.SERIES[0], marker="o", markersize=5)
        axes.set_xticks(places, [f"{alphas[i]:g}" for i in order])
        axes.set_xlabel("alpha: 0 is the optimised design, 1 the initial one")
        axes.set_ylabel(label_of(measure))
    return figure


def draw_gains(found: Gains, measure: str) -> Figure:
    """Optimised against initial designs: above the diagonal is better."""
    figure = style.new_figure(4.6, 4.6)
    with style.styled():
        axes = figure.add_subplot()
        ends = [*found.initial, *found.optimised]
        low, high = min(i.low for i in ends), max(i.high for i in ends)
        margin = 0.05 * (high - low) + 1e-6
        span = np.array([low - margin, high + margin])
        axes.fill_between(span, span, span[1], color="#1a8a4a", alpha=0.07, linewidth=0)
        axes.plot(span, span, color=style.MUTED, linewidth=0.9, linestyle=(0, (4, 3)))
        for place, (start, a, b) in enumerate(zip(found.starts, found.initial, found.optimised, strict=True)):
            color = style.SERIES[place % len(style.SERIES)]
            axes.errorbar(
                a.mean,
                b.mean,
                xerr=[[max(0.0, a.mean - a.low)], [max(0.0, a.high - a.mean)]],
                yerr=[[max(0.0, b.mean - b.low)], [max(0.0, b.high - b.mean)]],
                fmt="o",
                color=color,
                elinewidth=0.9,
                label=f"start {start}",
            )
        axes.set_xlim(*span)
        axes.set_ylim(*span)
        axes.set_aspect("equal")
        axes.set_xlabel(f"{label_of(measure)}, initial design")
        axes.set_ylabel(f"{label_of(measure)}, optimised design")
        gain = found.gain
        ends_of_gain = f"{gain.low:+.3f} to {gain.high:+.3f}"
        axes.set_title(f"{found.improved} of {len(found.starts)} improved; gain {gain.mean:+.3f} ({ends_of_gain})")
        axes.legend(loc="lower right")
    return figure


def draw_transfer(found: Correlation, measure: str) -> Figure:
    """Designs' scores against each other, with their rank correlation."""
    figure = style.new_figure(5.0, 4.4)
    with style.styled():
        axes = figure.add_subplot()
        axes.scatter(found.first, found.second, color=style.SERIES[0], s=30)
        for name, x, y in zip(found.names, found.first, found.second, strict=True):
            axes.annotate(name, (x, y), (4, 4), textcoords="offset points", fontsize=7, color=style.MUTED)
        axes.set_xlabel(found.labels[0])
        axes.set_ylabel(found.labels[1])
        rho = found.rho
        axes.set_title(f"Spearman's rho {rho.mean:.2f} ({rho.low:.2f} to {rho.high:.2f}), {len(found.names)} designs")
    return figure


FIGURES: Mapping[str, Callable[[Untyped, str], Figure]] = {
    "spread": draw_spread,
    "gain": draw_gains,
    "axes": draw_bars,
    "interpolation": draw_interpolation,
    "dropout": draw_bars,
    "cameras": draw_bars,
    "designs": draw_spread,
    "transfer": draw_transfer,
    "proxy": draw_transfer,
}
"""The drawing of each analysis."""


def _bar(axes: Axes, place: float, one: Performance, color: str) -> None:
    i = one.interval
    axes.plot([place, place], [i.low, i.high], color=color, linewidth=2.0, solid_capstyle="butt")
    axes.scatter([place], [i.mean], color=color, s=42, zorder=3, marker="D")


def _group(one: Performance, found: Sequence[Performance]) -> str:
    return one.group if len({other.task for other in found}) == 1 else f"{one.group}\n{one.task}"


def label_of(measure: str) -> str:
    """A measure's name on an axis."""
    return BY_KEY[measure].label if measure in BY_KEY else measure
