"""Several evaluations side by side: differences paired by episode, and runs that differ by their seed as one."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prnav.contracts import Evaluation
from prnav.contracts.measures import MEASURES
from prnav.evaluate.intervals import Interval, interval_over_run_groups, interval_over_runs, paired_difference
from prnav.evaluate.summary import column

COMPARED: tuple[str, ...] = ("success", "spl", "soft_spl", "soft_spl_closest", "distance_to_goal", "collisions")
"""Measures of which differences are told."""


@dataclass(frozen=True, eq=False)
class Difference:
    """How an evaluation differs from the first one, episode by episode."""

    name: str
    baseline: str
    measures: dict[str, Interval]
    """Mean of this minus the baseline, by measure; an interval without 0 in it is a difference at 95 %."""


@dataclass(frozen=True, eq=False)
class SeedGroup:
    """Runs of one recipe that differ by their seed, evaluated alike."""

    name: str
    seeds: tuple[int, ...]
    measures: dict[str, Interval]
    """Mean over runs and episodes, with the interval over both."""
    members: tuple[Evaluation, ...]
    """The runs' evaluations, in the order of ``seeds``."""


def same_episodes(evaluations: Sequence[Evaluation]) -> bool:
    """Whether all evaluations played the same list of episodes."""
    return len({evaluation.header.get("episodes_hash") for evaluation in evaluations}) <= 1


def differences(evaluations: Sequence[Evaluation], names: Sequence[str]) -> list[Difference]:
    """Each evaluation after the first against it; empty where they are not of the same episodes."""
    if len(evaluations) < 2 or not same_episodes(evaluations):
        return []
    first = evaluations[0]
    keys = [key for key in COMPARED if all(key in evaluation.rows[0] for evaluation in evaluations)]
    result = []
    for name, evaluation in zip(names[1:], evaluations[1:], strict=True):
        pairs = {key: (column(evaluation.rows, key), column(first.rows, key)) for key in keys}
        bounded = {key: pair for key, pair in pairs.items() if all(np.isfinite(values).all() for values in pair)}
        result.append(Difference(name, names[0], {key: paired_difference(*pair) for key, pair in bounded.items()}))
    return result


def seed_groups(evaluations: Sequence[Evaluation]) -> list[SeedGroup]:
    """Evaluations of several seeds of one recipe, taken together."""
    groups: dict[tuple[object, ...], list[Evaluation]] = {}
    for evaluation in evaluations:
        head = evaluation.header
        recipe = (head.get("checkpoint") or {}).get("recipe")
        if recipe is not None:
            kind = (recipe, head["checkpoint"]["steps"], *(head.get(key) for key in ("actions", "target", "seed")))
            groups.setdefault((*kind, head.get("episodes_hash")), []).append(evaluation)
    result = []
    for members in groups.values():
        seeds = tuple(int(member.header["checkpoint"]["seed"]) for member in members)
        if len(set(seeds)) < 2 or len(set(seeds)) < len(seeds):
            continue
        keys = [measure.key for measure in MEASURES if all(measure.key in member.rows[0] for member in members)]
        values = {key: np.stack([column(member.rows, key) for member in members]) for key in keys}
        means = {key: interval_over_runs(table) for key, table in values.items() if np.isfinite(table).all()}
        label = shared_name([str(member.header.get("agent")) for member in members])
        result.append(SeedGroup(f"{label} ({members[0].header.get('actions')})", seeds, means, tuple(members)))
    return result


def group_differences(groups: Sequence[SeedGroup]) -> list[Difference]:
    """Each group of seeds after the first against it, where they played the same episodes: over seeds and episodes."""
    result = []
    for group in groups[1:]:
        if not same_episodes([*groups[0].members, *group.members]):
            continue
        measures = {}
        for key in COMPARED:
            if key in group.measures and key in groups[0].measures:
                ours, theirs = (
                    np.stack([column(member.rows, key) for member in one.members]) for one in (group, groups[0])
                )
                measures[key] = interval_over_run_groups(ours, theirs)
        result.append(Difference(group.name, groups[0].name, measures))
    return result


def shared_name(names: Sequence[str]) -> str:
    """One name for runs that differ by their seed: what all begin with, or all of them."""
    start = os.path.commonprefix(list(names)).rstrip("-_. ")
    return start if len(start) >= 3 else ", ".join(dict.fromkeys(names))
