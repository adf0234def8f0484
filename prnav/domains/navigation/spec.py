"""Navigation tasks as training, design, evaluation and reports see them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from prnav.aliases import JSONObject
from prnav.cache import hash_arrays
from prnav.contracts import BatchEnv, Header, Progress
from prnav.domains.navigation.benchmark import benchmark_of
from prnav.domains.navigation.env import (
    EpisodeSource,
    NavigationConfig,
    NavigationSlots,
    NavigationVectorEnv,
    load_source,
)
from prnav.domains.navigation.env.episode_source import built_in_scenes, episode_path
from prnav.domains.navigation.evaluation import NavigationEvaluation
from prnav.domains.navigation.pictures import NavigationPictures
from prnav.domains.navigation.probe import NavigationProbe
from prnav.files import sha256_file
from prnav.scene import scene_ids
from prnav.scene.houses.pool import make_missing_homes


@dataclass(frozen=True)
class NavigationTask:
    """A :class:`prnav.contracts.TaskSpec` over meshes, navmeshes and episodes."""

    config_type: type[NavigationConfig]
    preset: str
    measures: Sequence[str] = (
        "success",
        "spl",
        "soft_spl",
        "soft_spl_closest",
        "distance_to_goal",
        "collisions",
        "path_length",
        "steps",
        "reward",
    )
    score: str = "spl"
    pictures: NavigationPictures = field(default_factory=NavigationPictures)
    probe: NavigationProbe = field(default_factory=NavigationProbe)

    @property
    def name(self) -> str:
        """As commands and configs have it."""
        return self.config_type.kind.name

    @property
    def evaluation(self) -> NavigationEvaluation:
        """How the task is evaluated."""
        return NavigationEvaluation(self.config_type)

    def prepare(self, config: NavigationConfig, progress: Progress | None = None, limit: int | None = None) -> None:
        """Make the built-in homes that are not in the cache, on all cores."""
        make_missing_homes(built_in_scenes(config)[:limit], progress)

    def load(
        self, config: NavigationConfig, progress: Progress | None = None, limit: int | None = None
    ) -> EpisodeSource:
        """Scenes and episodes.

        Raises:
            PrnavError: a scene, a navmesh or an episode is missing or broken.
        """
        return load_source(config, progress, limit=limit)

    def make_envs(self, config: NavigationConfig, world: EpisodeSource, num_envs: int) -> BatchEnv:
        """``num_envs`` agents over the same scenes."""
        return NavigationVectorEnv(num_envs, config, world)

    def make_slots(self, config: NavigationConfig, world: EpisodeSource, num_slots: int) -> NavigationSlots:
        """``num_slots`` slots over the episodes, or as many as there are episodes where these are fewer."""
        return NavigationSlots(world, min(num_slots, len(world)), config)

    def facts(self, config: NavigationConfig, world: EpisodeSource) -> Header:
        """Hashes of a run's scenes, its episodes and their file."""
        facts: JSONObject = {
            "benchmark": benchmark_of(config),
            "episodes": len(world),
            "episodes_sha256": hash_arrays({"starts": world.starts, "yaws": world.yaws, "goals": world.goals}),
            "scenes": {name: scene.hash for name, scene in zip(world.world.scene_ids, world.world.scenes, strict=True)},
            "navmeshes": world.navmesh_origins,
        }
        path = episode_path(config)
        if path is not None and Path(path).is_file():
            facts["file"] = {"name": Path(path).name, "sha256": sha256_file(path)}
        return facts

    def notes(self, config: NavigationConfig, world: EpisodeSource) -> list[str]:
        """Where the navmeshes of a data set are from."""
        if config.data is None:
            return []
        origins = list(world.navmesh_origins.values())
        files = sum(origin != "built" for origin in origins)
        return [f"navmeshes of {config.data}: {files} from files, {len(origins) - files} built"]

    def validation(self, config: NavigationConfig) -> NavigationConfig:
        """Episodes of the val split: one's own where they are a folder, else those of the built-in homes."""
        if config.episodes is not None and config.episode_split is not None:
            return replace(config, episode_split="val")
        return replace(config, scenes="val", episodes=None, episode_split=None, max_scenes=None)

    def held_out(self, config: NavigationConfig, split: str) -> NavigationConfig:
        """Built-in homes of another split.

        Raises:
            SceneError: no such split.
        """
        scene_ids(split)  # refuses a split that is none
        return replace(config, scenes=split, episodes=None, max_scenes=None)

    def blind(self, config: NavigationConfig) -> NavigationConfig:
        """No readings are rendered or seen."""
        return replace(config, vision=False)

    def with_design(self, config: NavigationConfig, design: str, grid: int) -> NavigationConfig:
        """An agent with the design of a file, or of the library."""
        return replace(config, design=design, grid=grid)
