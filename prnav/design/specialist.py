"""The performance of a design: a control policy trained for it alone, on homes that the policy has never seen.

This is the inner loop of the paper's bi-level problem, and what all figures of designs report. S episodes.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from prnav.design.play import Measures, play
from prnav.domains.navigation.env import EnvConfig, EpisodeSource, NavigationVectorEnv, load_source
from prnav.files import write_text
from prnav.policy import RecurrentPolicy
from prnav.result_kinds import read_judged
from prnav.sensors import Design, save_design
from prnav.sim.world import Progress
from prnav.train import RunFolder, TrainConfig, Trainer, load_policy


@dataclass(frozen=True)
class SpecialistConfig:
    """Budget of a specialist, and the episodes it is judged by."""

    steps: int = 150_000
    """Simulation steps of training; the warm start keeps its share of them."""
    episodes: int = 160
    split: str = "val"
    """Built-in homes of the episodes."""
    num_envs: int = 80
    """Episodes played at once."""
    seed: int = 0
    """Of weights, actions and episode order."""

    def __post_init__(self) -> None:
        for name in ("steps", "episodes", "num_envs"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least 1")


class Judge:
    """Homes and episodes that designs are trained and judged on, loaded once."""

    def __init__(
        self,
        train: TrainConfig,
        config: SpecialistConfig,
        progress: Progress | None = None,
        like: Judge | None = None,
    ) -> None:
        """Judge by ``config`` of specialists trained as ``train`` says, in the homes of another judge's if given.

        Raises:
            PrnavError: scenes or episodes are missing or broken.
        """
        self.train, self.config = train, config
        self._progress = progress
        self._like = like
        self._sources: dict[str, EpisodeSource] = {}

    def training(self) -> EpisodeSource:
        """Homes and episodes of training."""
        if self._like is not None:
            return self._like.training()
        if "training" not in self._sources:
            self._sources["training"] = load_source(self.train.env, self._progress)
        return self._sources["training"]

    def questions(self) -> EpisodeSource:
        """Homes and episodes of judging."""
        if "questions" not in self._sources:
            env = replace(self.train.env, scenes=self.config.split, episodes=None, max_scenes=None)
            self._sources["questions"] = load_source(env, self._progress, limit=self.config.episodes)
        return self._sources["questions"]

    def specialist(
        self,
        design: Design,
        folder: Path,
        steps: int | None = None,
        seed: int | None = None,
        warm_for: int | None = None,
    ) -> Measures:
        """Measures (S,) of a specialist at ``design``, trained in ``folder``; goes on where an earlier call stopped.

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

    def judge(
        self, policy: RecurrentPolicy, design: Design, theta: ArrayLike, env: EnvConfig | None = None
    ) -> Measures:
        """Measures (S,) of a policy at theta (K, 7) around ``design``; a generalist at its design policy's mean."""
        source = self.questions()
        count = min(self.config.num_envs, len(source))
        settings = replace(env or self.train.env, scenes=self.config.split)
        envs = make_envs(count, settings, source)
        return play(policy, envs, np.arange(len(source)), theta, self.config.seed)

    def _trained(self, config: TrainConfig, design: Design, folder: RunFolder) -> RecurrentPolicy:
        path = folder.path / "design.toml"
        if not path.exists():
            save_design(design, path)
        trainer = Trainer(config, make_envs(config.num_envs, config.env, self.training()), folder)
        try:
            if trainer.train() is not None:
                raise KeyboardInterrupt
        finally:
            trainer.close()
        return load_policy(folder)[0]


def make_envs(count: int, config: EnvConfig, source: EpisodeSource) -> NavigationVectorEnv:
    """``count`` agents over a source."""
    return NavigationVectorEnv(count, config, source=source)


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
        env=replace(train.env, design=str(folder / "design.toml"), grid=design.grid),
    )


def row_of(design: Design, measures: Measures, **facts: Any) -> dict[str, Any]:
    """One line of results: who, what it cost, and each episode's measures."""
    kept = ("success", "spl", "soft_spl", "soft_spl_closest", "reward", "distance_to_goal")
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


__all__ = ["Judge", "SpecialistConfig", "make_envs", "mean_of", "row_of", "specialist_config"]
