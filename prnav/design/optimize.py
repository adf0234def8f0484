"""A search for a design from start to end: initial designs, the search, specialists, and what was found as files.

A search's folder: ``config.toml``; ``start-N/`` with ``initial.toml``, ``found.toml``, the study or the joint run, and
``start.json`` when it is finished; ``results.jsonl`` (one line per specialist or generalist); ``design.toml``, the best
design. Interrupted, it goes on from what is there.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prnav.config import config_hash, load_config, to_toml
from prnav.contracts import Progress, StateProbe
from prnav.design import search as searching
from prnav.design.claims import held
from prnav.design.config import OptimizeConfig
from prnav.design.cost import design_cost
from prnav.design.designed_envs import DesignableEnvs
from prnav.design.joint import JointTrainer
from prnav.design.specialist import Judge, mean_of, row_of, specialist_config
from prnav.errors import ConfigError
from prnav.files import write_text
from prnav.result_kinds import read_start
from prnav.sensors import Design, load_design, moved_design, save_design, theta_to_pose, with_free_values
from prnav.train import RunFolder

Say = Callable[[str, int, int, str], None]
"""(stage, done, of, text): called as things get on."""

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
        rows: list[dict[str, Any]] = [row for start in told for row in start.get("rows", [])]
        if self.config.judge:
            rows += self.judged()
        write_text(self.folder / RESULTS, "".join(json.dumps(row) + "\n" for row in rows))
        worth = {number: float(start["found"]) for number, start in enumerate(told)}
        if self.config.judge:
            worth = {n: float(np.mean(_scores(rows, f"optimised {n}", self.config.measure))) for n in worth}
        best = load_design(self._place(max(worth, key=lambda number: worth[number])) / "found.toml")
        save_design(best, self.folder / BEST)
        return best

    def help(self) -> None:
        """Do what no other process on this search is doing; a study is shared by all who come to it."""
        for number in range(self.config.starts):
            self.start(number, wait=False)
        if self.config.judge:
            self.judged(wait=False)

    def start(self, number: int, wait: bool = True) -> dict[str, Any] | None:
        """One start: its initial and its found design, their scores by the search's own measure, and the steps.

        None if another process is at it and this one is not to ``wait``.
        """
        place = self._place(number)
        if self.config.method in searching.SAMPLERS and self.config.score == "proxy":
            return self._start(number)
        with held(place, wait) as mine:
            return self._start(number) if mine else None

    def _start(self, number: int) -> dict[str, Any]:
        place = self._place(number)
        done = place / "start.json"
        if done.exists():
            return read_start(done)
        initial = self.config.initial_design(number)
        save_design(initial, place / "initial.toml")
        method = {"joint": self._joint, "halving": self._halving}.get(self.config.method, self._study)
        found, facts = method(initial, number)
        if done.exists():  # another process on the same study was first
            return read_start(done)
        save_design(found, place / "found.toml")
        score = {"joint": "generalist", "halving": "specialist"}.get(self.config.method, self.config.score)
        facts = {"start": number, "method": self.config.method, "score": score, **facts}
        write_text(done, json.dumps(facts) + "\n")
        return facts

    def judged(self, wait: bool = True) -> list[dict[str, Any]]:
        """Specialists at the initial and at the found design of every start that is finished.

        Those that other processes are at are waited for, or left out.
        """
        config = self.config
        jobs = [
            (n, which, s)
            for n in range(config.starts)
            for which in ("initial", "found")
            for s in range(config.judge_seeds)
        ]
        rows = []
        for index, (number, which, offset) in enumerate(jobs):
            self.say("specialists", index, len(jobs), f"start {number}, {which} design")
            place, seed = self._place(number), config.specialist.seed + 1 + offset  # the search's own was lucky
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

    def _place(self, number: int) -> Path:
        return self.folder / f"start-{number}"

    def _study(self, initial: Design, number: int) -> tuple[Design, dict[str, Any]]:
        config = self.config
        settings = searching.SearchConfig(config.trials, config.search.bound)

        def report(trial: searching.Trial, best: searching.Trial) -> None:
            text = (
                f"start {number}: design {trial.number} {trial.score:.4f}, best {best.score:.4f} (design {best.number})"
            )
            self.say("search", trial.number + 1, config.trials, text)

        trials = searching.search(
            config.method,  # type: ignore[arg-type]
            initial,
            lambda theta: self._score(initial, theta, number),
            settings,
            self.storage or self._place(number) / "study.log",
            config.seed + number,
            f"{config.name}-{config.method}-{config_hash(config)[:8]}-{number}",  # one database may hold many searches
            report,
        )
        best = searching.best_of(trials)
        name = f"{initial.name}-{config.method}"
        text = (
            f"Found from {initial.name} by {config.method} search, {len(trials)} designs scored by the {config.score}."
        )
        found = moved_design(initial, with_free_values(best.values, initial), name, text)
        spent = config.cost_steps * len(trials)
        facts = {
            "initial": searching.initial_of(trials).score,
            "found": best.score,
            "trials": len(trials),
            "steps": spent,
        }
        return found, {**facts, "scores": [trial.score for trial in trials]}

    def _score(self, initial: Design, theta: NDArray[np.float64], number: int) -> float:
        cost = 0.0
        if not self.config.joint.cost.free:
            cost = float(design_cost(theta_to_pose(theta, initial), initial, self.config.joint.cost))
        if self.config.score == "proxy":
            return self.proxy.score(initial, theta) - cost
        key = config_hash_of(theta)
        design = moved_design(initial, theta, f"trial-{key}")
        measures = self.judge.specialist(design, self._place(number) / "trials" / key)
        return mean_of(measures, self.config.measure) - cost

    def _halving(self, initial: Design, number: int) -> tuple[Design, dict[str, Any]]:
        config, search = self.config, self.config.search
        budget = config.budget or search.trials * config.specialist.steps
        count = searching.halving_candidates(budget, search.first_steps, search.halving)
        values = searching.random_values(initial, count, search.bound, config.seed + number)
        designs = [
            moved_design(initial, with_free_values(row, initial), f"{initial.name}-halving-{i}")
            for i, row in enumerate(values)
        ]
        first: dict[int, float] = {}

        def score(index: int, steps: int) -> float:
            folder = self._place(number) / "trials" / str(index)
            value = mean_of(
                self.judge.specialist(designs[index], folder, steps, warm_for=search.first_steps), config.measure
            )
            return first.setdefault(index, value) if steps == search.first_steps else value

        def report(steps: int, index: int, value: float) -> None:
            self.say("search", index + 1, count, f"start {number}: design {index} {value:.4f} after {steps:,} steps")

        best, way = searching.successive_halving(range(count), score, search.first_steps, search.halving, report)
        spent = searching.halving_cost(count, search.first_steps, search.halving)
        facts = {
            "initial": first[0],
            "found": way[-1][1],
            "trials": count,
            "steps": spent,
            "scores": list(first.values()),
        }
        return designs[best], facts

    def _joint(self, initial: Design, number: int) -> tuple[Design, dict[str, Any]]:
        config, place = self.config, self._place(number)
        total = config.train.total_steps
        train = specialist_config(config.train, initial, place / "joint", total, config.seed + number)
        save_design(initial, place / "joint" / "design.toml")
        base = load_design(place / "joint" / "design.toml")

        def report(row: dict[str, Any]) -> None:
            losses = row["losses"]
            text = f"start {number}: {row['phase']}"
            text += "".join(
                f"  {name} {row['measures'][name]:.3f}" for name in ("success", "soft_spl") if name in row["measures"]
            )
            text += f"  design moved {losses['design_moved']:.2f}" if "design_moved" in losses else ""
            self.say("joint", row["step"], total, text)

        envs = train.spec.make_envs(train.env, self.judge.training(), train.num_envs)
        if not isinstance(envs, DesignableEnvs):
            raise ConfigError(
                f"task {train.task!r} has no sensors whose design can be set; take one that has receptors"
            )
        trainer = JointTrainer(train, config.joint, envs, base, RunFolder(place / "joint"), report, self.warn)
        try:
            trainer.begin()
            if trainer.train() is not None:
                raise KeyboardInterrupt
            found, theta = trainer.best_design(f"{initial.name}-joint"), trainer.theta
        finally:
            trainer.close()
        rows, scores = [], []
        for which, at in (("initial", np.zeros_like(theta)), ("optimised", theta)):
            measures = self.judge.judge(trainer.policy.eval(), base, at, train.env)
            scores.append(mean_of(measures, config.measure))
            design = found if which == "optimised" else base
            rows.append(row_of(design, measures, group=f"generalist, {which} {number}", seed=train.seed, steps=total))
        return found, {"initial": scores[0], "found": scores[1], "trials": 0, "steps": total, "rows": rows}


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


def _scores(rows: list[dict[str, Any]], group: str, measure: str) -> list[float]:
    return [float(np.mean(row["measures"][measure])) for row in rows if row["group"] == group]
