"""One static page about runs: results with intervals, learning curves, trajectories. Opens from disk; no server."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import prnav
from prnav import style
from prnav.aliases import JSON, JSONObject
from prnav.catalog import DEFAULT_TASK, task_spec
from prnav.contracts import Evaluation, Pictures
from prnav.errors import RecordError
from prnav.evaluate.compare import differences, group_differences, same_episodes, seed_groups, shared_name
from prnav.evaluate.records import find_evaluations, is_finished, load_evaluation, load_traces
from prnav.evaluate.run_facts import read_facts
from prnav.report.curves import METRICS, draw_curves, read_metrics
from prnav.report.designs import draw_design
from prnav.report.tables import comparison_html, differences_html, seeds_html
from prnav.sensors import Design
from prnav.sensors.body import Body

PANELS = {
    "measures.spl": "SPL",
    "measures.success": "Success",
    "measures.reward": "Reward of an episode",
    "times.steps_per_second": "Steps per second",
}
"""Learning curves that are shown, by their path in the metrics."""

RESULTS = (
    "<p>Means over episodes; below each the 95 % interval of a bootstrap over episodes. SPL weighs success by path "
    "length; SoftSPL takes progress in the place of success, by the distance left at the end, or by the closest that "
    "the agent came. Greedy takes the likeliest action, sampled draws from the policy.</p>"
)
PAIRS = "Where the left did better most, where the right did, and one episode at random. Red dots are collisions."
CURVES = "Means over the latest training episodes, smoothed. Where it says imitation, an oracle acted in part."

_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1f2933; max-width: 1180px; margin: 2.5rem auto;
  padding: 0 1.5rem; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; } h2 { font-size: 1.2rem; margin: 2.6rem 0 .6rem; }
h3 { font-size: 1rem; margin: 1.6rem 0 .4rem; } p, figcaption { color: #66727f; max-width: 60rem; }
figure { margin: 1rem 0 1.8rem; } img { max-width: 100%; height: auto; display: block; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
table { font-size: .87rem; }
th, td { text-align: right; padding: .4rem .45rem; border-bottom: 1px solid #e3e7eb; }
th { vertical-align: bottom; } th:first-child { text-align: left; max-width: 11rem; }
tbody th { vertical-align: middle; }
thead th { color: #66727f; font-weight: 600; font-size: .85rem; }
td small { display: block; color: #66727f; font-size: .74rem; white-space: nowrap; }
code { background: #f3f5f7; padding: .1rem .3rem; border-radius: 3px; }
details { margin: .4rem 0; } pre { background: #f3f5f7; padding: .8rem; overflow-x: auto; font-size: .82rem; }
"""


@dataclass(frozen=True, eq=False)
class RunRecords:
    """What a run directory holds that a page shows."""

    name: str
    evaluations: tuple[Evaluation, ...]
    metrics: tuple[JSONObject, ...]
    facts: JSONObject
    """``run.json``; empty where there is none."""
    unfinished: tuple[str, ...] = ()
    """Names of evaluations that were interrupted or still run; the page says so."""


def read_run(directory: str | Path) -> RunRecords:
    """Finished evaluations, those that act as in training before greedy ones, and metrics of a run.

    Raises:
        RecordError: there is neither, or something in them is broken.
    """
    path = Path(directory)
    if not path.is_dir():
        raise RecordError(f"{directory}: there is no such folder; give a run made by prnav-train or prnav-eval")
    found = find_evaluations(path)
    finished = [load_evaluation(folder) for folder in found if is_finished(folder)]
    evaluations = tuple(sorted(finished, key=lambda evaluation: evaluation.header.get("actions") == "greedy"))
    unfinished = tuple(folder.name for folder in found if not is_finished(folder))
    metrics = tuple(read_metrics(path)) if (path / METRICS).exists() else ()
    if not evaluations and not metrics:
        raise RecordError(f"{path}: holds no finished evaluation and no {METRICS}; use prnav-eval --run {path}")
    return RunRecords(path.resolve().name, evaluations, metrics, read_facts(path, RecordError), unfinished)


def make_page(runs: Sequence[RunRecords], title: str | None = None) -> str:
    """HTML text of the page, with every picture inside it."""
    title = title or ", ".join(run.name for run in runs)
    shown = [(run, evaluation) for run in runs for evaluation in run.evaluations]
    evaluations = [evaluation for _, evaluation in shown]
    names = [_name(run, evaluation) for run, evaluation in shown]
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        f"<p>Made by prnav {prnav.__version__} from the records of its runs.</p>",
    ]
    if shown:
        parts += _results(evaluations, names)
    parts += [
        f"<p>{html.escape(run.name)}: the evaluation {html.escape(name)} is unfinished and not shown.</p>"
        for run in runs
        for name in run.unfinished
    ]
    curves = draw_curves(_by_recipe(runs), PANELS)
    if curves is not None:
        parts += ["<h2>Learning</h2>", _figure(style.data_uri(curves), CURVES)]
        parts += [f"<p>{html.escape(line)}</p>" for line in map(_trained, runs) if line]
    parts += _pairs(shown, names)
    if shown:
        parts.append("<h2>Trajectories</h2>")
    for name, evaluation in zip(names, evaluations, strict=True):
        parts.append(f"<h3>{html.escape(name)}</h3>")
        for figure, caption in _pictures_of(evaluation).figures(evaluation, load_traces(evaluation)):
            parts.append(_figure(style.data_uri(figure), caption))
    parts += _designs(evaluations)
    parts.append("<h2>How it was made</h2>")
    for name, evaluation in zip(names, evaluations, strict=True):
        head = {key: value for key, value in evaluation.header.items() if key != "measures"}
        parts.append(_details(name, head))
    parts += [_details(f"{run.name}: run.json", run.facts) for run in runs if run.facts]
    body = "\n".join(parts)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{_STYLE}</style></head>'
        f"<body>\n{body}\n</body></html>\n"
    )


