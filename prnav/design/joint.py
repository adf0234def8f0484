"""Joint optimisation of design and control: the trainer's loop with a design policy beside the control policy.

The paper's schedule (appendix, "Design Optimization"): a frozen stage, in which only the control policy learns, on
designs drawn around the initial one; then turns of control updates (design policy frozen) and of one design update
(control policy frozen while its episodes are collected).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from prnav.aliases import JSON, JSONObject
from prnav.checks import require_at_least
from prnav.config import config_hash, to_mapping
from prnav.design.cost import CostConfig
from prnav.design.designed_envs import DesignableEnvs, DesignedVectorEnv
from prnav.design.gaussian import DesignPolicy, DesignPolicyConfig
from prnav.errors import ConfigError
from prnav.files import write_text
from prnav.sensors import Design, moved_design, with_free_values
from prnav.train import MetricsRow, RunFolder, TrainConfig, Trainer

HISTORY = "designs.json"
"""File of a run that holds the mean of the design policy after each update."""


@dataclass(frozen=True)
class JointConfig:
    """When design and control learn, in rollout collections; the defaults are the paper's."""

    frozen_rollouts: int = 20_000
    """Collections of the frozen stage; those of a warm start count."""
    control_rollouts: int = 400
    """Collections (and updates) of the control policy between two design updates."""
    design_rollouts: int = 100
    """Collections whose episodes a design update learns from."""
    schedule: Literal["alternate", "together"] = "alternate"
    """"alternate": the paper's, the control policy is frozen during ``design_rollouts``; "together": it keeps
    learning from them, no collection is spent on the design alone and ``control_rollouts`` has no effect."""
    score: str = "soft_spl_closest"
    """Measure of an episode that the design learns from, one of the task's. The paper takes SoftSPL by "the minimum
    distance achieved"."""
    policy: DesignPolicyConfig = field(default_factory=DesignPolicyConfig)
    cost: CostConfig = field(default_factory=CostConfig)

    def __post_init__(self) -> None:
        require_at_least(self, 0, "frozen_rollouts", "control_rollouts")
        if self.design_rollouts < 1:
            raise ValueError(f"design_rollouts is {self.design_rollouts}; it must be at least 1")


@dataclass(frozen=True)
class UpdateTurn:
    """What one collection is for."""

    control: bool
    """Whether the control policy learns from it."""
    design: Literal["", "collect", "update"]
    """Whether its episodes are kept for the design policy, and whether this learns when it ends."""


def turn(config: JointConfig, rollout: int) -> UpdateTurn:
    """What the collection with this number (from 0) is for."""
    since = rollout - config.frozen_rollouts
    if since < 0:
        return UpdateTurn(True, "")
    if config.schedule == "together":
        return UpdateTurn(True, "update" if since % config.design_rollouts == config.design_rollouts - 1 else "collect")
    place = since % (config.control_rollouts + config.design_rollouts) - config.control_rollouts
    if place < 0:
        return UpdateTurn(True, "")
    return UpdateTurn(False, "update" if place == config.design_rollouts - 1 else "collect")


class JointTrainer(Trainer):
    """A trainer whose episodes have designs of their own, and that trains the policy they come from."""

    def __init__(
        self,
        config: TrainConfig,
        joint: JointConfig,
        envs: DesignableEnvs,
        design: Design,
        folder: RunFolder,
        report: Callable[[MetricsRow], None] = lambda row: None,
        warn: Callable[[str], None] = lambda text: None,
        data: Mapping[str, JSON] | None = None,
    ) -> None:
        """Trainer of a run; arguments beside these as for :class:`Trainer`.

        Args:
            config: the control policy's training.
            joint: the design policy's.
            envs: environments that start from ``design``.
            design: the initial design.
            folder: the run's files.
            report: called with each row of metrics.
            warn: called with what the user should know.
            data: what the run is made from.
        """
        self.joint, self.design = joint, design
        self.history: list[JSONObject] = []
        policy = DesignPolicy(joint.policy, int(design.free.sum()))
        self.designed = DesignedVectorEnv(envs, design, policy, joint.cost, joint.score, config.seed)
        facts = {**(data or {}), "joint": to_mapping(joint), "design": design.name}
        super().__init__(config, self.designed, folder, report, warn, facts)

    def begin(self) -> None:
        """Start the run or resume it, with the settings of the joint optimisation written beside its config.

        Raises:
            ConfigError: the run was started with other settings of the joint optimisation.
        """
        _check_same(self.folder, self.joint, self.design)
        super().begin()

    @property
    def theta(self) -> np.ndarray:
        """Mean of the design policy as normalised coordinates, (K, 7)."""
        return with_free_values(self.designed.policy.mean, self.design)

    def best_design(self, name: str) -> Design:
        """The design that was found: the policy's mean."""
        text = f"Found from {self.design.name} by joint optimisation, {self.step} steps."
        return moved_design(self.design, self.theta, name, text)

    def phase(self) -> tuple[str, float | None]:
        """What the next rollout is for."""
        if turn(self.joint, self.updates).control:
            return super().phase()
        return "design", None

    def update(self, phase: str) -> dict[str, float]:
        """Let control, design or both learn from the rollout; mean losses and what the design policy did."""
        now = turn(self.joint, self.updates)
        if now.control:
            losses = super().update(phase)
        else:
            losses = {"design_log_std": float(np.log(self.designed.policy.std).mean())}
        if not now.design:
            self.designed.clear()
        elif now.design == "update":
            losses |= self.designed.learn()
            mean = self.designed.policy.mean.tolist()
            step = self.step + self.rollout.steps * self.rollout.environments
            self.history.append({"step": step, "mean": mean, "std": self.designed.policy.std.tolist()})
        return losses

    def save(self) -> None:
        """Write a checkpoint, and the design policy's way so far."""
        super().save()
        write_text(self.folder.path / HISTORY, json.dumps(self.history) + "\n")

    def state_dict(self) -> JSONObject:
        """All that the rest of the run depends on."""
        return {**super().state_dict(), "design_history": self.history}

    def load_state_dict(self, state: Mapping[str, JSON], *source: str) -> None:
        """Resume from :meth:`state_dict`."""
        super().load_state_dict(state, *source)
        self.history = list(state["design_history"])


def _check_same(folder: RunFolder, joint: JointConfig, design: Design) -> None:
    """Hold a resumed run to its joint settings and its initial design, or write them down for a new one."""
    path = folder.path / "joint.json"
    spelled = {"hash": config_hash(joint), "joint": to_mapping(joint), "initial": design.sensors.tolist()}
    text = json.dumps(spelled, indent=1) + "\n"
    if not folder.exists():
        write_text(path, text)
    elif not path.exists() or path.read_text(encoding="utf-8") != text:
        raise ConfigError(
            f"run {folder.path}: its joint optimisation or initial design differs from what is asked now (joint.json); "
            f"give the same settings, or another folder with --run DIR"
        )
