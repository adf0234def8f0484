"""Habitat's ``*.scene_dataset_config.json`` and the stage, object and scene files that it leads to.

Only what says which mesh stands where is read: paths, defaults, ``render_asset``, ``nav_asset``, ``up``, ``front``,
``scale``, ``origin``, ``units_to_meters``, ``COM`` and the placements of scene instances. Lights, shaders, semantics
and physics are left alone. No path may leave the data set's folder.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from prnav.aliases import JSON, JSONObject, Untyped
from prnav.errors import SceneError
from prnav.files import resolve_inside
from prnav.scene.scene_file import AssetFrame, PlacedObject, SceneFile, check_placement
from prnav.scene.source import SUFFIXES

DATASET_SUFFIX = ".scene_dataset_config.json"
STAGE_SUFFIX = ".stage_config.json"
OBJECT_SUFFIX = ".object_config.json"
SCENE_SUFFIX = ".scene_instance.json"

MAX_BYTES = 64 << 20
"""Largest config file that is read."""


def read_config(path: Path) -> JSONObject:
    """A config file's object.

    Raises:
        SceneError: it is missing, too large, or no JSON object.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise SceneError(f"config {path}: larger than {MAX_BYTES >> 20} MiB; it is no Habitat config")
        values = json.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise SceneError(
            f"config {path}: cannot be read ({error.strerror or error}); copy the data set again"
        ) from error
    except (ValueError, RecursionError) as error:
        reason = str(error).split("\n")[0]
        raise SceneError(f"config {path}: not valid JSON ({reason}); copy the file again") from error
    if not isinstance(values, dict):
        raise SceneError(f"config {path}: it holds a {type(values).__name__}, not an object")
    return values


def frame_of(attributes: Mapping[str, JSON], default: AssetFrame, where: str) -> AssetFrame:
    """Frame of an asset by its attributes; what they do not say is the default's.

    Raises:
        SceneError: a value is not a vector, or up and front are not at right angles.
    """
    units = attributes.get("units_to_meters", 1.0)
    if not isinstance(units, int | float) or isinstance(units, bool) or not 1e-9 < units < 1e9:
        raise SceneError(f"{where}: 'units_to_meters' is {units!r:.40}; it must be a number above 0")
    scale = _vector(attributes, "scale", default.scale, where)
    try:
        return AssetFrame(
            up=_vector(attributes, "up", default.up, where),
            front=_vector(attributes, "front", default.front, where),
            scale=(scale[0] * units, scale[1] * units, scale[2] * units),
            origin=_vector(attributes, "origin", default.origin, where),
        )
    except SceneError as error:
        raise SceneError(f"{where}: {error}") from error


@dataclass(frozen=True)
class Template:
    """Attributes of a stage or an object, and the folder that its paths are relative to."""

    where: str
    folder: Path
    attributes: JSONObject

    def asset(self, key: str, root: Path) -> Path | None:
        """The file that a key names, None where there is no such key."""
        name = self.attributes.get(key)
        if name is None or name == "":
            return None
        if not isinstance(name, str):
            raise SceneError(f"{self.where}: {key!r} is {name!r:.40}; it must be a path")
        return _inside(root, self.folder, name, self.where)


