"""Design files: TOML, one table per sensor, angles in degrees; and the library that travels with the package."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tomli_w

from prnav.config import load_config
from prnav.errors import ConfigError, DesignError
from prnav.files import resolve_inside, write_text
from prnav.resources import resource
from prnav.sensors.body import Body, BodySurface
from prnav.sensors.design import AXES, MIRROR, Design, DesignSpace, Link, Seat
from prnav.sensors.mesh_body import load_mesh_body


@dataclass(frozen=True)
class _SensorTable:
    body: str = ""
    position: tuple[float, float, float] | None = None
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    fov_deg: float = 90.0
    frozen: tuple[str, ...] = ()
    mirror_of: int | None = None
    tied_to: int | None = None


@dataclass(frozen=True)
class _BodyTable:
    radius: float = Body.radius
    height: float = Body.height
    mesh: str | None = None
    model: str = ""


@dataclass(frozen=True)
class _LimitsTable:
    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None
    z: tuple[float, float] | None = None
    yaw_deg: tuple[float, float] | None = None
    pitch_deg: tuple[float, float] | None = None
    roll_deg: tuple[float, float] | None = None


@dataclass(frozen=True)
class _SpaceTable:
    x: float = DesignSpace.x
    y: float = DesignSpace.y
    z: float = DesignSpace.z
    yaw_deg: float = 90.0
    pitch_deg: float = 90.0
    roll_deg: float = 90.0
    fov_deg: float = 45.0
    fov_min_deg: float = 1.0
    fov_max_deg: float = 179.0
    frozen: tuple[str, ...] = ()
    limits: _LimitsTable = field(default_factory=_LimitsTable)


@dataclass(frozen=True)
class _DesignTable:
    name: str
    sensors: tuple[_SensorTable, ...]
    description: str = ""
    grid: int = 4
    body: _BodyTable = field(default_factory=_BodyTable)
    space: _SpaceTable = field(default_factory=_SpaceTable)


def library_designs(model: str = "") -> list[str]:
    """Names of the designs that travel with the package: for the cylinder, or for the named model's bodies."""
    paths = sorted(resource("configs", "designs").glob("*.toml"))
    return [path.stem for path in paths if load_config(_DesignTable, path).body.model == model]


class DesignSummary(NamedTuple):
    """What a design of the library is, without the bodies that its sensors sit on."""

    name: str
    model: str
    """The model on whose bodies its sensors sit; empty for one body that the design describes."""
    sensors: int
    grid: int
    description: str


def design_summaries() -> list[DesignSummary]:
    """All designs that travel with the package, for whatever body."""
    paths = sorted(resource("configs", "designs").glob("*.toml"))
    tables = [load_config(_DesignTable, path) for path in paths]
    return [DesignSummary(t.name, t.body.model, len(t.sensors), t.grid, t.description) for t in tables]


def design_model(path_or_name: str | Path) -> str:
    """The model on whose bodies a design's sensors sit; empty for one body that the design itself describes.

    Raises:
        DesignError: as :func:`load_design`.
    """
    return _read_table(path_or_name)[0].body.model


def load_design(
    path_or_name: str | Path, sensors: int | None = None, bodies: Mapping[str, BodySurface] | None = None
) -> Design:
    """Design from a TOML file, or from the library by name. Photoreceptor grids and cameras share the format.

    Args:
        path_or_name: a path, or a name of the library; what ends in ``.toml`` is a path.
        sensors: number of sensors that the design must have, if given.
        bodies: surfaces that sensors can sit on, by the names that the file's sensors give; needed where it names a
            model.

    Raises:
        DesignError: no such file or name, a broken file, or a design that its body, its limits or ``sensors`` refuse.
    """
    table, path = _read_table(path_or_name, bodies is not None)
    if table.body.model and bodies is None:
        raise DesignError(f"{path}: design {table.name} is for the bodies of {table.body.model!r}, which are not here")
    try:
        design = _design(table, path, bodies)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error
    if sensors is not None and design.num_sensors != sensors:
        raise DesignError(f"{path}: design {design.name} has {design.num_sensors} sensors; {sensors} are needed")
    return design


def _read_table(path_or_name: str | Path, for_bodies: bool = False) -> tuple[_DesignTable, Path]:
    path = Path(path_or_name)
    if path.suffix != ".toml":
        folder = resource("configs", "designs")
        if not (folder / f"{path_or_name}.toml").is_file() or "/" in str(path_or_name):
            names = [summary.name for summary in design_summaries() if bool(summary.model) == for_bodies]
            raise DesignError(
                f"design {str(path_or_name)!r} is not in the library; valid: {', '.join(names)}, or the path of a "
                f".toml file"
            )
        path = folder / f"{path_or_name}.toml"
    try:
        return load_config(_DesignTable, path), path
    except ConfigError as error:
        raise DesignError(str(error)) from error


