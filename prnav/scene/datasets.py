"""Data sets where Habitat keeps them: which scenes there are, how they stand, and which navmesh belongs to each.

The root is the folder with ``scene_datasets/`` (and ``datasets/``) in it, or one above it with ``data/``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath

from prnav.errors import SceneError
from prnav.files import resolve_inside
from prnav.scene import decoders
from prnav.scene.habitat_configs import (
    DATASET_SUFFIX,
    SCENE_SUFFIX,
    STAGE_SUFFIX,
    DatasetConfig,
    Template,
    frame_of,
    read_config,
    read_instance,
)
from prnav.scene.scene_file import Y_UP, Z_UP, AssetFrame, SceneFile

_PREFIX = "data/scene_datasets/"


@dataclass(frozen=True)
class Layout:
    """How a data set lies on disk.

    Attributes:
        folders: its folder in ``scene_datasets/``: the first that is there counts.
        patterns: its mesh files (or scene instances) in there.
        episodes: its folder in ``datasets/pointnav/``.
        frame: of its files where no config says otherwise; metres are one unit in all of them.
        navmeshes: where the navmesh of ``{folder}/{stem}.*`` is, relative to the mesh's folder.
    """

    folders: tuple[str, ...]
    patterns: tuple[str, ...]
    episodes: tuple[str, ...]
    frame: AssetFrame = Z_UP
    navmeshes: tuple[str, ...] = ("{stem}.navmesh",)


LAYOUTS = {
    "mp3d": Layout(("mp3d",), ("*/*.glb",), ("mp3d",)),
    "hm3d": Layout(
        ("hm3d_v0.2", "hm3d"),
        ("*/*/*.glb",),
        ("hm3d",),
        navmeshes=("{stem}.navmesh", "{name}.basis.navmesh", "{name}.navmesh"),
    ),
    "gibson": Layout(("gibson",), ("*.glb",), ("gibson",)),
    "replica": Layout(
        ("replica", "replica_v1"),
        ("*/mesh.ply",),
        ("replica",),
        navmeshes=("habitat/mesh_semantic.navmesh", "habitat/mesh_preseg_semantic.navmesh", "mesh.navmesh"),
    ),
    "hssd": Layout(("hssd-hab", "hssd"), ("scenes/*" + SCENE_SUFFIX,), ("hssd-hab", "hssd"), frame=Y_UP),
}
"""The data sets that can be named with ``--data``. All meshes are in metres."""

DATA_SETS = tuple(LAYOUTS)


def data_folder(root: str | Path) -> Path:
    """The folder that holds ``scene_datasets/``: the root itself, or ``data/`` in it.

    Raises:
        SceneError: neither has it.
    """
    base = Path(root)
    for folder in (base, base / "data"):
        if (folder / "scene_datasets").is_dir():
            return folder
    raise SceneError(
        f"data root {root}: no folder scene_datasets in it or in its folder data; --data-root names the folder that "
        "holds scene_datasets/ and datasets/"
    )


@dataclass(frozen=True)
class SceneSet:
    """A data set on disk.

    Attributes:
        name: one of :data:`DATA_SETS`.
        folder: its own folder, for example ``DIR/scene_datasets/mp3d``.
    """

    name: str
    folder: Path

    @property
    def layout(self) -> Layout:
        """How it lies on disk."""
        return LAYOUTS[self.name]

    @cached_property
    def files(self) -> dict[str, Path]:
        """Mesh or scene instance files by scene id, the id as Habitat's episodes write it, in order of their names.

        Of a mesh with and without Basis textures the former counts where a decoder for it is installed.
        """
        found: dict[str, Path] = {}
        for pattern in self.layout.patterns:
            for path in sorted(self.folder.glob(pattern)):
                if not path.is_file() or path.name.endswith(".semantic.glb"):
                    continue
                if self.name == "mp3d" and path.stem != path.parent.name:
                    continue
                found[self._id(path)] = path
        basis = {path for path in found.values() if path.name.endswith(".basis.glb")}
        if decoders.available("KHR_texture_basisu"):
            twins = {path.with_name(path.name.replace(".basis.glb", ".glb")) for path in basis}
        else:
            twins = {path for path in basis if path.with_name(path.name.replace(".basis.glb", ".glb")).is_file()}
        return {scene_id: path for scene_id, path in found.items() if path not in twins}

    def scene_ids(self, split: str | None = None) -> list[str]:
        """Ids of the scenes, of a split's folder alone where one is named.

        Raises:
            SceneError: there are none.
        """
        ids = [key for key, path in self.files.items() if split is None or split in path.relative_to(self.folder).parts]
        if not ids:
            part = "" if split is None else f" of split {split!r}"
            patterns = ", ".join(self.layout.patterns)
            raise SceneError(f"data set {self.name}: no scenes{part} in {self.folder} (looked for {patterns})")
        return ids

    def scene(self, scene_id: str) -> SceneFile:
        """A scene by its id, as episodes or :meth:`scene_ids` give it, or by the name of its file or folder alone.

        Raises:
            SceneError: there is no such scene, it leaves the folder, or a config about it cannot be used.
        """
        path = self._find(scene_id)
        if path.name.endswith(SCENE_SUFFIX):
            config = self._instance_config(path)
            return read_instance(path, config, self.layout.frame, self._id(path))
        template = self._template(path)
        frame = self.layout.frame
        if template is not None:
            frame = frame_of(template.attributes, frame, template.where)
        return SceneFile(self._id(path), path, frame, self._navmesh(path, template))

    def _find(self, scene_id: str) -> Path:
        short = scene_id.removeprefix(_PREFIX)
        parts = PurePosixPath(short.replace("\\", "/")).parts
        inner = "/".join(parts[1:]) if parts[:1] and parts[0] in (*self.layout.folders, self.folder.name) else short
        if (exact := self.files.get(f"{self.folder.name}/{inner}")) is not None:
            return exact
        resolve_inside(self.folder, inner, SceneError)
        name = _plain(parts[-1]) if parts else ""
        fitting = [
            file
            for file in self.files.values()
            if name in (_plain(file.name), file.parent.name, file.parent.name.partition("-")[2]) and name
        ]
        if len(fitting) > 1:
            fitting = [file for file in fitting if set(parts[:-1]) & set(file.relative_to(self.folder).parts)]
        if len(fitting) == 1 or (fitting and len({_plain(file.name) for file in fitting}) == 1):
            return fitting[0]
        raise SceneError(
            f"scene {scene_id!r} is not in data set {self.name} at {self.folder}, which has {len(self.files)} scenes "
            "(prnav-scenes list shows them); fetch it, or name another folder with --data-root"
        )

    def _id(self, path: Path) -> str:
        return f"{self.folder.name}/{path.relative_to(self.folder).as_posix()}"

    @cached_property
    def configs(self) -> tuple[DatasetConfig, ...]:
        """The folder's ``*.scene_dataset_config.json``, those of split folders after it; shorter names first."""
        files = [*self.folder.glob("*" + DATASET_SUFFIX), *self.folder.glob("*/*" + DATASET_SUFFIX)]
        files.sort(key=lambda file: (len(file.relative_to(self.folder).parts), len(file.name), file.name))
        return tuple(DatasetConfig.read(file, self.folder) for file in files)

    def _template(self, path: Path) -> Template | None:
        """What configs say about a stage: the one beside it, else the first data set config that covers it."""
        names = [path.name.removesuffix(path.suffix) + STAGE_SUFFIX, _plain(path.name) + STAGE_SUFFIX]
        covering = next((t for t in (config.stage_of(path) for config in self.configs) if t is not None), None)
        for beside in dict.fromkeys(path.with_name(name) for name in names):
            if beside.is_file():
                base = covering.attributes if covering is not None else {}
                return Template(f"config {beside}", path.parent, {**base, **read_config(beside)})
        return covering

    def _instance_config(self, path: Path) -> DatasetConfig:
        resolved = path.resolve()
        for config in self.configs:
            if resolved in {file.resolve() for file in config.scenes.values()}:
                return config
        if self.configs:
            return self.configs[0]
        raise SceneError(f"scene {path}: no *{DATASET_SUFFIX} in {self.folder}, which says where its objects are")

    def _navmesh(self, path: Path, template: Template | None) -> Path | None:
        if template is not None:
            named = template.asset("nav_asset", self.folder.resolve())
            if named is not None and named.is_file():
                return named
        stem, name = path.name.removesuffix(path.suffix), _plain(path.name)
        places = [path.parent / pattern.format(stem=stem, name=name) for pattern in self.layout.navmeshes]
        return next((place for place in places if place.is_file()), None)


def open_scene_set(name: str, root: str | Path) -> SceneSet:
    """A data set under a root.

    Raises:
        SceneError: no such data set is known, or its folder is missing.
    """
    if name not in LAYOUTS:
        raise SceneError(f"data set {name!r} is not known; valid: {', '.join(DATA_SETS)}")
    base = data_folder(root) / "scene_datasets"
    for folder in LAYOUTS[name].folders:
        if (base / folder).is_dir():
            return SceneSet(name, base / folder)
    wanted = " or ".join(str(base / folder) for folder in LAYOUTS[name].folders)
    raise SceneError(f"data set {name}: no folder {wanted}; put it there, or a link to it")


def _plain(name: str) -> str:
    """File name without its endings: ``TEEsavR23oF`` of ``TEEsavR23oF.basis.glb``."""
    return name.split(".", 1)[0]
