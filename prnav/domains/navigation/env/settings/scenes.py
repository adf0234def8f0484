"""Which scenes an environment plays in, and how their files are read."""

from __future__ import annotations

from dataclasses import dataclass

from prnav.domains.navigation.env.settings.checks import check_at_least, check_choice, check_filled
from prnav.scene import DATA_SETS
from prnav.scene.texture_budget import MAX_TEXTURE_SIZE, TEXTURE_BUDGET


@dataclass(frozen=True)
class SceneSettings:
    """Scenes: built-in homes, those of a data set, or mesh files that episodes name."""

    scenes: str = "train"
    """Split of the built-in houses: "train", "val" or "test". Without effect where ``episodes`` is
    given."""
    max_scenes: int | None = None
    """Use only the first so many scenes of the split."""
    data: str | None = None
    """Data set in Habitat's layout under ``data_root``: "mp3d", "hm3d", "gibson", "replica" or "hssd". Its scenes stand
    as its configs say, and its own episodes count where ``episodes`` is None."""
    data_root: str | None = None
    """Folder under which the scenes that episodes name are looked for."""
    scene_files: tuple[str, ...] = ()
    """Mesh files that episodes may name, wherever they are."""
    up: str = "y"
    """Up axis of scene files, "y" or "z"."""
    up_from_episodes: bool = True
    """Whether the up axis that an episode file was made with counts before ``up``."""
    max_texture_size: int = MAX_TEXTURE_SIZE
    """Longest side of a texture of a scene file [texels]."""
    texture_budget: int = TEXTURE_BUDGET
    """Texels of all textures of a scene file together."""

    def check(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: a value is unknown or out of range.
        """
        check_at_least(1, max_scenes=self.max_scenes, max_texture_size=self.max_texture_size)
        check_at_least(1, texture_budget=self.texture_budget)
        check_choice(("y", "z"), up=self.up)
        check_filled(scenes=self.scenes, data_root=self.data_root)
        for index, file in enumerate(self.scene_files):
            check_filled(**{f"scene_files[{index}]": file})
        if self.data is not None:
            check_choice(DATA_SETS, data=self.data)
            if self.data_root is None:
                raise ValueError(f"data is {self.data!r}, and data_root does not say where it is (--data-root DIR)")
