"""What a task brings: its settings, its environments, its evaluation, its pictures and its state probe.

``prnav.catalog`` finds a :class:`TaskSpec` by name. Everything behind it is a domain's own; what stands here is all
that training, design, evaluation and reports ask for.

Letters in shapes: N slots or environments, K sensors, T steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Progress, Untyped
from prnav.contracts.agents import Agent
from prnav.contracts.envs import BatchEnv, EpisodeSlots
from prnav.contracts.records import Evaluation, Header, Outcome, Trace

TaskConfig: TypeAlias = Untyped
"""A task's settings: a frozen dataclass of the class that its :attr:`TaskSpec.config_type` names."""

World: TypeAlias = Untyped
"""What a task has loaded and its environments share: scenes and episodes, or compiled models."""

Figure: TypeAlias = Untyped
"""A figure of matplotlib."""


@dataclass(frozen=True)
class EpisodeRequest:
    """Which episodes an evaluation is to play, as the command line says it; what is None is left to the task."""

    split: str | None = None
    episodes_file: str | None = None
    data: str | None = None
    data_root: str | None = None
    navmesh_from: str | None = None
    scenes: tuple[str, ...] = ()
    up: str | None = None
    target: str | None = None


class EvaluationSpec(Protocol):
    """How a task is evaluated."""

    agents: Sequence[str]
    """Names of its reference agents, all of which act by rules."""

    def config(self, trained: TaskConfig | None, request: EpisodeRequest) -> TaskConfig:
        """Settings of an evaluation, from those that a run was trained with (None for reference agents).

        Raises:
            ConfigError: the request does not fit the task.
        """
        ...

    def name(self, config: TaskConfig) -> str:
        """What the episodes are called, for a folder's name: a split, or a file."""
        ...

    def hint(self, config: TaskConfig) -> str:
        """Options of ``prnav-eval`` for episodes that a run of these settings has not been trained on, or ""."""
        ...

    def suffix(self, config: TaskConfig) -> str:
        """What an evaluation's folder is marked with where the task is played otherwise than by default, or ""."""
        ...

    def agent(self, name: str, config: TaskConfig, slots: EpisodeSlots) -> Agent:
        """Reference agent of that name.

        Raises:
            ConfigError: there is none, or the task does not tell what it needs.
        """
        ...

    def header(self, config: TaskConfig, world: World, slots: EpisodeSlots) -> Header:
        """What a result depends on beside the agent: episodes, rules, body, scenes; no path of this machine is in it.

        ``benchmark`` names what results of other versions do not compare with, or is None.
        """
        ...

    def places(self, world: World, episode: int) -> Outcome:
        """What a record holds of an episode beside its outcome, such as where it starts."""
        ...

    def current_benchmark(self, benchmark: str) -> str:
        """The present version of a benchmark that results were made for; itself where it has no versions."""
        ...

    def keep(self, evaluation: Evaluation, traces: Sequence[Trace], world: World, slots: EpisodeSlots) -> None:
        """Write beside the records what pictures need, so that no scene is needed later."""
        ...

    def recompute(self, row: Outcome, trace: Trace, header: Header) -> Mapping[str, float]:
        """Measures of an episode worked out anew from its trace, to hold a record to.

        Raises:
            RecordError: the header lacks what is needed.
        """
        ...


