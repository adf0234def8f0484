"""Methods that search for designs side by side, at the steps they spent: ``prnav-design compare --kind methods``.

A method is a folder that ``prnav-design optimize`` made. Its own scores are what the search looked at; the specialists
were trained afterwards, with other seeds, at the initial and at the found design of each start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from prnav import style
from prnav.aliases import JSONObject
from prnav.errors import RecordError
from prnav.evaluate.intervals import Interval
from prnav.report.design_figures import label_of
from prnav.report.design_results import Gains, gains, load_rows, performances, two_level_interval
from prnav.result_kinds import START
from prnav.schema import read_json


@dataclass(frozen=True, eq=False)
class Method:
    """One search, all its starts together."""

    name: str
    """Method, and what it scored designs by."""
    starts: int
    steps: int
    """Simulation steps (or readings) spent per start, on the average."""
    trials: int
    """Designs tried per start; 0 where none is tried on its own."""
    initial: Interval
    """The search's own score of the initial designs, over starts."""
    found: Interval
    """The search's own score of what it found; the highest of many is too high by chance."""
    specialist_initial: Interval
    """Specialists at the initial designs, over starts, seeds and episodes."""
    specialist_found: Interval
    gains: Gains
    """Specialists' gain, start by start."""


def methods(folders: Sequence[str | Path], measure: str) -> list[Method]:
    """What each folder's search found.

    Raises:
        RecordError: a folder is not a finished search with specialists.
    """
    result: list[Method] = []
    for folder in map(Path, folders):
        starts = _starts(folder)
        rows = load_rows([folder])
        pairs = gains(rows, measure)
        both = []
        for which in ("initial", "optimised"):
            own = [{**row, "group": which} for row in rows if str(row["group"]).startswith(f"{which} ")]
            both.append(performances(own, measure)[0].interval)
        name = f"{starts[0]['method']} ({starts[0]['score']})"
        if any(other.name == name for other in result):
            name = f"{name}, {folder.name}"
        result.append(
            Method(
                name,
                len(starts),
                round(float(np.mean([start["steps"] for start in starts]))),
                round(float(np.mean([start["trials"] for start in starts]))),
                _over_starts(starts, "initial"),
                _over_starts(starts, "found"),
                both[0],
                both[1],
                pairs,
            )
        )
    return result


def draw_methods(found: Sequence[Method], measure: str) -> Figure:
    """Each method's specialists at the initial and the found designs, and the gain of every start."""
    figure = style.new_figure(8.6, 1.6 + 0.62 * len(found))
    with style.styled():
        left, right = figure.subplots(1, 2, sharey=True)
        for place, one in enumerate(found):
            ends = ((one.specialist_initial, style.MUTED, 0.14), (one.specialist_found, style.SERIES[0], -0.14))
            for interval, color, shift in ends:
                left.plot([interval.low, interval.high], [place + shift] * 2, color=color, linewidth=2.0)
                left.scatter([interval.mean], [place + shift], color=color, s=36, zorder=3)
            gain, each = one.gains.gain, zip(one.gains.initial, one.gains.optimised, strict=True)
            values = [after.mean - before.mean for before, after in each]
            right.scatter(
                values, np.full(len(values), place + 0.14), color=style.SERIES[0], s=22, alpha=0.5, linewidth=0
            )
            right.plot([gain.low, gain.high], [place] * 2, color=style.SERIES[0], linewidth=2.0)
            right.scatter([gain.mean], [place], color=style.SERIES[0], s=42, zorder=3, marker="D")
        right.axvline(0.0, color=style.MUTED, linewidth=0.9, linestyle=(0, (4, 3)))
        left.set_yticks(range(len(found)), [f"{one.name}\n{one.steps:,} steps" for one in found])
        left.set_ylim(len(found) - 0.5, -0.5)
        left.set_title("initial (grey), found (blue)")
        left.set_xlabel(label_of(measure))
        right.set_title("gain; starts as points")
        right.set_xlabel(f"gain in {label_of(measure)}")
    return figure


def _starts(folder: Path) -> list[JSONObject]:
    paths = sorted(folder.glob("start-*/start.json"))
    told = [read_json(path, START, RecordError, "run prnav-design optimize again") for path in paths]
    if not told:
        raise RecordError(f"search {folder}: no finished start in it; give folders made by prnav-design optimize")
    return told


def _over_starts(starts: Sequence[JSONObject], key: str) -> Interval:
    return two_level_interval([np.array([float(start[key])]) for start in starts])
