"""Sensors on the bodies of the control tasks: designs from files, placed in their bodies' frames.

A sensor's position is in the frame of the body it sits on. At yaw, pitch and roll 0 it looks along the body's +x with
+z up; positive yaw turns left (counter-clockwise seen from +z), positive pitch looks up, positive roll turns its image
clockwise. That is the rotation Ry(yaw) Rx(pitch) Rz(roll) of :mod:`prnav.sensors.design` in a frame whose right is the
body's -y, whose up is its +z, and which looks along its +x.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.domains.control import models
from prnav.domains.control.engine import mujoco
from prnav.domains.control.surfaces import GeomSurface, geom_surface
from prnav.errors import DesignError
from prnav.sensors.design import Design, Seat
from prnav.sensors.design_file import load_design
from prnav.sensors.design_map import theta_to_pose

Float64 = NDArray[np.float64]


class SeatPlan(NamedTuple):
    """Which bodies of a model may carry sensors."""

    standard: str
    """Design that is taken where none is named."""
    build: Callable[[], mujoco.MjModel]
    """Compiles the model."""
    geoms: Mapping[str, str]
    """The geom whose surface sensors sit on, by the name that designs give it."""


PLANS: Mapping[str, SeatPlan] = {
    "reacher": SeatPlan("reacher-4", models.reacher_hard, {name: name for name in ("arm", "hand", "finger")}),
    "walker": SeatPlan(
        "walker-4",
        models.walker,
        {
            name: name
            for name in (
                "torso",
                *(f"{side}_{part}" for side in ("right", "left") for part in ("thigh", "leg", "foot")),
            )
        },
    ),
    "finger": SeatPlan("finger-4", models.finger_spin, {name: name for name in ("proximal", "distal", "fingertip")}),
}
"""The plans by model: every moving body of reacher and walker; of the finger its two links and its tip, not the
spinner, which is no part of the agent."""


def model_name(model: mujoco.MjModel) -> str:
    """Which of :data:`PLANS` a compiled model is.

    Raises:
        DesignError: it is none of them.
    """
    for name, plan in PLANS.items():
        if all(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, geom) >= 0 for geom in plan.geoms.values()):
            return name
    raise DesignError(f"the model's bodies are not known to designs; valid models: {', '.join(PLANS)}")


def model_surfaces(model: mujoco.MjModel) -> dict[str, GeomSurface]:
    """Surfaces that sensors may sit on, by the names that designs give them."""
    return {name: geom_surface(model, geom) for name, geom in PLANS[model_name(model)].geoms.items()}


class DesignMounts:
    """The sensors of a design on a model's bodies."""

    def __init__(self, design: Design, model: mujoco.MjModel) -> None:
        """Mounts of a design whose seats are bodies of ``model``.

        Raises:
            DesignError: a sensor sits on a body that the model does not offer, or inside another geom of it.
        """
        plan = PLANS[model_name(model)]
        for index, seat in enumerate(design.seats):
            if seat.body not in plan.geoms:
                raise DesignError(
                    f"design {design.name}: sensor {index}: body {seat.body!r} is not known; valid: "
                    f"{', '.join(plan.geoms)}"
                )
        if not design.seats:
            raise DesignError(
                f"design {design.name}: its sensors name no bodies; give each body = NAME, one of "
                f"{', '.join(plan.geoms)}"
            )
        self.design = design
        self.body_ids: NDArray[np.int64] = np.array(
            [model.geom_bodyid[model.geom(plan.geoms[seat.body]).id] for seat in design.seats], np.int64
        )
        self._check_inside(model, plan)

    @property
    def num_sensors(self) -> int:
        """Number of sensors K."""
        return self.design.num_sensors

    def theta_to_pose(self, theta: ArrayLike) -> tuple[Float64, Float64, Float64]:
        """Places (n, K, 3) [m] and axes (n, K, 3, 3) in the bodies' frames, and fields of view (n, K) [rad].

        Axes are right, up and back as columns; theta (n, K, 7) is around the design, see
        :mod:`prnav.sensors.design_map`.
        """
        poses = theta_to_pose(theta, self.design)
        return poses[..., :3], sensor_axes(poses), poses[..., 6]

    def _check_inside(self, model: mujoco.MjModel, plan: SeatPlan) -> None:
        for index, (seat, body) in enumerate(zip(self.design.seats, self.body_ids, strict=True)):
            for name, geom in plan.geoms.items():
                same = int(model.geom_bodyid[model.geom(geom).id]) == body
                if same and name != seat.body and geom_surface(model, geom).contains(self.design.sensors[index, :3]):
                    raise DesignError(
                        f"design {self.design.name}: sensor {index} on {seat.body} lies inside {name}; move it out"
                    )


def sensor_axes(poses: ArrayLike) -> Float64:
    """Axes (..., 3, 3) in the bodies' frames, columns right, up and back, of poses (..., 7)."""
    poses = np.asarray(poses, np.float64)
    yaw, pitch, roll = (np.ascontiguousarray(poses[..., axis]) for axis in (3, 4, 5))
    cy, sy, cp, sp, cr, sr = (f(angle) for angle in (yaw, pitch, roll) for f in (np.cos, np.sin))
    right = (cy * cr + sy * sp * sr, cp * sr, -sy * cr + cy * sp * sr)
    up = (-cy * sr + sy * sp * cr, cp * cr, sy * sr + cy * sp * cr)
    back = (sy * cp, -sp, cy * cp)
    # a design's right, up and back are the body's -y, +z and -x
    columns = [np.stack([-z, -x, y], axis=-1) for x, y, z in (right, up, back)]
    return np.stack(columns, axis=-1)


def load_mounts(design: str | Path, model: mujoco.MjModel) -> DesignMounts:
    """Mounts of a design by name or path; of the model's standard one where ``design`` is empty.

    Raises:
        DesignError: no such design, one for another model, or one that the model's bodies refuse.
    """
    name = model_name(model)
    return DesignMounts(load_design(design or PLANS[name].standard, bodies=model_surfaces(model)), model)


def make_design(name: str, model: mujoco.MjModel, rows: list[tuple[str, ArrayLike]], grid: int = 1) -> Design:
    """A design from (body, pose) rows, each pose of seven numbers in metres and radians.

    Raises:
        DesignError: a body is unknown, or a pose is not on it.
    """
    surfaces = model_surfaces(model)
    for index, (body, _) in enumerate(rows):
        if body not in surfaces:
            raise DesignError(
                f"design {name}: sensor {index}: body {body!r} is not known; valid: {', '.join(surfaces)}"
            )
    seats = tuple(Seat(body, surfaces[body]) for body, _ in rows)
    poses = np.array([np.asarray(pose, np.float64) for _, pose in rows])
    return Design(name, poses, grid, seats=seats, model=model_name(model))
