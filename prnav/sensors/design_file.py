"""Design files: TOML, one table per sensor, angles in degrees; and the library that travels with the package."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from prnav.config import load_config
from prnav.errors import ConfigError, DesignError
from prnav.files import write_text
from prnav.resources import resource
from prnav.sensors.body import Body
from prnav.sensors.design import AXES, Design, DesignSpace


@dataclass(frozen=True)
class _SensorTable:
    position: tuple[float, float, float]
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    fov_deg: float = 90.0


@dataclass(frozen=True)
class _BodyTable:
    radius: float = Body.radius
    height: float = Body.height


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


@dataclass(frozen=True)
class _DesignTable:
    name: str
    sensors: tuple[_SensorTable, ...]
    description: str = ""
    grid: int = 4
    body: _BodyTable = field(default_factory=_BodyTable)
    space: _SpaceTable = field(default_factory=_SpaceTable)


def library_designs() -> list[str]:
    """Names of the designs that travel with the package."""
    return sorted(path.stem for path in resource("configs", "designs").glob("*.toml"))


def load_design(path_or_name: str | Path, sensors: int | None = None) -> Design:
    """Design from a TOML file, or from the library by name.

    Args:
        path_or_name: a path, or a name of :func:`library_designs`; what ends in ``.toml`` is a path.
        sensors: number of sensors that the design must have, if given.

    Raises:
        DesignError: no such file or name, a broken file, or a design that its body, its limits or ``sensors`` refuse.
    """
    path = Path(path_or_name)
    if path.suffix != ".toml":
        if str(path_or_name) not in library_designs():
            raise DesignError(
                f"design {str(path_or_name)!r} is not in the library; valid: {', '.join(library_designs())}, or the "
                f"path of a .toml file"
            )
        path = resource("configs", "designs", f"{path_or_name}.toml")
    try:
        table = load_config(_DesignTable, path)
        body = Body(table.body.radius, table.body.height)
        rows = [
            [*s.position, *(math.radians(a) for a in (s.yaw_deg, s.pitch_deg, s.roll_deg, s.fov_deg))]
            for s in table.sensors
        ]
        design = Design(
            table.name, np.array(rows).reshape(-1, 7), table.grid, body, _space(table.space), table.description
        )
    except ConfigError as error:
        raise DesignError(str(error)) from error
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error
    if sensors is not None and design.num_sensors != sensors:
        raise DesignError(f"{path}: design {design.name} has {design.num_sensors} sensors; {sensors} are needed")
    return design


def _space(table: _SpaceTable) -> DesignSpace:
    values = {}
    for axis in (*AXES, "fov_min", "fov_max"):
        key = f"{axis}_deg"
        values[axis] = math.radians(getattr(table, key)) if hasattr(table, key) else getattr(table, axis)
    return DesignSpace(**values)


def design_to_toml(design: Design) -> str:
    """Text that :func:`load_design` reads back; degrees and metres to 12 digits."""
    body, space = design.body, design.space
    lines = [
        f"name = {json.dumps(design.name)}",
        f"description = {json.dumps(design.description)}",
        f"grid = {design.grid}",
        "",
        "[body]",
        f"radius = {body.radius!r}",
        f"height = {body.height!r}",
        "",
        "[space]",
        *(f"{axis} = {getattr(space, axis)!r}" for axis in AXES[:3]),
        *(f"{axis}_deg = {_degrees(getattr(space, axis))}" for axis in (*AXES[3:], "fov_min", "fov_max")),
    ]
    for row in design.sensors:
        lines += [
            "",
            "[[sensors]]",
            "position = [" + ", ".join(_number(value) for value in row[:3]) + "]",
            *(f"{axis}_deg = {_degrees(value)}" for axis, value in zip(AXES[3:], row[3:], strict=True)),
        ]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return repr(float(f"{value:.12g}") + 0.0)


def _degrees(angle: float) -> str:
    return _number(math.degrees(angle))


def save_design(design: Design, path: str | Path) -> None:
    """Write a design file, atomically."""
    write_text(path, design_to_toml(design))
