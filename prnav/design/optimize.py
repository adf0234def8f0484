"""A search for a design from start to end: initial designs, the search, specialists, and what was found as files.

A search's folder: ``config.toml``; ``start-N/`` with ``initial.toml``, ``found.toml``, the study or the joint run, and
``start.json`` when it is finished; ``results.jsonl`` (one line per specialist or generalist); ``design.toml``, the best
design. Interrupted, it resumes from what is there.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from prnav.config import config_hash, load_config, to_toml
from prnav.contracts import Progress, StateProbe
from prnav.design.config import OptimizeConfig
from prnav.design.cost import design_cost
from prnav.design.methods import SearchFacts, search_method
from prnav.design.specialist import Judge, ResultRow, mean_of, row_of
from prnav.errors import ConfigError
from prnav.files import write_text
from prnav.locks import held
from prnav.result_kinds import read_start
from prnav.sensors import Design, load_design, moved_design, save_design, theta_to_pose

Say = Callable[[str, int, int, str], None]
"""(stage, done, of, text): called as things get on."""


class StartFacts(SearchFacts):
    """``start.json``: what was found from one start."""

    start: int
    method: str
    score: str
    """What designs were scored by: "proxy", "specialist" or "generalist"."""


CONFIG, RESULTS, BEST = "config.toml", "results.jsonl", "design.toml"


class Optimizer:
    """One search in one folder."""

    def __init__(
        self,
        config: OptimizeConfig,
        folder: Path,
        say: Say = lambda stage, done, of, text: None,
        loading: Progress | None = None,
        storage: str | None = None,
        warn: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Search in ``folder``, new or interrupted.

        Args:
            config: what to do.
            folder: files of the search.
            say: told how it gets on.
            loading: told which scenes are loading.
            storage: address of the database that holds studies; a file in the folder otherwise.
            warn: told what trainings warn of.

        Raises:
            ConfigError: the folder holds another search.
        """
        self.config, self.folder, self.say, self.loading = config, folder, say, loading
        self.storage, self.warn = storage, warn
        self.method = search_method(config.method)
        self._judge: Judge | None = None
        self._final: Judge | None = None
        self._proxy: StateProbe | None = None
        path = folder / CONFIG
        if not path.exists():
            write_text(path, to_toml(config))
        elif config_hash(load_config(OptimizeConfig, path)) != config_hash(config):
            raise ConfigError(
                f"{path}: another search was started here; give its settings, or another folder with --out"
            )

    @property
    def judge(self) -> Judge:
        """Homes and episodes of specialists, loaded on first use."""
        if self._judge is None:
            self._judge = Judge(self.config.train, self.config.specialist, self.loading, warn=self.warn)
        return self._judge

    @property
    def final(self) -> Judge:
        """Judge of what was found: other seeds, and other homes where the config names some."""
        config = self.config
        if config.final == config.specialist:
            return self.judge
        if self._final is None:
            self._final = Judge(config.train, config.final, self.loading, self.judge, self.warn)
        return self._final

    @property
    def proxy(self) -> StateProbe:
        """The task's state probe, loaded on first use.

        Raises:
            ConfigError: the task has none.
        """
        if self._proxy is None:
            self._proxy = load_probe(self.config, self.loading)
        return self._proxy

    def run(self) -> Design:
        """Search from every start, judge, and leave the best design in ``design.toml``."""
        self.help()
        starts = [self.start(number, wait=True) for number in range(self.config.starts)]
        told = [start for start in starts if start is not None]
        rows: list[ResultRow] = [row for start in told for row in start.get("rows", [])]
        if self.config.judge:
            rows += self.judged()
        write_text(self.folder / RESULTS, "".join(json.dumps(row) + "\n" for row in rows))
        worth = {number: float(start["found"]) for number, start in enumerate(told)}
        if self.config.judge:
            worth = {n: float(np.mean(_scores(rows, f"optimised {n}", self.config.measure))) for n in worth}
        best = load_design(self.place(max(worth, key=lambda number: worth[number])) / "found.toml")
        save_design(best, self.folder / BEST)
        return best

    def help(self) -> None:
        """Do what is not held by another worker; a study is shared by all who come to it."""
        for number in range(self.config.starts):
            self.start(number, wait=False)
        if self.config.judge:
            self.judged(wait=False)

    def start(self, number: int, wait: bool = True) -> StartFacts | None:
        """One start: its initial and its found design, their scores by the search's own measure, and the steps.

        None if it is held by another worker and this one is not to ``wait``.
        """
        place = self.place(number)
        if self.method.shared and self.config.score == "proxy":
            return self._start(number)
        with held(place, wait) as mine:
            return self._start(number) if mine else None

    def _start(self, number: int) -> StartFacts:
        place = self.place(number)
        done = place / "start.json"
        if done.exists():
            return _read_start(done)
        initial = self.config.initial_design(number)
        save_design(initial, place / "initial.toml")
        found, facts = self.method.find(self, initial, number)
        if done.exists():  # another process on the same study was first
            return _read_start(done)
        save_design(found, place / "found.toml")
        told: StartFacts = {
            "start": number,
            "method": self.config.method,
            "score": self.method.scored_by or self.config.score,
            **facts,
        }
        write_text(done, json.dumps(told) + "\n")
        return told

    def judged(self, wait: bool = True) -> list[ResultRow]:
        """Specialists at the initial and at the found design of every start that is finished.

        Those held by other workers are waited for, or left out.
        """
        config = self.config
        jobs = [
            (n, which, s)
            for n in range(config.starts)
            for which in ("initial", "found")
            for s in range(config.judge_seeds)
        ]
        rows: list[ResultRow] = []
        for index, (number, which, offset) in enumerate(jobs):
            self.say("specialists", index, len(jobs), f"start {number}, {which} design")
            place, seed = self.place(number), config.specialist.seed + 1 + offset  # the search's own was lucky
            if not (place / "start.json").exists():
                continue
            design, folder = load_design(place / f"{which}.toml"), place / f"specialist-{which}-{seed}"
            with held(folder, wait) as mine:
                if not mine:
                    continue
                measures = self.final.specialist(design, folder, seed=seed)
            group = f"{'initial' if which == 'initial' else 'optimised'} {number}"
            rows.append(row_of(design, measures, group=group, seed=seed, steps=config.final.steps))
        self.say("specialists", len(jobs), len(jobs), "done")
        return rows

    def place(self, number: int) -> Path:
        """Folder of a start."""
        return self.folder / f"start-{number}"

    def score(self, initial: Design, theta: NDArray[np.float64], number: int) -> float:
        """Score of theta (K, 7) around the initial design of a start, by the config's own measure, less its cost."""
        cost = 0.0
        if not self.config.joint.cost.free:
            cost = float(design_cost(theta_to_pose(theta, initial), initial, self.config.joint.cost))
        if self.config.score == "proxy":
            return self.proxy.score(initial, theta) - cost
        key = config_hash_of(theta)
        design = moved_design(initial, theta, f"trial-{key}")
        measures = self.judge.specialist(design, self.place(number) / "trials" / key)
        return mean_of(measures, self.config.measure) - cost


def _read_start(path: Path) -> StartFacts:
    return cast(StartFacts, read_start(path))


def load_probe(config: OptimizeConfig, progress: Progress | None = None) -> StateProbe:
    """The state probe of a search's task.

    Raises:
        ConfigError: the task has none.
    """
    train = config.train
    if train.spec.probe is None:
        raise ConfigError(f"task {train.task!r} has no state probe; score by specialists (score=specialist)")
    return train.spec.probe.load(config.proxy, train.env, progress)


def config_hash_of(theta: NDArray[np.float64]) -> str:
    """Name of theta: the same design has the same folder."""
    from prnav.cache import hash_arrays

    return hash_arrays({"theta": np.round(theta, 12) + 0.0})[:12]


def _scores(rows: list[ResultRow], group: str, measure: str) -> list[float]:
    return [float(np.mean(row["measures"][measure])) for row in rows if row["group"] == group]
