"""Table and figure of ``prnav-design compare``."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from rich.table import Table

from prnav.aliases import JSONObject
from prnav.cli._common import Screen
from prnav.errors import ConfigError
from prnav.evaluate.intervals import Interval
from prnav.files import write_text
from prnav.report.design_figures import FIGURES
from prnav.report.design_methods import draw_methods, methods
from prnav.report.design_results import ANALYSES, Correlation, Gains, against_scores, load_rows
from prnav.schema import MapOf, Number, read_json
from prnav.schema import Table as Fields
from prnav.style import save_png


def compare(options: argparse.Namespace) -> None:
    """Print the table of an analysis and draw its figure."""
    if options.kind == "methods":
        _compare_methods(options)
        return
    rows = load_rows(options.folder)
    kind = options.kind or str(rows[0].get("kind", "gain"))
    if kind == "proxy":
        result = against_scores(rows, _scores(options.scores), options.measure)
    else:
        result = ANALYSES[kind](rows, options.measure)
    console = Screen()
    told: JSONObject = {"kind": kind, "measure": options.measure}
    if isinstance(result, Gains):
        entries = [(f"initial {s}", i) for s, i in zip(result.starts, result.initial, strict=True)]
        entries += [(f"optimised {s}", i) for s, i in zip(result.starts, result.optimised, strict=True)]
        entries.append(("gain", result.gain))
        told["improved"], told["starts"] = result.improved, len(result.starts)
    elif isinstance(result, Correlation):
        entries = [("Spearman's rho", result.rho)]
    else:
        several = len({one.task for one in result}) > 1
        entries = [(f"{one.group} ({one.task})" if several else one.group, one.interval) for one in result]
    table = Table(title=f"{kind}: {options.measure}", title_justify="left", title_style="bold")
    table.add_column("designs")
    table.add_column("mean", justify="right", style="bold")
    table.add_column("95 % interval", justify="right", style="dim")
    for name, interval in entries:
        table.add_row(name, f"{interval.mean:.3f}", f"{interval.low:.3f} to {interval.high:.3f}")
        told.setdefault("intervals", {})[name] = asdict(interval)
    console.print(table)
    path = save_png(FIGURES[kind](result, options.measure), _figure_path(options, kind))
    console.print(f"figure   {path}", highlight=False, soft_wrap=True)
    if options.json:
        write_text(options.json, json.dumps(told, indent=1) + "\n")


def _compare_methods(options: argparse.Namespace) -> None:
    """Searches side by side, a row each."""
    found = methods(options.folder, options.measure)
    console = Screen()
    console.width = max(console.width, 120)  # a folded table of numbers cannot be read
    table = Table(title=f"methods: {options.measure}", title_justify="left", title_style="bold")
    for column in ("method\nscored by", "steps\nper start", "designs\ntried", "own score\nto found"):
        table.add_column(column, justify="left" if column.startswith("method") else "right", no_wrap=True)
    for column in ("specialist,\ninitial", "specialist,\nfound", "gain", "starts\nimproved"):
        table.add_column(column, justify="right", no_wrap=True)
    for one in found:
        table.add_row(
            one.name.replace(" (", "\n("),
            f"{one.steps:,}",
            str(one.trials) if one.trials else "-",
            f"{one.initial.mean:.3f}\nto {one.found.mean:.3f}",
            *(_mean_and_interval(i) for i in (one.specialist_initial, one.specialist_found, one.gains.gain)),
            f"{one.gains.improved} of {len(one.gains.starts)}",
        )
    console.print(table)
    path = save_png(draw_methods(found, options.measure), _figure_path(options, "methods"))
    console.print(f"figure   {path}", highlight=False, soft_wrap=True)
    if options.json:
        told = {"kind": "methods", "measure": options.measure, "methods": [asdict(one) for one in found]}
        write_text(options.json, json.dumps(told, indent=1) + "\n")


def _mean_and_interval(interval: Interval) -> str:
    return f"{interval.mean:.3f}\n{interval.low:.3f} to {interval.high:.3f}"


def _figure_path(options: argparse.Namespace, kind: str) -> Path:
    first = Path(options.folder[0])
    return Path(options.out) if options.out else (first if first.is_dir() else first.parent) / f"{kind}.png"


def _scores(file: str | None) -> dict[str, dict[str, float]]:
    """The proxy's scores of designs by name."""
    if file is None:
        raise ConfigError(
            "--kind proxy compares with the proxy's scores; give --scores FILE (evaluate --proxy --json FILE)"
        )
    scores: dict[str, dict[str, float]] = read_json(
        file, MapOf(Fields({"score": Number()})), ConfigError, "write scores by evaluate --proxy --json"
    )
    return scores
