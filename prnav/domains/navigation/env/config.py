"""What an environment is made of, as pure data: the settings of all subjects side by side, and the task's rules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from prnav.domains.navigation.env.settings import (
    EpisodeSettings,
    FloorSettings,
    RuleSettings,
    SceneSettings,
    SensorSettings,
)
from prnav.domains.navigation.env.settings.checks import check_choice
from prnav.domains.navigation.rules import TaskKind
from prnav.scene.library import SPLITS


@dataclass(frozen=True)
class NavigationConfig(RuleSettings, FloorSettings, SensorSettings, EpisodeSettings, SceneSettings):
    """Scenes, episodes, sensors, navmeshes and rules of a navigation environment. A task's own class names the rules'.

    A subject's fields stand in its own class, with what they mean and which values are valid.
    """

    kind: ClassVar[TaskKind]
    """The task."""
    ten_homes: ClassVar[bool] = False
    """Whether the built-in training split is ten of its homes (:func:`prnav.scene.ten_training_homes`)."""
    renamed_keys: ClassVar[Mapping[str, str]] = {"task": "rules"}
    """Tables of earlier versions and what they are called now; see :func:`prnav.config.from_mapping`."""

    def __post_init__(self) -> None:
        for subject in (SceneSettings, EpisodeSettings, SensorSettings, FloorSettings, RuleSettings):
            subject.check(self)
        if self.episodes is None and self.data is None:
            check_choice(SPLITS, scenes=self.scenes)
        if self.sensors is not None and "pointgoal" in self.sensors and not self.kind.shows_goal:
            raise ValueError(f"sensors names 'pointgoal', and {self.kind.name} does not tell where its goal is")

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """Sensors that are listed, or else all that the task has, with a camera or photoreceptors to see with."""
        if self.sensors is not None:
            return self.sensors
        goal = ("pointgoal",) if self.kind.shows_goal else ()
        return ("compass", "design", "gps", *goal, "camera" if self.camera_size else "photoreceptors")
