"""Tables of results: for the terminal (rich) and for a page (HTML)."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import TypeVar

from rich.table import Table

from prnav.aliases import JSON
from prnav.contracts import Evaluation
from prnav.contracts.measures import BY_KEY, MEASURES
from prnav.evaluate.compare import Difference, SeedGroup, same_episodes
from prnav.evaluate.intervals import Interval
from prnav.evaluate.summary import format_interval

Column = TypeVar("Column")


def intervals_of(header: Mapping[str, JSON]) -> dict[str, Interval]:
    """Measures of a finished evaluation from its header; null is infinity."""
    infinity = float("inf")
    return {
        key: Interval(*(infinity if value[name] is None else float(value[name]) for name in ("mean", "low", "high")))
        for key, value in header.get("measures", {}).items()
    }


def results_table(title: str, measures: Mapping[str, Interval]) -> Table:
    """One evaluation: a line per measure with its mean and 95 % interval."""
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column("measure")
    table.add_column("mean", justify="right", style="bold")
    table.add_column("95 % interval", justify="right", style="dim")
    for key, interval in measures.items():
        measure = BY_KEY.get(key)
        table.add_row(
            measure.label if measure else key, *format_interval(key, interval), measure.unit if measure else ""
        )
    return table


CELL, FIRST = 27, 20
"""Width of a mean with its interval, and of the names of measures, borders included [characters]."""


def that_fit(columns: Sequence[Column], width: int) -> list[Sequence[Column]]:
    """Columns of a table in groups that stand side by side in ``width`` characters; each is a table of its own."""
    most = max(1, (width - FIRST) // CELL)
    return [columns[k : k + most] for k in range(0, len(columns), most)]


def differences_table(differences: Sequence[Difference]) -> Table:
    """Differences to the first evaluation or group of seeds: a line per measure, a column per difference."""
    title = f"difference to {differences[0].baseline}, paired by episode (95 % interval)"
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column("measure")
    for difference in differences:
        table.add_column(difference.name, justify="right", overflow="fold")
    for key in differences[0].measures:
        cells = [_signed(key, difference.measures.get(key)).replace("\n", "  ") for difference in differences]
        table.add_row(BY_KEY[key].label, *cells)
    return table


def seeds_table(groups: Sequence[SeedGroup]) -> Table:
    """Runs of one recipe taken together: a line per measure, a column per recipe."""
    title = "over seeds: runs and episodes resampled (95 % interval)"
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column("measure")
    for group in groups:
        table.add_column(f"{group.name}, {len(group.seeds)} seeds", justify="right", overflow="fold")
    for key in groups[0].measures:
        cells = ["  ".join(format_interval(key, group.measures[key])) for group in groups if key in group.measures]
        table.add_row(BY_KEY[key].label, *cells)
    return table


def differences_html(differences: Sequence[Difference]) -> str:
    """Paired differences as an HTML table; those whose interval excludes 0 stand out."""
    keys = list(differences[0].measures)
    head = "".join(f"<th>{html.escape(BY_KEY[key].label)}{_unit(key)}</th>" for key in keys)
    lines = []
    for difference in differences:
        cells = [f"<th>{html.escape(difference.name)}</th>"]
        for key in keys:
            interval = difference.measures.get(key)
            if interval is None:
                cells.append("<td>–</td>")
                continue
            mean, ends = _signed(key, interval).split("\n")
            sure = interval.low > 0 or interval.high < 0
            cells.append(f"<td>{f'<b>{mean}</b>' if sure else mean}<small>{ends}</small></td>")
        lines.append(f"<tr>{''.join(cells)}</tr>")
    title = html.escape(f"minus {differences[0].baseline}")
    return f"<table><thead><tr><th>{title}</th>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def seeds_html(groups: Sequence[SeedGroup]) -> str:
    """Runs of one recipe taken together, as an HTML table."""
    keys = list(groups[0].measures)
    head = "".join(f"<th>{html.escape(BY_KEY[key].label)}{_unit(key)}</th>" for key in keys)
    lines = []
    for group in groups:
        cells = [f"<th>{html.escape(group.name)}</th><td>{len(group.seeds)}</td>"]
        for key in keys:
            mean, ends = format_interval(key, group.measures[key]) if key in group.measures else ("–", "")
            cells.append(f"<td>{mean}<small>{ends}</small></td>")
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return f"<table><thead><tr><th>recipe</th><th>seeds</th>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def _signed(key: str, interval: Interval | None) -> str:
    if interval is None:
        return ""
    decimals = BY_KEY[key].decimals
    return f"{interval.mean:+.{decimals}f}\n{interval.low:+.{decimals}f} to {interval.high:+.{decimals}f}"


def comparison_html(evaluations: Sequence[Evaluation], names: Sequence[str]) -> str:
    """Evaluations as an HTML table, one row each; where all are of the same episodes, the best means stand out."""
    results = [intervals_of(evaluation.header) for evaluation in evaluations]
    keys = [measure.key for measure in MEASURES if any(measure.key in result for result in results)]
    comparable = len(evaluations) > 1 and same_episodes(evaluations)
    best = {key: _best(key, results) for key in keys}
    head = "".join(f"<th>{html.escape(BY_KEY[key].label)}{_unit(key)}</th>" for key in keys)
    lines = []
    for name, evaluation, result in zip(names, evaluations, results, strict=True):
        cells = [f"<th>{html.escape(name)}</th>", f"<td>{evaluation.header.get('episodes', 0)}</td>"]
        for key in keys:
            if key not in result:
                cells.append("<td>–</td>")
                continue
            mean, ends = format_interval(key, result[key])
            strong = comparable and best[key] == result[key].mean
            mean = f"<b>{mean}</b>" if strong else mean
            cells.append(f"<td>{mean}<small>{ends}</small></td>")
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return (
        f"<table><thead><tr><th>evaluation</th><th>episodes</th>{head}</tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table>"
    )


def _unit(key: str) -> str:
    return f" ({BY_KEY[key].unit})" if BY_KEY[key].unit else ""


def _best(key: str, results: Sequence[Mapping[str, Interval]]) -> float | None:
    means = [result[key].mean for result in results if key in result]
    better = BY_KEY[key].better
    return None if better == 0 or len(means) < 2 else (max(means) if better > 0 else min(means))