def _results(evaluations: Sequence[Evaluation], names: Sequence[str]) -> list[str]:
    """Tables with intervals, differences, seeds, and what success depends on."""
    parts = ["<h2>Results</h2>", f'<div class="scroll">{comparison_html(evaluations, names)}</div>', RESULTS]
    paired, groups = differences(evaluations, names), seed_groups(evaluations)
    if paired:
        parts += ["<h3>Differences, paired by episode</h3>", f'<div class="scroll">{differences_html(paired)}</div>']
        parts.append("<p>Bold where the 95 % interval leaves out 0.</p>")
    if groups:
        parts += ["<h3>Over seeds</h3>", f'<div class="scroll">{seeds_html(groups)}</div>']
        parts.append("<p>The bootstrap draws runs and episodes; with few seeds the interval is wide, and rightly.</p>")
    if between := group_differences(groups):
        parts += ["<h3>Differences over seeds</h3>", f'<div class="scroll">{differences_html(between)}</div>']
    if not same_episodes(evaluations):
        parts.append("<p>These evaluations are of different episodes; they do not compare one to one.</p>")
    if len({_task_of(evaluation) for evaluation in evaluations}) == 1:
        breakdown = _pictures_of(evaluations[0]).breakdown(evaluations, names)
        if breakdown is not None:
            parts.append(_figure(style.data_uri(breakdown[0]), breakdown[1]))
    return parts


def _by_recipe(runs: Sequence[RunRecords]) -> dict[str, list[tuple[JSONObject, ...]]]:
    """Metrics of the runs, those of one recipe (all but the seed is the same) together under one name."""
    recipes: dict[str, list[RunRecords]] = {}
    for run in runs:
        heads = [evaluation.header.get("checkpoint") or {} for evaluation in run.evaluations]
        recipe = next((str(head["recipe"]) for head in heads if "recipe" in head), run.name)
        if run.metrics:
            recipes.setdefault(recipe, []).append(run)
    return {shared_name([run.name for run in group]): [run.metrics for run in group] for group in recipes.values()}


def _pairs(shown: Sequence[tuple[RunRecords, Evaluation]], names: Sequence[str]) -> list[str]:
    """The first two evaluations of the same episodes, of two runs if there are two, side by side."""
    pairs = [
        (i, j)
        for i in range(len(shown))
        for j in range(i + 1, len(shown))
        if same_episodes([shown[i][1], shown[j][1]]) and shown[i][1].ids == shown[j][1].ids
    ]
    if not pairs:
        return []
    i, j = min(pairs, key=lambda pair: (shown[pair[0]][0] is shown[pair[1]][0], pair))
    one, two = shown[i][1], shown[j][1]
    figure = _pictures_of(one).pairs((one, two), (load_traces(one), load_traces(two)), (names[i], names[j]))
    if figure is None:
        return []
    return ["<h2>Side by side</h2>", _figure(style.data_uri(figure), PAIRS)]


def _task_of(evaluation: Evaluation) -> str:
    return str(evaluation.header.get("task", DEFAULT_TASK))


def _pictures_of(evaluation: Evaluation) -> Pictures:
    return task_spec(_task_of(evaluation)).pictures


def _designs(evaluations: Sequence[Evaluation]) -> list[str]:
    """Each design that an evaluated agent has, drawn on its body."""
    designs = {json.dumps(told): told for evaluation in evaluations if (told := evaluation.header.get("design"))}
    parts = ["<h2>Designs</h2>"] if designs else []
    for told in designs.values():
        if "shape" in told["body"]:  # a mesh, which is in the design's own file
            parts.append(f"<p>The body of design {html.escape(told['name'])} is {html.escape(told['body']['shape'])}; ")
            parts.append("<code>prnav-design show FILE</code> draws it.</p>")
            continue
        body = Body(**{key: told["body"][key] for key in ("radius", "height") if key in told["body"]})
        design = Design(str(told["name"]), np.array(told["sensors"]), int(told["grid"]), body)
        parts.append(_figure(style.data_uri(draw_design(design)), f"The design {design.name} on the body."))
    return parts


def _figure(uri: str, caption: str) -> str:
    words = html.escape(caption)
    return f'<figure><img src="{uri}" alt="{words}"><figcaption>{words}</figcaption></figure>'


def _details(name: str, facts: Mapping[str, JSON]) -> str:
    text = html.escape(json.dumps(facts, indent=1))
    return f"<details><summary>{html.escape(name)}</summary><pre>{text}</pre></details>"


def _name(run: RunRecords, evaluation: Evaluation) -> str:
    label = evaluation.label if evaluation.label.startswith(run.name) else f"{run.name}: {evaluation.label}"
    return f"{label} on {evaluation.header.get('split', evaluation.directory.name)}"


def _trained(run: RunRecords) -> str:
    """One line on a run's budget and warm start."""
    if not run.metrics:
        return ""
    steps = int(run.metrics[-1].get("step", 0))
    warm = run.facts.get("warm_start", "none")
    return f"{run.name}: {steps:,} environment steps; warm start: {warm}."