@dataclass(frozen=True)
class DatasetConfig:
    """One ``*.scene_dataset_config.json``.

    Attributes:
        path: the file.
        root: the data set's folder, which no path leaves.
        values: its content.
    """

    path: Path
    root: Path
    values: JSONObject = field(repr=False)

    @classmethod
    def read(cls, path: Path, root: Path) -> DatasetConfig:
        """The config in a file.

        Raises:
            SceneError: it is no Habitat config, or a path in it leaves the root.
        """
        return cls(path, root.resolve(), read_config(path))

    @cached_property
    def stages(self) -> dict[str, Template]:
        """Stage templates by name: the path of their file under the config's folder, without its ending."""
        return self._templates("stages", STAGE_SUFFIX)

    @cached_property
    def objects(self) -> dict[str, Template]:
        """Object templates by name."""
        return self._templates("objects", OBJECT_SUFFIX)

    @cached_property
    def scenes(self) -> dict[str, Path]:
        """Scene instance files by name."""
        found = self._files("scene_instances", ".json", SCENE_SUFFIX)
        return {path.name.removesuffix(SCENE_SUFFIX): path for path in found}

    def stage_of(self, asset: Path) -> Template | None:
        """Template of the stage with this render asset; None where the config does not cover it."""
        return self._stage_by_asset.get(asset.resolve())

    def template(self, kind: str, name: str) -> Template | None:
        """Stage or object template by its name in a scene instance: a full one, or the last part of one."""
        table = self.stages if kind == "stages" else self.objects
        short = name.removesuffix(STAGE_SUFFIX).removesuffix(OBJECT_SUFFIX)
        return table.get(short) or (self._stage_names if kind == "stages" else self._object_names).get(short)

    def navmesh(self, name: str) -> Path | None:
        """The navmesh under a name of ``navmesh_instances``."""
        table = self.values.get("navmesh_instances")
        value = table.get(name) if isinstance(table, dict) else None
        return _inside(self.root, self.path.parent, value, str(self.path)) if isinstance(value, str) else None

    @cached_property
    def _stage_by_asset(self) -> dict[Path, Template]:
        pairs = ((template.asset("render_asset", self.root), template) for template in self.stages.values())
        return {asset: template for asset, template in pairs if asset is not None}

    @cached_property
    def _stage_names(self) -> dict[str, Template]:
        return {name.rsplit("/", 1)[-1]: template for name, template in reversed(self.stages.items())}

    @cached_property
    def _object_names(self) -> dict[str, Template]:
        return {name.rsplit("/", 1)[-1]: template for name, template in reversed(self.objects.items())}

    def _table(self, kind: str) -> JSONObject:
        table = self.values.get(kind, {})
        if not isinstance(table, dict):
            raise SceneError(f"config {self.path}: {kind!r} is {table!r:.40}; it must be an object")
        return table

    def _templates(self, kind: str, suffix: str) -> dict[str, Template]:
        table = self._table(kind)
        defaults = table.get("default_attributes", {})
        if not isinstance(defaults, dict):
            raise SceneError(f"config {self.path}: default_attributes of {kind!r} is {defaults!r:.40}, not an object")
        result: dict[str, Template] = {}
        for ending in SUFFIXES:
            for file in self._files(kind, ending, ending):
                attributes = {**defaults, "render_asset": file.name}
                result[self._name(file).removesuffix(ending)] = Template(str(file), file.parent, attributes)
        for file in self._files(kind, ".json", suffix):
            attributes = {**defaults, **read_config(file)}
            if "render_asset" not in attributes:
                beside = file.with_name(file.name.removesuffix(suffix) + ".glb")
                attributes |= {"render_asset": beside.name} if beside.is_file() else {}
            result[self._name(file).removesuffix(suffix)] = Template(f"config {file}", file.parent, attributes)
        configs = table.get("configs", [])
        for entry in configs if isinstance(configs, list) else []:
            if isinstance(entry, dict):
                self._override(entry, defaults, result, suffix)
        return result

    def _override(self, entry: JSONObject, defaults: JSONObject, templates: dict[str, Template], suffix: str) -> None:
        """An entry of ``configs``: attributes on top of a file's, or of none."""
        attributes = entry.get("attributes", {})
        original, handle = entry.get("original_file"), entry.get("template_handle")
        if not isinstance(attributes, dict):
            raise SceneError(f"config {self.path}: 'attributes' of {handle!r:.60} is not an object")
        if isinstance(original, str):
            file = _inside(self.root, self.path.parent, original, str(self.path))
            name = self._name(file).removesuffix(suffix)
            base = read_config(file) if file.name.endswith(".json") else {"render_asset": file.name}
            template = Template(f"config {file}", file.parent, {**defaults, **base, **attributes})
        else:
            name = str(handle)
            template = Template(f"config {self.path}: {name!r:.60}", self.path.parent, {**defaults, **attributes})
        templates[str(handle) if isinstance(handle, str) else name] = template

    def _files(self, kind: str, key: str, suffix: str) -> list[Path]:
        """Files that ``paths`` of a kind lead to under a key: named ones, those of a pattern, and those in folders."""
        paths = self._table(kind).get("paths", {})
        entries = paths.get(key, []) if isinstance(paths, dict) else []
        found: dict[Path, None] = {}
        for entry in entries if isinstance(entries, list) else []:
            if not isinstance(entry, str):
                continue
            for path in self._expand(entry):
                inner = sorted(path.iterdir()) if path.is_dir() else [path]
                found |= {file: None for file in inner if file.name.endswith(suffix) and file.is_file()}
        return [file for file in found if not file.name.endswith(".semantic.glb")]

    def _expand(self, entry: str) -> Iterable[Path]:
        fixed = [part for part in entry.replace("\\", "/").split("/") if part not in ("", ".")]
        wild = next((k for k, part in enumerate(fixed) if any(sign in part for sign in "*?[")), len(fixed))
        base = _inside(self.root, self.path.parent, "/".join(fixed[:wild]) or ".", str(self.path))
        if wild == len(fixed):
            return [base]
        if ".." in fixed[wild:]:
            raise SceneError(f"config {self.path}: path {entry!r:.80} has '..' behind a pattern; write it without")
        return sorted(base.glob("/".join(fixed[wild:]))) if base.is_dir() else []

    def _name(self, file: Path) -> str:
        folder = self.path.parent.resolve()
        resolved = file.resolve()
        return resolved.relative_to(folder if resolved.is_relative_to(folder) else self.root).as_posix()


