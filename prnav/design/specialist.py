"""The performance of a design: a control policy trained for it alone, on homes that the policy has never seen.

This is the inner loop of the paper's bi-level problem, and what all figures of designs report. S episodes.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NotRequired, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from prnav.checks import require_at_least
from prnav.contracts import MEASURES, Progress, TaskConfig, World
from prnav.design.judging import Measures, play_design
from prnav.files import write_text
from prnav.policy import Policy
from prnav.result_kinds import read_judged
from prnav.sensors import Design, save_design
from prnav.train import RunFolder, TrainConfig, Trainer, load_policy


@dataclass(frozen=True)
class SpecialistConfig:
    """Budget of a specialist, and the episodes it is judged by."""

    steps: int = 150_000
    """Simulation steps of training; the warm start keeps its share of them."""
    episodes: int = 160
    split: str = "val"
    """Split of the episodes: of navigation tasks, the built-in homes."""
    num_envs: int = 80
    """Episodes played at once."""
    seed: int = 0
    """Of weights, actions and episode order."""

    def __post_init__(self) -> None:
        require_at_least(self, 1, "steps", "episodes", "num_envs")


class Judge:
    """Homes and episodes that designs are trained and judged on, loaded once."""

    def __init__(
        self,
        train: TrainConfig,
        config: SpecialistConfig,
        progress: Progress | None = None,
        like: Judge | None = None,
        warn: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Judge by ``config`` of specialists trained as ``train`` says, in the homes of another judge's if given.

        Args:
            train: how specialists are trained.
            config: their budget, and the episodes they are judged by.
            progress: called while scenes load.
            like: a judge that has loaded the same training homes.
            warn: told what trainings warn of.

        Raises:
            PrnavError: scenes or episodes are missing or broken.
        """
        self.train, self.config = train, config
        self._progress, self._warn = progress, warn
        self._like = like
        self._worlds: dict[str, World] = {}

    def training(self) -> World:
        """What training environments share."""
        if self._like is not None:
            return self._like.training()
        if "training" not in self._worlds:
            self._worlds["training"] = self.train.spec.load(self.train.env, self._progress)
        return self._worlds["training"]

    def questions(self) -> World:
        """What the episodes of judging share."""
        if "questions" not in self._worlds:
            env = self.train.spec.held_out(self.train.env, self.config.split)
            self._worlds["questions"] = self.train.spec.load(env, self._progress, self.config.episodes)
        return self._worlds["questions"]

    def specialist(
        self,
        design: Design,
        folder: Path,
        steps: int | None = None,
        seed: int | None = None,
        warm_for: int | None = None,
    ) -> Measures:
        """Measures (S,) of a specialist at ``design``, trained in ``folder``; resumes where an earlier call stopped.

        Args:
            design: what the agent sees with.
            folder: files of the run.
            steps: budget in place of the config's.
            seed: in place of the config's.
            warm_for: budget whose share of warm start it has, where ``steps`` grow from call to call.
        """
        budget, own = steps or self.config.steps, self.config.seed if seed is None else seed
        config = specialist_config(self.train, design, folder, budget, own, warm_for)
        done = folder / "judged.json"
        asked = {"steps": config.total_steps, "seed": config.seed, "episodes": self.config.episodes}
        if done.exists():
            told = read_judged(done)
            if told["asked"] == asked:
                return {name: np.array(values) for name, values in told["measures"].items()}
        policy = self._trained(config, design, RunFolder(folder))
        measures = self.judge(policy, design, np.zeros((design.num_sensors, 7)), config.env)
        told = {"asked": asked, "measures": {name: values.tolist() for name, values in measures.items()}}
        write_text(done, json.dumps(told) + "\n")
        return measures

    def judge(self, policy: Policy, design: Design, theta: ArrayLike, env: TaskConfig | None = None) -> Measures:
        """Measures (S,) of a policy at theta (K, 7) around ``design``; a generalist at its design policy's mean."""
        spec = self.train.spec
        settings = spec.held_out(self.train.env if env is None else env, self.config.split)
        slots = spec.make_slots(settings, self.questions(), self.config.num_envs)
        return play_design(policy, slots, theta, self.config.seed)

    def _trained(self, config: TrainConfig, design: Design, folder: RunFolder) -> Policy:
        path = folder.path / "design.toml"
        if not path.exists():
            save_design(design, path)
        envs = config.spec.make_envs(config.env, self.training(), config.num_envs)
        trainer = Trainer(config, envs, folder, warn=self._warn)
        try:
            trainer.begin()
            if trainer.train() is not None:
                raise KeyboardInterrupt
        finally:
            trainer.close()
        return load_policy(folder)[0]


def specialist_config(
    train: TrainConfig, design: Design, folder: Path, steps: int, seed: int, warm_for: int | None = None
) -> TrainConfig:
    """``train`` for one design and budget; the warm start keeps its share of the steps (or of ``warm_for``)."""
    warm = (warm_for or steps) * train.imitation.steps // train.total_steps
    return replace(
        train,
        name=folder.name,
        seed=seed,
        total_steps=steps,
        checkpoint_steps=max(steps, 1),
        keep_checkpoints=1,
        imitation=replace(train.imitation, steps=warm),
        env=train.spec.with_design(train.env, str(folder / "design.toml"), design.grid),
    )


class ResultRow(TypedDict):
    """One line of results: who, what it cost, and each episode's measures."""

    design: str
    """Name of the design."""
    sensors: int
    grid: int
    group: str
    """What the design stands for in a figure, such as "initial 0"."""
    seed: int
    steps: int
    """Of training."""
    task: NotRequired[str]
    kind: NotRequired[str]
    """The analysis that asked for it."""
    measures: dict[str, list[float]]
    """One value for each episode."""


class RowFacts(TypedDict):
    """What a row says beside design and measures."""

    group: str
    seed: int
    steps: int
    task: NotRequired[str]
    kind: NotRequired[str]


def row_of(design: Design, measures: Measures, **facts: Unpack[RowFacts]) -> ResultRow:
    """One line of results."""
    kept = tuple(measure.key for measure in MEASURES)
    return {
        "design": design.name,
        "sensors": design.num_sensors,
        "grid": design.grid,
        **facts,
        "measures": {name: [round(float(v), 6) for v in measures[name]] for name in kept if name in measures},
    }


def mean_of(measures: Measures, name: str) -> float:
    """Mean of a measure over the episodes."""
    return float(np.mean(measures[name]))


__all__ = ["Judge", "ResultRow", "SpecialistConfig", "mean_of", "row_of", "specialist_config"]
