"""What a MuJoCo model looks like, as flat arrays that the compiled caster reads: shapes, lights and textures.

This is MuJoCo's classic renderer, OpenGL's fixed function pipeline, as recorded pictures show it. Geoms and sites of
groups 0 to 2 are drawn unless they are fully transparent. A geom's own colour wins over its material's where it is not
the default grey. The headlight shines along the camera's axis; scene lights are spots or directional. S shapes, L
scene lights.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Untyped
from prnav.domains.control.engine import mujoco
from prnav.domains.control.textures import TexturePyramids, build_textures
from prnav.errors import RenderError

Float64 = NDArray[np.float64]

FloorAnchor = Literal["today", "mujoco-3.11"]
"""Where a finite plane's texture begins: at its lower left corner, as MuJoCo has drawn it since 3.12, or at its centre,
as MuJoCo 3.11 and older did."""

PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 0, 2, 3, 4, 5, 6
"""Kinds of shapes by MuJoCo's own numbers."""

DRAWN_GROUPS = 3
"""Geoms and sites of groups below this are drawn."""

OPAQUE = 0.995
"""Shapes of at least this alpha hide what is behind them; others are blended over it."""

FAINT = 1e-4
"""Highlights below this share of their full strength are left out."""

_PLANE_LINES = 200
"""Most cells of a plane's grid of vertices along one side."""

_DEFAULT_RGBA = (0.5, 0.5, 0.5, 1.0)


SHAPE = np.dtype(
    [
        ("kind", np.int64),  # type by MuJoCo's number
        ("site", np.int64),  # 1 for a site
        ("casts", np.int64),  # 1 where it casts shadows
        ("index", np.int64),  # its number among the model's geoms or sites
        ("texture", np.int64),  # -1 for none; planes only
        *((name, np.float64) for name in ("sx", "sy", "sz")),  # size as MuJoCo has it [m]: half lengths, radius first
        ("bound", np.float64),  # radius of its bounding sphere [m]
        *((name, np.float64) for name in ("red", "green", "blue", "alpha")),  # 0 to 1
        *((name, np.float64) for name in ("emission", "gloss", "exponent", "reflectance")),  # of its material
        ("faint", np.float64),  # squared cosine below which a highlight is too faint to count
        *((name, np.float64) for name in ("u", "u0", "v", "v0")),  # a plane's texture lies at (u x + u0, v y + v0)
        *((name, np.float64) for name in ("cell_x", "cell_y")),  # width of the cells of a plane's grid of vertices [m]
        *((name, np.float64) for name in ("whole_x", "whole_y")),  # half extent of its whole cells [m]
    ]
)
"""A drawn shape."""

LIGHT = np.dtype(
    [
        ("index", np.int64),  # its number among the model's lights, -1 for the headlight
        ("directional", np.int64),  # 1 where its rays are parallel
        ("shadows", np.int64),  # 1 where it casts shadows
        *((f"{part}_{color}", np.float64) for part in ("ambient", "diffuse", "specular") for color in "rgb"),
        ("cutoff", np.float64),  # cosine of a spot's cutoff angle; below -1 where there is none
        ("exponent", np.float64),  # of a spot
        *((f"attenuation{power}", np.float64) for power in range(3)),  # of a spot
        ("reach", np.float64),  # half width of the square within which shadows fall: a spot's as a tangent, else [m]
    ]
)
"""A light."""


class Appearance(NamedTuple):
    """All that stays the same while bodies move."""

    shapes: NDArray[np.void]
    """What is drawn, geoms before sites in the model's order: S rows of :data:`SHAPE`."""
    lights: NDArray[np.void]
    """The headlight, black where it is off, and the L scene lights: L + 1 rows of :data:`LIGHT`."""
    textures: TexturePyramids
    sky: int
    """Texture of the sky, -1 for black."""
    near: float
    """What is nearer than this along a camera's axis is not seen [m]."""
    far: float
    """Nor is what is farther than this [m]."""
    mirror: int
    """The shape that mirrors others, -1 for none: the first reflecting plane, as the renderer allows but one."""


