"""Drawings of a design on the posed bodies of a control task: each sensor's field of view as a frustum."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from prnav.domains.control.appearance import PLANE
from prnav.domains.control.engine import mujoco
from prnav.domains.control.frames import to_world
from prnav.domains.control.mounts import PLANS, DesignMounts, load_mounts, sensor_axes
from prnav.domains.control.surfaces import geom_surface
from prnav.errors import DesignError
from prnav.sensors.design import Design

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float64 = NDArray[np.float64]

_BODY = "#c9ced6"
_CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


def frusta(mounts: DesignMounts, data: mujoco.MjData, reach: float) -> list[tuple[Float64, Float64, Float64]]:
    """Apex (3,), corners (4, 3), ``reach`` away, and optical axis (3,) of each sensor in the world."""
    design, bodies = mounts.design, mounts.body_ids
    places, axes = to_world(
        design.sensors[:, :3], sensor_axes(design.sensors), data.xpos[bodies], data.xmat[bodies].reshape(-1, 3, 3)
    )
    drawn = []
    for place, (right, up, back), fov in zip(places, np.moveaxis(axes, -1, -2), design.sensors[:, 6], strict=True):
        half = math.tan(0.5 * fov)
        rays = -back + half * (_CORNERS[:, :1] * right + _CORNERS[:, 1:] * up)
        drawn.append((place, place + reach * rays / np.linalg.norm(rays, axis=1, keepdims=True), -back))
    return drawn


def draw_mounts(mounts: DesignMounts, model: mujoco.MjModel, data: mujoco.MjData) -> Figure:
    """The design's sensors on the bodies as ``data`` poses them; metres, x to the right and z up."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    from prnav import style

    design = mounts.design
    figure = style.new_figure(7.0, 6.5)
    with style.styled():
        axes: Any = figure.add_subplot(projection="3d")
        assert isinstance(axes, Axes3D)
        points = []
        for geom in range(model.ngeom):
            if model.geom_type[geom] == PLANE or model.geom_bodyid[geom] == 0:
                continue
            vertices, faces = geom_surface(model, model.geom(geom).name).outline()
            body = int(model.geom_bodyid[geom])
            shape = vertices @ data.xmat[body].reshape(3, 3).T + data.xpos[body]
            light = np.abs(_facing(shape[faces]))
            shades = np.array(to_rgb(_BODY)) * (0.7 + 0.3 * light[:, None])
            axes.add_collection3d(Poly3DCollection(shape[faces], facecolors=shades, linewidth=0.0, alpha=0.95))
            points.append(shape)
        span = np.concatenate(points)
        reach = 0.3 * float(np.linalg.norm(span.max(axis=0) - span.min(axis=0)))
        for index, (apex, corners, axis) in enumerate(frusta(mounts, data, reach)):
            color = style.SERIES[index % len(style.SERIES)]
            sides = [np.stack([apex, corners[i], corners[(i + 1) % 4]]) for i in range(4)]
            axes.add_collection3d(Poly3DCollection(sides, facecolor=color, edgecolor=color, alpha=0.16, linewidth=0.9))
            axes.plot(*np.stack([apex, apex + 0.6 * reach * axis]).T, color=color, linewidth=1.0, linestyle=(0, (3, 2)))
            axes.scatter(*apex, color=color, s=18, depthshade=False)
            axes.text(*(apex + 1.05 * reach * axis), str(index), color=color, fontweight="bold", zorder=100)
            points.append(corners)
        span = np.concatenate(points)
        middle, half = 0.5 * (span.max(axis=0) + span.min(axis=0)), 0.5 * (span.max(axis=0) - span.min(axis=0))
        half = np.maximum(half, 0.15 * half.max()) * 1.02
        for set_limits, centre, size in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, half, strict=True):
            set_limits(centre - size, centre + size)
        axes.set_aspect("equal")
        axes.view_init(elev=22, azim=-60)
        axes.set_xlabel("x [m]")
        axes.set_zlabel("z [m]")
        lines = [
            f"{i}  {seat.body}   yaw {math.degrees(row[3]):.0f}°   pitch {math.degrees(row[4]):.0f}°   "
            f"roll {math.degrees(row[5]):.0f}°   fov {math.degrees(row[6]):.0f}°"
            for i, (seat, row) in enumerate(zip(design.seats, design.sensors, strict=True))
        ]
        for index, line in enumerate(lines):
            color = style.SERIES[index % len(style.SERIES)]
            figure.text(0.02, 0.02 + 0.022 * (len(lines) - 1 - index), line, color=color, fontsize=8)
        count = design.num_sensors
        title = f"{design.name}: {count} sensor{'s' * (count > 1)} of {design.grid} x {design.grid} receptors"
        figure.suptitle(title, fontsize=13, fontweight="bold", x=0.02, ha="left")
    return figure


def draw_standing(design: str, name: str) -> tuple[Figure, Design]:
    """The drawing of a design by name or path on the bodies of a model as they stand at first, and the design.

    Raises:
        DesignError: the model is unknown, or its bodies refuse the design.
    """
    if name not in PLANS:
        raise DesignError(f"design {design}: model {name!r} is not known; valid: {', '.join(PLANS)}")
    model = PLANS[name].build()
    mounts = load_mounts(design, model)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return draw_mounts(mounts, model, data), mounts.design


def _facing(triangles: Float64) -> Float64:
    """Cosine between each triangle's normal and a light from above, (F,)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normals, axis=1)
    return np.asarray(normals @ np.array([0.4, -0.5, 0.77]) / np.where(length > 0.0, length, 1.0))
