"""Walker: a torso on two legs of thigh, shin and foot, which moves in the vertical plane of x and z.

Each limb is a capsule. The torso slides along z and x and turns about y; the six other joints have motors.
"""

from __future__ import annotations

from typing import NamedTuple

from prnav.domains.control.engine import mujoco
from prnav.domains.control.models.looks import add_looks

PHYSICS_STEP = 0.0025  # [s]
FRICTION = (0.7, 0.1, 0.1)  # sliding, torsional, rolling
FLOOR_CENTRE = 248.0  # along x [m]
FLOOR_SIZE = (250.0, 0.8, 0.2)  # half lengths along x and y, spacing of the grid [m]
TORSO_HEIGHT = 1.3  # of the torso's centre in the reference pose [m]
ARMATURE = 0.01  # of the motors' rotors [kg m2]
DAMPING = 0.1  # of the motors' joints [N m s/rad]
LIMIT_SOLIMP = (0.0, 0.99, 0.01, 0.5, 2.0)  # how softly joint limits push back


class Limb(NamedTuple):
    """One capsule of a leg, its place in the limb above, and its joint."""

    name: str
    pos: tuple[float, float, float]
    """Body in its parent's frame, for the right leg [m]; the left one mirrors y."""
    capsule: tuple[float, float]
    """Radius and half length [m]."""
    centre: tuple[float, float, float]
    """Capsule's centre in the body's frame [m]."""
    joint: str
    anchor: tuple[float, float, float]
    """Joint in the body's frame [m]."""
    limits: tuple[float, float]
    """Range of the joint [degrees]."""
    torque: float
    """Of the motor at full action [N m]."""


LEG = (
    Limb("thigh", (0.0, -0.05, -0.3), (0.05, 0.225), (0.0, 0.0, -0.225), "hip", (0.0, 0.0, 0.0), (-20.0, 100.0), 100.0),
    Limb("leg", (0.0, 0.0, -0.7), (0.04, 0.25), (0.0, 0.0, 0.0), "knee", (0.0, 0.0, 0.25), (-150.0, 0.0), 50.0),
    Limb("foot", (0.06, 0.0, -0.25), (0.05, 0.1), (0.0, 0.0, 0.0), "ankle", (-0.06, 0.0, 0.0), (-45.0, 45.0), 20.0),
)


def walker() -> mujoco.MjModel:
    """Model of the tasks "stand", "walk" and "run"."""
    spec = mujoco.MjSpec()
    spec.modelname = "planar walker"
    spec.option.timestep = PHYSICS_STEP
    spec.stat.extent, spec.stat.center = 2.0, (0.0, 0.0, 1.0)
    add_looks(spec)
    floor = spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, material="grid", friction=FRICTION)
    floor.pos, floor.size, floor.conaffinity = (FLOOR_CENTRE, 0.0, 0.0), FLOOR_SIZE, 1
    torso = _add_torso(spec)
    for side, mirror in (("right", 1.0), ("left", -1.0)):
        body = torso
        for limb in LEG:
            body = _add_limb(body, side, mirror, limb)
    for side in ("right", "left"):
        for limb in LEG:
            joint = f"{side}_{limb.joint}"
            motor = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            motor.gear[0] = limb.torque
            motor.ctrllimited, motor.ctrlrange = True, (-1.0, 1.0)
    spec.add_sensor(
        name="torso_subtreelinvel",
        type=mujoco.mjtSensor.mjSENS_SUBTREELINVEL,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        objname="torso",
    )
    return spec.compile()


def _add_torso(spec: mujoco.MjSpec) -> mujoco.MjsBody:
    track = mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM
    torso = spec.worldbody.add_body(name="torso", pos=(0.0, 0.0, TORSO_HEIGHT))
    torso.add_light(
        name="light",
        pos=(0.0, 0.0, 2.0),
        mode=track,
        diffuse=(0.7, 0.7, 0.7),
        specular=(0.3, 0.3, 0.3),
        type=mujoco.mjtLightType.mjLIGHT_SPOT,
    )
    side = torso.add_camera(name="side", pos=(0.0, -2.0, 0.7), mode=track)
    side.alt.type, side.alt.euler = mujoco.mjtOrientation.mjORIENTATION_EULER, (60.0, 0.0, 0.0)
    back = torso.add_camera(name="back", pos=(-2.0, 0.0, 0.5), mode=track)
    back.alt.type, back.alt.xyaxes = mujoco.mjtOrientation.mjORIENTATION_XYAXES, (0.0, -1.0, 0.0, 1.0, 0.0, 3.0)
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    for name, kind, axis in (
        ("rootz", slide, (0.0, 0.0, 1.0)),
        ("rootx", slide, (1.0, 0.0, 0.0)),
        ("rooty", hinge, (0.0, 1.0, 0.0)),
    ):
        joint = torso.add_joint(name=name, type=kind, axis=axis, solimp_limit=LIMIT_SOLIMP)
        joint.limited = False
    _add_capsule(torso, "torso", (0.07, 0.3), (0.0, 0.0, 0.0))
    return torso


def _add_limb(parent: mujoco.MjsBody, side: str, mirror: float, limb: Limb) -> mujoco.MjsBody:
    x, y, z = limb.pos
    body = parent.add_body(name=f"{side}_{limb.name}", pos=(x, mirror * y, z))
    joint = body.add_joint(name=f"{side}_{limb.joint}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, -1.0, 0.0))
    joint.pos, joint.limited, joint.range = limb.anchor, True, limb.limits
    joint.solimp_limit, joint.armature, joint.damping[0] = LIMIT_SOLIMP, ARMATURE, DAMPING
    capsule = _add_capsule(body, f"{side}_{limb.name}", limb.capsule, limb.centre)
    if limb.name == "foot":
        capsule.alt.type, capsule.alt.zaxis = mujoco.mjtOrientation.mjORIENTATION_ZAXIS, (1.0, 0.0, 0.0)
    return body


def _add_capsule(
    body: mujoco.MjsBody, name: str, shape: tuple[float, float], centre: tuple[float, float, float]
) -> mujoco.MjsGeom:
    capsule = body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, material="self", friction=FRICTION)
    capsule.pos, capsule.size = centre, (*shape, 0.0)
    capsule.contype, capsule.conaffinity = 1, 0  # limbs touch the floor and pass through each other
    return capsule
