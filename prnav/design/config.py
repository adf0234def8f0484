"""One search for a design as pure data: what ``configs/design-*.toml`` hold."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from prnav import catalog
from prnav.aliases import JSON, Untyped
from prnav.checks import require_at_least
from prnav.config import TYPE_OF, load_config
from prnav.design.joint import JointConfig
from prnav.design.methods import METHODS
from prnav.design.search import SearchConfig
from prnav.design.specialist import SpecialistConfig
from prnav.errors import ConfigError
from prnav.registry import require_known
from prnav.resources import resource
from prnav.sensors import Design, DesignSpace, load_design, random_design
from prnav.train import TrainConfig


def probe_type(table: Mapping[str, JSON]) -> type:
    """Class of the table [proxy] in a search's config: that of the task which [train] names.

    Raises:
        ConfigError: no such task, or it has no state probe.
    """
    train = table.get("train", {})
    name = str(train.get("task", "pointgoal")) if isinstance(train, Mapping) else "pointgoal"
    probe = catalog.task_spec(name).probe
    if probe is None:
        raise ConfigError(f"task {name!r} has no state probe; leave out [proxy], and score by specialists")
    return probe.config_type


@dataclass(frozen=True)
class OptimizeConfig:
    """A search: where it starts, how it searches, what it is scored by, and how its result is judged."""

    name: str = "design"
    seed: int = 0
    """Of initial designs, proposals and trainings."""
    initial: str = "random"
    """Initial design: "random", a name of the library, or a design file."""
    sensors: int = 2
    """Sensors of a random initial design."""
    grid: int = 4
    """Receptors per row of a random initial design's sensors."""
    starts: int = 1
    """Searches, each from an initial design of its own where these are random; the best one is the result."""
    frozen: tuple[str, ...] = ()
    """Axes that stay as they are, beside those that a design file freezes."""
    method: str = "joint"
    """A name of :data:`prnav.design.methods.METHODS`."""
    score: Literal["proxy", "specialist"] = "proxy"
    """What searches other than "joint" score a design by; "halving" always trains specialists."""
    measure: str = "soft_spl_closest"
    """Measure of a specialist that counts: one of the task's."""
    budget: int = 0
    """Steps that a search may spend in all, of specialists or of readings for the proxy, so that methods can be
    compared; 0 asks for ``search.trials`` designs instead. The joint method spends ``train.total_steps``."""
    judge: bool = True
    """Whether to end by training a specialist at the initial and at the found design, with equal budgets and seeds
    that no search uses."""
    judge_steps: int = 0
    """Steps of each of these; 0 for ``specialist.steps``."""
    judge_split: str = ""
    """Built-in homes that these play in; empty for ``specialist.split``. A search that scores designs by specialists
    has chosen the luckiest on that split: another one is needed to say what its design is worth."""
    judge_seeds: int = 1
    """Specialists per design."""
    joint: JointConfig = field(default_factory=JointConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    proxy: Untyped = field(default=None, metadata={TYPE_OF: probe_type})
    """Settings of the task's state probe (:attr:`prnav.contracts.TaskSpec.probe`); its defaults where left out."""
    specialist: SpecialistConfig = field(default_factory=SpecialistConfig)
    train: TrainConfig = field(default_factory=TrainConfig)

    def __post_init__(self) -> None:
        require_known(self.method, METHODS, "method")
        for field_name, measure in (("measure", self.measure), *self._joint_measure()):
            if measure not in self.train.spec.measures:
                valid = ", ".join(map(repr, self.train.spec.measures))
                raise ValueError(f"{field_name} is {measure!r}; valid for {self.train.task}: {valid}")
        if self.proxy is None and self.train.spec.probe is not None:
            object.__setattr__(self, "proxy", self.train.spec.probe.config_type())
        require_at_least(self, 1, "sensors", "grid", "starts", "judge_seeds")
        require_at_least(self, 0, "budget", "seed", "judge_steps")

    def _joint_measure(self) -> list[tuple[str, str]]:
        return [("joint.score", self.joint.score)] if self.method == "joint" else []

    @property
    def trials(self) -> int:
        """Designs that a search tries."""
        return max(1, self.budget // self.cost_steps) if self.budget else self.search.trials

    @property
    def final(self) -> SpecialistConfig:
        """The specialists that end a search."""
        own = self.specialist
        return replace(own, steps=self.judge_steps or own.steps, split=self.judge_split or own.split)

    @property
    def cost_steps(self) -> int:
        """Steps that the score of one design takes."""
        return self.proxy.cost_steps if self.score == "proxy" else self.specialist.steps

    def initial_design(self, start: int = 0) -> Design:
        """Initial design of a start.

        Raises:
            DesignError: it cannot be read.
        """
        if self.initial == "random":
            return random_design(self.seed + start, self.sensors, self.grid, space=DesignSpace(frozen=self.frozen))
        design = load_design(self.initial)
        frozen = tuple(dict.fromkeys((*design.space.frozen, *self.frozen)))
        return replace(design, space=replace(design.space, frozen=frozen))


def config_names() -> list[str]:
    """Names of the shipped searches."""
    return sorted(path.stem for path in resource("configs").glob("design-*.toml"))


def load_optimize_config(name: str, overrides: tuple[str, ...] = ()) -> OptimizeConfig:
    """Config of a shipped search or a TOML file, with ``key=value`` overrides.

    Raises:
        ConfigError: neither, or a wrong key or value.
    """
    if name in config_names():
        path = resource("configs", f"{name}.toml")
    elif name.endswith(".toml") or os.sep in name:
        path = Path(name)
    else:
        raise ConfigError(
            f"config {name!r} is not known; valid: {', '.join(config_names())}, or the path of a TOML file"
        )
    return load_config(OptimizeConfig, path, overrides)
