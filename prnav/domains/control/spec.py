"""Control tasks as training, design, evaluation and reports see them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from prnav.contracts import BatchEnv, Header, Progress
from prnav.domains.control.engine import mujoco
from prnav.domains.control.env.config import ControlConfig, split_seeds
from prnav.domains.control.env.slots import ControlSlots
from prnav.domains.control.env.vector_env import ControlVectorEnv
from prnav.domains.control.evaluation import ControlEvaluation, World, episodes_hash
from prnav.domains.control.pictures import ControlPictures


@dataclass(frozen=True)
class ControlTaskSpec:
    """A :class:`prnav.contracts.TaskSpec` over bodies and seeded episodes."""

    config_type: type[ControlConfig]
    measures: Sequence[str] = ("return", "steps", "diverged")
    score: str = "return"
    pictures: ControlPictures = field(default_factory=ControlPictures)
    probe: None = None

    @property
    def name(self) -> str:
        """As commands and configs have it, for example "control/walker-walk"."""
        return f"control/{self.config_type.task}"

    @property
    def preset(self) -> str:
        """Config of the same name with a dash, for example "control-walker-walk"."""
        return f"control-{self.config_type.task}"

    @property
    def evaluation(self) -> ControlEvaluation:
        """How the task is evaluated."""
        return ControlEvaluation(self.config_type)

    def prepare(self, config: ControlConfig, progress: Progress | None = None, limit: int | None = None) -> None:
        """Nothing has to be made: models are compiled in milliseconds."""

    def load(self, config: ControlConfig, progress: Progress | None = None, limit: int | None = None) -> World:
        """Seeds of the split's episodes."""
        return tuple(split_seeds(config.split)[:limit])

    def make_envs(self, config: ControlConfig, world: World, num_envs: int) -> BatchEnv:
        """``num_envs`` agents; they play episodes without end, which their own seeds name."""
        return ControlVectorEnv(num_envs, config)

    def make_slots(self, config: ControlConfig, world: World, num_slots: int) -> ControlSlots:
        """``num_slots`` slots over the episodes, or as many as there are episodes where these are fewer."""
        return ControlSlots(config, min(num_slots, len(world)), world)

    def facts(self, config: ControlConfig, world: World) -> Header:
        """Task, episodes and the physics engine."""
        return {
            "benchmark": None,
            "task": self.name,
            "episodes": len(world),
            "episodes_sha256": episodes_hash(world),
            "mujoco": mujoco.__version__,
            "action_repeat": config.repeat,
        }

    def notes(self, config: ControlConfig, world: World) -> list[str]:
        """What a decision is worth in steps."""
        return [f"an action lasts {config.repeat} simulation steps; steps are counted in decisions of the agent"]

    def validation(self, config: ControlConfig) -> ControlConfig:
        """Episodes of the val split."""
        return replace(config, split="val")

    def held_out(self, config: ControlConfig, split: str) -> ControlConfig:
        """Episodes of another split."""
        return replace(config, split=split)

    def blind(self, config: ControlConfig) -> ControlConfig:
        """The same agent, shown nothing."""
        return replace(config, senses="nothing")

    def with_design(self, config: ControlConfig, design: str, grid: int) -> ControlConfig:
        """An agent with the design of a file, or of the library."""
        return replace(config, senses="receptors", design=design, grid=grid)
