"""The six tasks by name: the environments that Gymnasium's ids name, and what the catalog finds."""

from __future__ import annotations

from prnav.domains.control.env.config import (
    FingerSpinConfig,
    FingerTurnEasyConfig,
    ReacherHardConfig,
    WalkerRunConfig,
    WalkerStandConfig,
    WalkerWalkConfig,
)
from prnav.domains.control.env.single_env import ControlEnv
from prnav.domains.control.env.vector_env import ControlVectorEnv
from prnav.domains.control.spec import ControlTaskSpec


class ReacherHardEnv(ControlEnv):
    """One agent: an arm that reaches for a ball."""

    config_type = ReacherHardConfig


class ReacherHardVectorEnv(ControlVectorEnv):
    """N agents, each an arm that reaches for a ball: ``gymnasium.make_vec("prnav/ReacherHard-v0")``."""

    config_type = ReacherHardConfig


class WalkerStandEnv(ControlEnv):
    """One agent: a walker that stands."""

    config_type = WalkerStandConfig


class WalkerStandVectorEnv(ControlVectorEnv):
    """N agents, each a walker that stands: ``gymnasium.make_vec("prnav/WalkerStand-v0")``."""

    config_type = WalkerStandConfig


class WalkerWalkEnv(ControlEnv):
    """One agent: a walker that walks at 1 m/s."""

    config_type = WalkerWalkConfig


class WalkerWalkVectorEnv(ControlVectorEnv):
    """N agents, each a walker that walks at 1 m/s: ``gymnasium.make_vec("prnav/WalkerWalk-v0")``."""

    config_type = WalkerWalkConfig


class WalkerRunEnv(ControlEnv):
    """One agent: a walker that runs at 8 m/s."""

    config_type = WalkerRunConfig


class WalkerRunVectorEnv(ControlVectorEnv):
    """N agents, each a walker that runs at 8 m/s: ``gymnasium.make_vec("prnav/WalkerRun-v0")``."""

    config_type = WalkerRunConfig


class FingerSpinEnv(ControlEnv):
    """One agent: a finger that spins a spinner."""

    config_type = FingerSpinConfig


class FingerSpinVectorEnv(ControlVectorEnv):
    """N agents, each a finger that spins a spinner: ``gymnasium.make_vec("prnav/FingerSpin-v0")``."""

    config_type = FingerSpinConfig


class FingerTurnEasyEnv(ControlEnv):
    """One agent: a finger that turns a spinner into a target."""

    config_type = FingerTurnEasyConfig


class FingerTurnEasyVectorEnv(ControlVectorEnv):
    """N agents, each a finger that turns a spinner into a target: ``gymnasium.make_vec("prnav/FingerTurnEasy-v0")``."""

    config_type = FingerTurnEasyConfig


REACHER_HARD = ControlTaskSpec(ReacherHardConfig)
WALKER_STAND = ControlTaskSpec(WalkerStandConfig)
WALKER_WALK = ControlTaskSpec(WalkerWalkConfig)
WALKER_RUN = ControlTaskSpec(WalkerRunConfig)
FINGER_SPIN = ControlTaskSpec(FingerSpinConfig)
FINGER_TURN_EASY = ControlTaskSpec(FingerTurnEasyConfig)