def read_instance(path: Path, config: DatasetConfig, stage_frame: AssetFrame, scene_id: str) -> SceneFile:
    """Scene of a ``*.scene_instance.json``: a stage, and objects that stand in it.

    Raises:
        SceneError: a template or a mesh is missing, or the scene has articulated objects.
    """
    values = read_config(path)
    where = f"scene {path}"
    if articulated := values.get("articulated_object_instances"):
        count = len(articulated) if isinstance(articulated, list) else 1
        raise SceneError(f"{where}: {count} articulated objects (URDF) cannot be placed; use a scene without them")
    entry = values.get("stage_instance")
    template = _template(config, "stages", entry, where)
    mesh = _mesh(template, config.root)
    frame = frame_of(template.attributes, stage_frame, template.where)
    objects = values.get("object_instances", [])
    if not isinstance(objects, list):
        raise SceneError(f"{where}: 'object_instances' is {objects!r:.40}; it must be a list")
    origin = values.get("translation_origin")
    placed = tuple(_placed(item, config, origin, f"{where}: object {k}") for k, item in enumerate(objects))
    navmesh = _instance_navmesh(values, path, config, template)
    return SceneFile(scene_id, mesh, frame, navmesh, placed)


def _instance_navmesh(values: JSONObject, path: Path, config: DatasetConfig, stage: Template) -> Path | None:
    name = path.name.removesuffix(SCENE_SUFFIX)
    named = values.get("navmesh_instance")
    candidates = [config.navmesh(key) for key in (named, name) if isinstance(key, str)]
    candidates.append(stage.asset("nav_asset", config.root))
    candidates += [path.with_name(f"{name}.navmesh"), config.root / "navmeshes" / f"{name}.navmesh"]
    return next((found for found in candidates if found is not None and found.is_file()), None)


def _placed(item: Untyped, config: DatasetConfig, origin: Untyped, where: str) -> PlacedObject:
    template = _template(config, "objects", item, where)
    uniform = item.get("uniform_scale", 1.0)
    if not isinstance(uniform, int | float) or isinstance(uniform, bool) or not abs(uniform) < 1e9:
        raise SceneError(f"{where}: 'uniform_scale' is {uniform!r:.40}; it must be a number")
    sx, sy, sz = _vector(item, "non_uniform_scale", (1.0, 1.0, 1.0), where)
    w, x, y, z = _vector(item, "rotation", (1.0, 0.0, 0.0, 0.0), where)
    kind = item.get("translation_origin", origin)
    placed = PlacedObject(
        path=_mesh(template, config.root),
        frame=frame_of(template.attributes, AssetFrame(), template.where),
        translation=_vector(item, "translation", (0.0, 0.0, 0.0), where),
        rotation=(x, y, z, w),
        scale=(sx * uniform, sy * uniform, sz * uniform),
        centred=str(kind).lower() != "asset_local",
        center=_vector(template.attributes, "COM", (0.0, 0.0, 0.0), where) if "COM" in template.attributes else None,
    )
    try:
        check_placement(placed)
    except SceneError as error:
        raise SceneError(f"{where}: {error}") from error
    return placed


def _template(config: DatasetConfig, kind: str, entry: Untyped, where: str) -> Template:
    name = entry.get("template_name") if isinstance(entry, dict) else None
    if not isinstance(name, str):
        raise SceneError(f"{where}: it has no 'template_name' in {kind}; copy the file again")
    template = config.template(kind, name)
    if template is None:
        raise SceneError(
            f"{where}: template {name!r:.80} is not among the {kind} of {config.path.name}; fetch the data set's {kind}"
        )
    return template


def _mesh(template: Template, root: Path) -> Path:
    mesh = template.asset("render_asset", root)
    if mesh is None:
        raise SceneError(f"{template.where}: it names no 'render_asset'; copy the data set again")
    return mesh


def _vector(values: Mapping[str, JSON], key: str, default: Untyped, where: str) -> Untyped:
    value = values.get(key, default)
    good = isinstance(value, list | tuple) and len(value) == len(default)
    if not good or not all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) < 1e9 for x in value):
        raise SceneError(f"{where}: {key!r} is {value!r:.60}; it must be {len(default)} finite numbers")
    return tuple(float(x) for x in value)


def _inside(root: Path, folder: Path, name: str, where: str) -> Path:
    """A path that a file in ``folder`` names, held inside the root."""
    path = folder.resolve() / name.replace("\\", "/")
    try:
        return resolve_inside(root, _relative(path, root), SceneError)
    except SceneError as error:
        raise SceneError(f"{where.removeprefix('config ')}: {error}") from error


def _relative(path: Path, root: Path) -> str:
    return os.path.relpath(os.path.normpath(path), root) if "\0" not in str(path) else str(path)
