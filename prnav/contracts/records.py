"""What is kept of played episodes: typed outcomes, traces with a name for every array, and which of them are shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from prnav.aliases import JSON, Array, JSONObject
from prnav.errors import RecordError

Outcome = JSONObject
"""One finished episode: ``scene_id`` and ``episode_id``, then facts and measures by name, in JSON's types."""

Header = JSONObject
"""What an evaluation was made of and by whom, in JSON's types: the head of its records."""


@dataclass(frozen=True, eq=False)
class Trace:
    """What happened in an episode of T steps."""

    states: Mapping[str, Array]
    """Arrays of what was true before the first step and after each, (T + 1, ...)."""
    steps: Mapping[str, Array]
    """Arrays of what each step did and met, (T, ...); ``actions`` is always there."""

    def __len__(self) -> int:
        return len(self.steps["actions"])

    def __getitem__(self, name: str) -> Array:
        """The array of that name, of states or of steps.

        Raises:
            RecordError: there is none.
        """
        for arrays in (self.states, self.steps):
            if name in arrays:
                return arrays[name]
        have = ", ".join(sorted([*self.states, *self.steps]))
        raise RecordError(f"records: an episode's trace has no {name!r}, only {have}; evaluate again with --restart")


@dataclass(frozen=True, eq=False)
class Played:
    """One finished episode: its place in the list, its outcome, its trace."""

    index: int
    row: Outcome
    trace: Trace


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A finished evaluation as read from its folder."""

    directory: Path
    header: Header
    """What was evaluated, with ``measures`` and ``episodes``."""
    rows: list[Outcome]
    """One row per episode; null stands for infinity."""

    @property
    def ids(self) -> list[tuple[str, str]]:
        """(scene_id, episode_id) of every row."""
        return [(str(row["scene_id"]), str(row["episode_id"])) for row in self.rows]

    @property
    def label(self) -> str:
        """Agent and how it chose actions, for example "pr-2 (greedy)"."""
        actions = self.header.get("actions", "rule")
        name = str(self.header.get("agent", self.directory.name))
        kind = [actions] if actions in ("greedy", "sampled") and name != "random" else []
        kind += ["invisible target"] if self.header.get("target") == "invisible" else []
        return f"{name} ({', '.join(kind)})" if kind else name


RANDOM_SEED = 0
"""Of the episodes that are picked at random, so that nobody can choose them."""


def pick_episodes(rows: Sequence[Mapping[str, JSON]], each: int = 3) -> dict[str, list[int]]:
    """Indices of the worst and best episodes, and of some drawn at random; none appears twice.

    Episodes are ordered by SPL, success or reward, whichever they have first; equals by SoftSPL, then by how far from
    the goal they ended, then by the length of the shortest path, so that the best are hard episodes done well and the
    worst are the farthest misses.
    """
    order = sorted(range(len(rows)), key=lambda index: _rank(rows[index]))
    each = min(each, max(1, len(order) // 3))
    worst = order[:each]
    best = [index for index in order[::-1][:each] if index not in worst]
    taken = {*worst, *best}
    drawn = np.random.Generator(np.random.PCG64(RANDOM_SEED)).permutation(len(rows)).tolist()
    return {"worst": worst, "best": best, "random": [index for index in drawn if index not in taken][:each]}


def pick_pairs(rows: Sequence[Mapping[str, JSON]], others: Sequence[Mapping[str, JSON]]) -> dict[str, int]:
    """Index of the episode that the first did best by against the second, of the opposite one, and of one at random.

    Both are of the same episodes in the same order; "best" is ordered as in :func:`pick_episodes`.
    """
    gain = [tuple(a - b for a, b in zip(_score(x), _score(y), strict=True)) for x, y in zip(rows, others, strict=True)]
    order = sorted(range(len(rows)), key=gain.__getitem__)
    if len(order) == 1:
        return {"random": order[0]}
    drawn = np.random.Generator(np.random.PCG64(RANDOM_SEED)).permutation(len(rows)).tolist()
    others_left = [index for index in drawn if index not in (order[0], order[-1])]
    picks = {"first": order[-1], "second": order[0]}
    return {**picks, "random": others_left[0]} if others_left else picks


def _score(row: Mapping[str, JSON]) -> tuple[float, float]:
    main = next((row[name] for name in ("spl", "success", "return", "reward") if row.get(name) is not None), 0.0)
    return float(main), round(float(row.get("soft_spl", 0.0)), 3)


def _rank(row: Mapping[str, JSON]) -> tuple[float, ...]:
    remaining = row.get("distance_to_goal")
    far = float(np.inf if remaining is None else remaining)
    return (*_score(row), -far, float(row.get("geodesic_distance") or 0.0))