def build_appearance(model: mujoco.MjModel, floor: FloorAnchor = "today") -> Appearance:
    """Appearance of a compiled model.

    Raises:
        RenderError: the model has shapes, lights or textures that the caster does not know, or ``floor`` is unknown.
    """
    if floor not in ("today", "mujoco-3.11"):
        raise RenderError(f"floor {floor!r} is not known; valid: today, mujoco-3.11")
    sky = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    extent = float(model.stat.extent)
    shapes = _shapes(model, floor)
    mirrors = np.flatnonzero((shapes["reflectance"] > 0.0) & (shapes["kind"] == PLANE))
    return Appearance(
        shapes,
        _lights(model),
        build_textures(model),
        int(sky[0]) if len(sky) else -1,
        float(model.vis.map.znear) * extent,
        float(model.vis.map.zfar) * extent,
        int(mirrors[0]) if len(mirrors) else -1,
    )


def _shapes(model: mujoco.MjModel, floor: FloorAnchor) -> NDArray[np.void]:
    rows = [(False, geom) for geom in range(model.ngeom)] + [(True, site) for site in range(model.nsite)]
    rows = [row for row in rows if _is_drawn(model, *row)]
    shapes = np.zeros(len(rows), SHAPE)
    for shape, row in zip(shapes, rows, strict=True):
        kind, size = int(_field(model, row, "type")), np.asarray(_field(model, row, "size"), np.float64)
        shape["site"], shape["index"] = row
        shape["casts"] = row[0] or model.geom_castshadow[row[1]]
        shape["kind"], shape["texture"] = kind, _texture(model, row)
        shape["sx"], shape["sy"], shape["sz"] = size
        shape["bound"] = _bound(kind, size)
        shape["red"], shape["green"], shape["blue"], shape["alpha"] = _rgba(model, row)
        shape["emission"], shape["gloss"], shape["exponent"], shape["reflectance"] = _surface(model, row)
        shape["faint"] = FAINT ** (2.0 / max(float(shape["exponent"]), 1e-6))
        if kind == PLANE:
            if size[0] <= 0.0 or size[1] <= 0.0:
                raise RenderError(f"{_name(model, row)}: a plane without end is not drawn; give it a size")
            shape["cell_x"], shape["whole_x"] = _cells(float(size[0]), float(size[2]))
            shape["cell_y"], shape["whole_y"] = _cells(float(size[1]), float(size[2]))
        if shape["texture"] >= 0:
            shape["u"], shape["u0"], shape["v"], shape["v0"] = _uv(model, row, size, floor)
    return shapes


def _is_drawn(model: mujoco.MjModel, site: bool, index: int) -> bool:
    row = site, index
    return bool(int(_field(model, row, "group")) < DRAWN_GROUPS and _rgba(model, row)[3] > 0.0)


def _field(model: mujoco.MjModel, row: tuple[bool, int], name: str) -> Untyped:
    """What a model says of a geom or site: a number, or an array of several."""
    site, index = row
    value = getattr(model.site(index) if site else model.geom(index), name)
    return value[0] if value.shape == (1,) else value


def _name(model: mujoco.MjModel, row: tuple[bool, int]) -> str:
    site, index = row
    name = (model.site(index) if site else model.geom(index)).name
    return f"{'site' if site else 'geom'} {name or index!r}"


def _rgba(model: mujoco.MjModel, row: tuple[bool, int]) -> Float64:
    own = np.asarray(_field(model, row, "rgba"), np.float64)
    material = int(_field(model, row, "matid"))
    if material < 0 or tuple(own) != _DEFAULT_RGBA:
        return own
    return np.asarray(model.mat_rgba[material], np.float64)


def _surface(model: mujoco.MjModel, row: tuple[bool, int]) -> tuple[float, float, float, float]:
    material = int(_field(model, row, "matid"))
    if material < 0:
        return 0.0, 0.5, 0.5 * 128.0, 0.0
    return (
        float(model.mat_emission[material]),
        float(model.mat_specular[material]),
        float(model.mat_shininess[material]) * 128.0,
        float(model.mat_reflectance[material]),
    )