class Pictures(Protocol):
    """Figures of a task's episodes, drawn from what :meth:`EvaluationSpec.keep` left."""

    def episodes(self, evaluation: Evaluation, traces: Sequence[Trace]) -> Figure:
        """The worst, the best and some random episodes on one page."""
        ...

    def pairs(
        self,
        evaluations: tuple[Evaluation, Evaluation],
        traces: tuple[Sequence[Trace], Sequence[Trace]],
        names: tuple[str, str],
    ) -> Figure | None:
        """Two agents in the same episodes, side by side; None where nothing can be drawn."""
        ...

    def figures(self, evaluation: Evaluation, traces: Sequence[Trace]) -> list[tuple[Figure, str]]:
        """What a report shows of one evaluation, each figure with its caption."""
        ...

    def breakdown(self, evaluations: Sequence[Evaluation], names: Sequence[str]) -> tuple[Figure, str] | None:
        """How the score depends on the episode, with its caption; None where it is the same for all."""
        ...

    def film(self, evaluation: Evaluation, traces: Sequence[Trace]) -> list[Path]:
        """Write films of some episodes beside the records; their paths.

        Raises:
            PrnavError: the encoder is not installed.
        """
        ...

    def trace(self, world: World, episode: int, trace: Trace) -> NDArray[np.uint8]:
        """One episode as a small picture (H, W, 3)."""
        ...


class StateProbe(Protocol):
    """How much of a task's state can be read off a design's receptors."""

    def parts(self, design: Untyped, theta: ArrayLike | None = None) -> dict[str, float]:
        """R^2 of each group of state variables, for a :class:`prnav.sensors.Design` or theta (K, 7) around it."""
        ...

    def score(self, design: Untyped, theta: ArrayLike | None = None) -> float:
        """One number by which designs are ranked."""
        ...

    def weighted(self, parts: Mapping[str, float]) -> float:
        """That number from the parts."""
        ...


class ProbeSpec(Protocol):
    """A task's state probe and its settings."""

    config_type: type
    """Frozen dataclass; has ``cost_steps``, the readings that one score takes."""

    def load(self, config: Untyped, env: TaskConfig, progress: Progress | None = None) -> StateProbe:
        """The probe of a task played as ``env`` says.

        Raises:
            PrnavError: what it needs is missing or broken.
        """
        ...


class TaskSpec(Protocol):
    """A task."""

    name: str
    """As commands and configs have it."""
    preset: str
    """Name of the config that ``prnav-train`` takes by default."""
    config_type: type
    """Class of the table [env] of a run's config."""
    measures: Sequence[str]
    """Keys of :data:`prnav.contracts.measures.MEASURES` that its episodes have."""
    score: str
    """The measure that agents are ranked by."""
    evaluation: EvaluationSpec
    pictures: Pictures
    probe: ProbeSpec | None

    def prepare(self, config: TaskConfig, progress: Progress | None = None, limit: int | None = None) -> None:
        """Make what :meth:`load` needs and is not at hand, in several processes; commands call it first.

        It needs a main module that can be imported, as all of multiprocessing does; without it, ``load`` makes the
        same, one after the other.
        """
        ...

    def load(self, config: TaskConfig, progress: Progress | None = None, limit: int | None = None) -> World:
        """What environments of these settings share.

        Args:
            config: which.
            progress: called while it loads.
            limit: at most so many episodes.

        Raises:
            PrnavError: something is missing or broken.
        """
        ...

    def make_envs(self, config: TaskConfig, world: World, num_envs: int) -> BatchEnv:
        """``num_envs`` environments over a world."""
        ...

    def make_slots(self, config: TaskConfig, world: World, num_slots: int) -> EpisodeSlots:
        """``num_slots`` slots over a world's episodes."""
        ...

    def facts(self, config: TaskConfig, world: World) -> Header:
        """What a run is made from, for ``run.json``: hashes, not paths."""
        ...

    def notes(self, config: TaskConfig, world: World) -> list[str]:
        """Lines that a person should read before a run begins."""
        ...

    def validation(self, config: TaskConfig) -> TaskConfig:
        """Settings of the episodes that a run is validated on while it trains."""
        ...

    def held_out(self, config: TaskConfig, split: str) -> TaskConfig:
        """The same task on another split, where designs are judged."""
        ...

    def blind(self, config: TaskConfig) -> TaskConfig:
        """The same task without photoreceptors."""
        ...

    def with_design(self, config: TaskConfig, design: str, grid: int) -> TaskConfig:
        """The same task for an agent with the design of a file."""
        ...
