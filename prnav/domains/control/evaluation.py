"""How control tasks are evaluated: which episodes, by whom, and what records hold of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from prnav.cache import hash_arrays
from prnav.config import to_mapping
from prnav.contracts import Agent, EpisodeRequest, EpisodeSlots, Evaluation, Header, Outcome, Trace
from prnav.domains.control.agents import REFERENCE_AGENTS, reference_agent
from prnav.domains.control.env.config import SPLITS, ControlConfig
from prnav.domains.control.env.slots import ControlSlots
from prnav.errors import ConfigError, RecordError

World = tuple[int, ...]
"""Seeds of the episodes."""


@dataclass(frozen=True)
class ControlEvaluation:
    """An :class:`prnav.contracts.EvaluationSpec` over seeded episodes."""

    config_type: type[ControlConfig]
    agents: Sequence[str] = REFERENCE_AGENTS

    def config(self, trained: ControlConfig | None, request: EpisodeRequest) -> ControlConfig:
        """The run's environment, or one whose agent is given the state, on the split that was asked for or "test".

        Raises:
            ConfigError: the request is for scenes or files, which these tasks have none of, or for no split.
        """
        asked = dataclasses.asdict(request)
        split = asked.pop("split") or "test"
        wrong = [name for name, value in asked.items() if value]
        if wrong:
            raise ConfigError(
                f"--{wrong[0].replace('_', '-')}: {self.config_type.task} has no scenes or episode files; choose its "
                f"episodes by --split ({', '.join(SPLITS)})"
            )
        if split not in SPLITS:
            raise ConfigError(f"--split {split}: {self.config_type.task} has no such split; valid: {', '.join(SPLITS)}")
        config = self.config_type(senses="state") if trained is None else trained
        return dataclasses.replace(config, split=split)

    def name(self, config: ControlConfig) -> str:
        """The split."""
        return config.split

    def hint(self, config: ControlConfig) -> str:
        """The test split."""
        return "--split test"

    def suffix(self, config: ControlConfig) -> str:
        """What tells an action repeat of one's own from the paper's."""
        return f"-repeat{config.repeat}" if config.repeat != config.facts.action_repeat else ""

    def agent(self, name: str, config: ControlConfig, slots: EpisodeSlots) -> Agent:
        """Reference agent of that name.

        Raises:
            ConfigError: there is none.
        """
        return reference_agent(name, config.facts.actions)

    def header(self, config: ControlConfig, world: World, slots: EpisodeSlots) -> Header:
        """Task, episodes, sensors and settings."""
        assert isinstance(slots, ControlSlots)
        return {
            "benchmark": None,
            "task": f"control/{config.task}",
            "split": config.split,
            "episodes_hash": episodes_hash(world),
            "action_repeat": config.repeat,
            "design": None,  # drawings are of sensors on one body; name and grid stand in "env"
            "env": to_mapping(config),
        }

    def places(self, world: World, episode: int) -> Outcome:
        """Nothing beside the seed, which is the episode's id."""
        return {}

    def current_benchmark(self, benchmark: str) -> str:
        """Results have no versions."""
        return benchmark

    def keep(self, evaluation: Evaluation, traces: Sequence[Trace], world: World, slots: EpisodeSlots) -> None:
        """Pictures are drawn from the traces alone."""

    def recompute(self, row: Outcome, trace: Trace, header: Header) -> Mapping[str, float]:
        """The measures, from the rewards of a trace.

        Raises:
            RecordError: the header lacks the action repeat.
        """
        try:
            repeat = int(header["action_repeat"])
        except (KeyError, TypeError, ValueError) as error:
            raise RecordError("evaluation: its head lacks action_repeat; evaluate again with prnav-eval") from error
        return {
            "return": float(np.asarray(trace["reward"], np.float64).sum()),
            "steps": float(repeat * len(trace)),
            "diverged": float(np.asarray(trace["diverged"]).any()),
        }


def episodes_hash(world: World) -> str:
    """Hash of a list of episodes."""
    return hash_arrays({"seeds": np.array(world, np.int64)})[:16]