def _design(table: _DesignTable, path: Path, bodies: Mapping[str, BodySurface] | None) -> Design:
    rows: list[list[float]] = []
    links: list[Link] = []
    for index, sensor in enumerate(table.sensors):
        leader = sensor.tied_to if sensor.mirror_of is None else sensor.mirror_of
        if leader is not None:
            if sensor.mirror_of is not None and sensor.tied_to is not None:
                raise DesignError(f"sensor {index}: it has mirror_of and tied_to; give one of them")
            links.append(Link(index, leader, sensor.mirror_of is not None))
        if sensor.position is None:
            if sensor.mirror_of is None:
                raise DesignError(f"sensor {index}: it lacks position = [x, y, z]; only a mirror_of may leave it out")
            if not 0 <= sensor.mirror_of < index:
                raise DesignError(
                    f"sensor {index}: mirror_of is {sensor.mirror_of}; name a sensor that stands before it"
                )
            rows.append(list(np.array(rows[sensor.mirror_of]) * MIRROR))
            continue
        angles = (sensor.yaw_deg, sensor.pitch_deg, sensor.roll_deg, sensor.fov_deg)
        rows.append([*sensor.position, *map(math.radians, angles)])
    frozen = tuple(sensor.frozen for sensor in table.sensors)
    return Design(
        table.name,
        np.array(rows).reshape(-1, 7),
        table.grid,
        _body(table.body, path),
        _space(table.space),
        table.description,
        frozen if any(frozen) else (),
        tuple(links),
        _seats(table, bodies),
        table.body.model,
    )


def _seats(table: _DesignTable, bodies: Mapping[str, BodySurface] | None) -> tuple[Seat, ...]:
    if not bodies:
        for index, sensor in enumerate(table.sensors):
            if sensor.body:
                raise DesignError(
                    f"sensor {index}: it names body {sensor.body!r}, but the design is for a single one; leave it out, "
                    f"or name a model under [body]"
                )
        return ()
    for index, sensor in enumerate(table.sensors):
        if sensor.body not in bodies:
            raise DesignError(f"sensor {index}: body {sensor.body!r} is not known; valid: {', '.join(bodies)}")
    return tuple(Seat(sensor.body, bodies[sensor.body]) for sensor in table.sensors)


def _body(table: _BodyTable, path: Path) -> BodySurface:
    if table.mesh is None:
        return Body(table.radius, table.height)
    return load_mesh_body(resolve_inside(path.parent, table.mesh, DesignError), table.mesh)


def _space(table: _SpaceTable) -> DesignSpace:
    values = {}
    for axis in (*AXES, "fov_min", "fov_max"):
        values[axis] = getattr(table, axis) if axis in AXES[:3] else math.radians(getattr(table, f"{axis}_deg"))
    limits = []
    for axis in AXES[:6]:
        given = getattr(table.limits, axis if axis in AXES[:3] else f"{axis}_deg")
        if given is not None:
            low, high = given if axis in AXES[:3] else map(math.radians, given)
            limits.append((axis, low, high))
    return DesignSpace(**values, frozen=table.frozen, limits=tuple(limits))


def design_to_toml(design: Design) -> str:
    """Text that :func:`load_design` reads back; degrees and metres to 12 digits.

    Raises:
        DesignError: the body is a mesh that does not come from a file.
    """
    space = design.space
    lines = [
        _text("name", design.name),
        _text("description", design.description),
        f"grid = {design.grid}",
        "",
        "[body]",
        *_body_lines(design),
        "",
        "[space]",
        *(f"{axis} = {getattr(space, axis)!r}" for axis in AXES[:3]),
        *(f"{axis}_deg = {_degrees(getattr(space, axis))}" for axis in (*AXES[3:], "fov_min", "fov_max")),
    ]
    if space.frozen:
        lines.append(f"frozen = {json.dumps(list(space.frozen))}")
    if space.limits:
        lines += ["", "[space.limits]"]
        for axis, low, high in space.limits:
            if axis in AXES[:3]:
                lines.append(f"{axis} = [{_number(low)}, {_number(high)}]")
            else:
                lines.append(f"{axis}_deg = [{_degrees(low)}, {_degrees(high)}]")
    links = {link.follower: link for link in design.links}
    for index, row in enumerate(design.sensors):
        lines += [
            "",
            "[[sensors]]",
            *([f"body = {json.dumps(design.seats[index].body)}"] if design.seats else []),
            "position = [" + ", ".join(_number(value) for value in row[:3]) + "]",
            *(f"{axis}_deg = {_degrees(value)}" for axis, value in zip(AXES[3:], row[3:], strict=True)),
        ]
        if design.frozen and design.frozen[index]:
            lines.append(f"frozen = {json.dumps(list(design.frozen[index]))}")
        if index in links:
            lines.append(f"{'mirror_of' if links[index].mirrored else 'tied_to'} = {links[index].leader}")
    return "\n".join(lines) + "\n"


def _body_lines(design: Design) -> list[str]:
    if design.seats:
        return [f"model = {json.dumps(design.model)}"]
    if isinstance(design.body, Body):
        return [f"radius = {design.body.radius!r}", f"height = {design.body.height!r}"]
    file = getattr(design.body, "file", "")
    if not file:
        raise DesignError(f"design {design.name}: its body comes from no file; save the mesh and load the body from it")
    return [_text("mesh", file)]


def _text(key: str, value: str) -> str:
    """A line of TOML, whatever characters the value has."""
    return tomli_w.dumps({key: value}).rstrip("\n")


def _number(value: float) -> str:
    return repr(float(f"{value:.12g}") + 0.0)


def _degrees(angle: float) -> str:
    return _number(math.degrees(angle))


def save_design(design: Design, path: str | Path) -> None:
    """Write a design file, atomically. The file of a mesh body is named, not copied: it must lie beside it."""
    write_text(path, design_to_toml(design))
