"""Where agents can walk."""

from __future__ import annotations

from dataclasses import dataclass, field

from prnav.navmesh import NavMeshSettings


@dataclass(frozen=True)
class FloorSettings:
    """Navigation meshes: those of files, and how others are built."""

    navmesh_files: bool = True
    """Whether the ``.navmesh`` files of a data set count; False builds all navmeshes."""
    navmesh: NavMeshSettings = field(default_factory=NavMeshSettings)
    """Table [env.navmesh], which checks its own values: how navmeshes are built."""

    def check(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: ``navmesh`` is no such settings.
        """
        if not isinstance(self.navmesh, NavMeshSettings):
            raise ValueError(f"navmesh is {self.navmesh!r}; it must be a NavMeshSettings (table [env.navmesh])")
