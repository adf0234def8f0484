"""What an environment is made of, as pure data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from prnav.domains.navigation.rules import Rules, TaskKind
from prnav.navmesh import NavMeshSettings
from prnav.scene import DATA_SETS
from prnav.scene.texture_budget import MAX_TEXTURE_SIZE, TEXTURE_BUDGET
from prnav.sim import SimConfig


def _no_rules() -> Rules:
    raise TypeError("NavigationConfig has no rules; make the config of a task, such as PointGoalEnvConfig")


@dataclass(frozen=True)
class NavigationConfig:
    """Scenes, episodes and sensors of a navigation environment. A task's own class adds its rules."""

    kind: ClassVar[TaskKind]
    """The task."""
    ten_homes: ClassVar[bool] = False
    """Whether the built-in training split is ten of its homes (:func:`prnav.scene.ten_training_homes`)."""

    scenes: str = "train"
    """Split of the built-in houses: "train", "val" or "test". Without effect where ``episodes`` is
    given."""
    max_scenes: int | None = None
    """Use only the first so many scenes of the split."""
    episodes_per_scene: int = 200
    """Episodes generated per scene of the train split."""
    episode_seed: int = 0
    """Seed of the generated episodes."""
    episodes: str | None = None
    """Path of Habitat PointNav episodes (file or folder); None takes the built-in ones of the split."""
    episode_split: str | None = None
    """Split to take from a folder of episodes that has several."""
    data: str | None = None
    """Data set in Habitat's layout under ``data_root``: "mp3d", "hm3d", "gibson", "replica" or "hssd". Its scenes stand
    as its configs say, and its own episodes count where ``episodes`` is None."""
    data_root: str | None = None
    """Folder under which the scenes that episodes name are looked for."""
    navmesh_files: bool = True
    """Whether the ``.navmesh`` files of a data set count; False builds all navmeshes."""
    max_texture_size: int = MAX_TEXTURE_SIZE
    """Longest side of a texture of a scene file [texels]."""
    texture_budget: int = TEXTURE_BUDGET
    """Texels of all textures of a scene file together."""
    scene_files: tuple[str, ...] = ()
    """Mesh files that episodes may name, wherever they are."""
    up: str = "y"
    """Up axis of scene files, "y" or "z"."""
    up_from_episodes: bool = True
    """Whether the up axis that an episode file was made with counts before ``up``."""
    design: str = "forward"
    """Sensor design: name of a built-in one, or path of a design file."""
    grid: int = 4
    """B: each sensor splits its view into B x B photoreceptors."""
    rays_per_receptor: int = 4
    camera_size: int = 0
    """Pixels per side of the picture that each sensor gives instead of photoreceptors; 0 is none (128 in the paper)."""
    engine: str = "auto"
    """Renderer: "auto", "embree", "egl", "osmesa" or "reference"."""
    vision: bool = True
    """False leaves the photoreceptors out (a blind agent needs no light, and this saves its cost)."""
    rules: Rules = field(default_factory=_no_rules)
    """Rules of the task."""
    sim: SimConfig = field(default_factory=SimConfig)
    navmesh: NavMeshSettings = field(default_factory=NavMeshSettings)

    def __post_init__(self) -> None:
        for name in ("episodes_per_scene", "grid", "rays_per_receptor", "max_texture_size", "texture_budget"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least 1")
        if self.camera_size < 0:
            raise ValueError(f"camera_size is {self.camera_size}; it must be 0 (photoreceptors) or more")
        if self.max_scenes is not None and self.max_scenes < 1:
            raise ValueError(f"max_scenes is {self.max_scenes}; it must be at least 1")
        if self.data is not None and self.data not in DATA_SETS:
            raise ValueError(f"data is {self.data!r}; valid: {', '.join(map(repr, DATA_SETS))}")
        if self.data is not None and self.data_root is None:
            raise ValueError(f"data is {self.data!r}, and data_root does not say where it is (--data-root DIR)")
        if self.up not in ("y", "z"):
            raise ValueError(f"up is {self.up!r}; valid: 'y', 'z'")
