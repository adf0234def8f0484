"""What an environment is made of, as pure data."""

from __future__ import annotations

from dataclasses import dataclass, field

from prnav.navmesh import NavMeshSettings
from prnav.sim import SimConfig
from prnav.tasks import PointGoalConfig


@dataclass(frozen=True)
class EnvConfig:
    """Scenes, episodes, sensors and rules of a navigation environment."""

    scenes: str = "train"
    """Split of the built-in houses: "train", "val" or "test". Without effect where ``episodes`` is given."""
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
    data_root: str | None = None
    """Folder under which the scenes that episodes name are looked for."""
    scene_files: tuple[str, ...] = ()
    """Mesh files that episodes may name, wherever they are."""
    up: str = "y"
    """Up axis of scene files, "y" or "z"."""
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
    sim: SimConfig = field(default_factory=SimConfig)
    task: PointGoalConfig = field(default_factory=PointGoalConfig)
    navmesh: NavMeshSettings = field(default_factory=NavMeshSettings)

    def __post_init__(self) -> None:
        for name in ("episodes_per_scene", "grid", "rays_per_receptor"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least 1")
        if self.camera_size < 0:
            raise ValueError(f"camera_size is {self.camera_size}; it must be 0 (photoreceptors) or more")
        if self.max_scenes is not None and self.max_scenes < 1:
            raise ValueError(f"max_scenes is {self.max_scenes}; it must be at least 1")
        if self.up not in ("y", "z"):
            raise ValueError(f"up is {self.up!r}; valid: 'y', 'z'")