def _texture(model: mujoco.MjModel, row: tuple[bool, int]) -> int:
    material = int(_field(model, row, "matid"))
    texture = -1 if material < 0 else int(model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB])
    if texture < 0:
        return -1
    flat = model.tex_type[texture] == mujoco.mjtTexture.mjTEXTURE_2D
    if int(_field(model, row, "type")) != PLANE or not flat:
        raise RenderError(f"{_name(model, row)}: only planes with a 2d texture are drawn with their texture")
    return texture


def _bound(kind: int, size: Float64) -> float:
    if kind == PLANE:
        return float(math.hypot(size[0], size[1]))
    if kind == SPHERE:
        return float(size[0])
    if kind == CAPSULE:
        return float(size[0] + size[1])
    if kind == CYLINDER:
        return float(math.hypot(size[0], size[1]))
    if kind == ELLIPSOID:
        return float(size.max())
    if kind == BOX:
        return float(np.linalg.norm(size))
    name = mujoco.mjtGeom(kind).name.removeprefix("mjGEOM_").lower()
    raise RenderError(f"a {name} is not drawn; valid: plane, sphere, capsule, ellipsoid, cylinder, box")


def _cells(half: float, spacing: float) -> tuple[float, float]:
    """Width of a cell, and the half extent of the whole cells; the cells at the border take what is left.

    Grid lines lie at multiples of twice the plane's third size from its centre, and at its border.
    """
    step = max(spacing, half / (_PLANE_LINES - 2))
    whole = int(math.floor(half / step))
    whole -= whole % 2
    return 2.0 * step, whole * step


def _uv(model: mujoco.MjModel, row: tuple[bool, int], size: Float64, floor: FloorAnchor) -> Float64:
    material = int(_field(model, row, "matid"))
    repeat = np.asarray(model.mat_texrepeat[material], np.float64)
    scale = 0.5 * repeat / (1.0 if model.mat_texuniform[material] else size[:2])
    if floor == "mujoco-3.11":
        return np.array([scale[0], -0.5, -scale[1], -0.5])
    return np.array([scale[0], scale[0] * size[0], -scale[1], scale[1] * size[1]])


def _lights(model: mujoco.MjModel) -> NDArray[np.void]:
    drawn = [light for light in range(model.nlight) if model.light_active[light]]
    lights = np.zeros(1 + len(drawn), LIGHT)
    head = model.vis.headlight
    lights[0]["index"], lights[0]["directional"], lights[0]["cutoff"], lights[0]["attenuation0"] = -1, 1, -2.0, 1.0
    if head.active:
        _set_colors(lights[0], head.ambient, head.diffuse, head.specular)
    for row, light in zip(lights[1:], drawn, strict=True):
        row["index"], row["shadows"] = light, model.light_castshadow[light]
        _set_colors(row, model.light_ambient[light], model.light_diffuse[light], model.light_specular[light])
        cutoff = float(model.light_cutoff[light])
        kind = mujoco.mjtLightType(int(model.light_type[light]))
        if kind == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL:
            row["directional"], row["cutoff"], row["attenuation0"] = 1, -2.0, 1.0
            row["reach"] = float(model.vis.map.shadowclip) * float(model.stat.extent)
        elif kind == mujoco.mjtLightType.mjLIGHT_SPOT:
            # a cutoff of 180 degrees is OpenGL's word for none
            row["cutoff"] = -2.0 if cutoff == 180.0 else math.cos(math.radians(cutoff))
            row["exponent"] = model.light_exponent[light]
            row["attenuation0"], row["attenuation1"], row["attenuation2"] = model.light_attenuation[light]
            full = min(2.0 * cutoff * float(model.vis.map.shadowscale), 160.0)
            row["reach"] = math.tan(math.radians(0.5 * full))
        else:
            name = model.light(light).name or light
            word = kind.name.removeprefix("mjLIGHT_").lower()
            raise RenderError(f"light {name!r} is of type {word}; valid: spot, directional")
    return lights


def _set_colors(row: NDArray[np.void], *parts: NDArray[np.float32]) -> None:
    for name, colors in zip(("ambient", "diffuse", "specular"), parts, strict=True):
        for letter, value in zip("rgb", colors, strict=True):
            row[f"{name}_{letter}"] = value
