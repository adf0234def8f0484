"""Reacher: an arm of two links in a square arena, which reaches for a ball with its fingertip.

The arm lies in a plane 1 cm above the floor and turns about two vertical hinges. Nothing collides and gravity acts
along the hinges, so the ball and the walls are there to be seen only.
"""

from __future__ import annotations

from prnav.domains.control.engine import mujoco
from prnav.domains.control.models.looks import add_looks

PHYSICS_STEP = 0.02  # [s]
ARENA = 0.3  # half the side of the arena [m]
WALL = 0.02  # half the walls' height [m]
HEIGHT = 0.01  # of the arm's plane above the floor [m]
UPPER_ARM = 0.12  # shoulder to wrist [m]
HAND = 0.1  # length of the hand's capsule [m]; the fingertip sits 0.12 m from the wrist
LIMB_RADIUS = 0.01  # [m]
FINGERTIP_RADIUS = 0.01  # [m]
DAMPING = 0.01  # of both hinges [N m s/rad]
TORQUE = 0.05  # of a motor at full action [N m]
WRIST_RANGE = 160.0  # to either side [degrees]
EASY_TARGET_RADIUS = 0.05  # the size that the model is compiled with [m]
TARGET_RADIUS = 0.015  # of the task "hard" [m]
INNER_RADIUS = 0.0075
"""Radius of the green ball inside the target [m]. The paper adds "a smaller object inside the target, which gets
rendered even when the camera is inside the target", without its size; half the target's radius is the choice here."""
INNER_COLOUR = (0.0, 1.0, 0.0, 1.0)


def reacher_hard(inner_ball: bool = True) -> mujoco.MjModel:
    """Model of the task "hard": the small target, with the paper's green ball inside it unless it is left out."""
    spec = mujoco.MjSpec()
    spec.modelname = "two-link planar reacher"
    spec.option.timestep = PHYSICS_STEP
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    add_looks(spec)
    _add_arena(spec, inner_ball)
    _add_arm(spec)
    for joint in ("shoulder", "wrist"):
        motor = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gear[0] = TORQUE
        motor.ctrllimited, motor.ctrlrange = True, (-1.0, 1.0)
    model = spec.compile()
    model.geom("target").size[0] = TARGET_RADIUS
    return model


def _add_arena(spec: mujoco.MjSpec, inner_ball: bool) -> None:
    world, kind = spec.worldbody, mujoco.mjtGeom
    world.add_camera(name="fixed", pos=(0.0, 0.0, 0.75))
    world.add_light(
        name="light",
        pos=(0.0, 0.0, 1.0),
        diffuse=(0.7, 0.7, 0.7),
        specular=(0.3, 0.3, 0.3),
        type=mujoco.mjtLightType.mjLIGHT_SPOT,
    )
    world.add_geom(name="ground", type=kind.mjGEOM_PLANE, size=(ARENA, ARENA, 10.0), material="grid")
    walls = {
        "x": (-1, 0),
        "y": (0, -1),
        "neg_x": (1, 0),
        "neg_y": (0, 1),
    }  # where each stands; its normal points inwards
    for name, (x, y) in walls.items():
        wall = world.add_geom(name=f"wall_{name}", type=kind.mjGEOM_PLANE, material="decoration")
        wall.pos = (x * ARENA, y * ARENA, WALL)
        wall.size = (WALL if x else ARENA, WALL if y else ARENA, WALL)
        wall.alt.type, wall.alt.zaxis = mujoco.mjtOrientation.mjORIENTATION_ZAXIS, (-x, -y, 0.0)
    root = world.add_geom(name="root", type=kind.mjGEOM_CYLINDER, material="decoration")
    root.fromto, root.size[0] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.02), 0.011
    centre = (0.0, 0.0, HEIGHT)
    world.add_geom(
        name="target", type=kind.mjGEOM_SPHERE, pos=centre, size=(EASY_TARGET_RADIUS, 0.0, 0.0), material="target"
    )
    if inner_ball:
        world.add_geom(
            name="target_inner", type=kind.mjGEOM_SPHERE, pos=centre, size=(INNER_RADIUS, 0.0, 0.0), rgba=INNER_COLOUR
        )


def _add_arm(spec: mujoco.MjSpec) -> None:
    kind = mujoco.mjtGeom
    arm = spec.worldbody.add_body(name="arm", pos=(0.0, 0.0, HEIGHT))
    link = arm.add_geom(name="arm", type=kind.mjGEOM_CAPSULE, material="self")
    link.fromto, link.size[0] = (0.0, 0.0, 0.0, UPPER_ARM, 0.0, 0.0), LIMB_RADIUS
    _add_hinge(arm, "shoulder")
    hand = arm.add_body(name="hand", pos=(UPPER_ARM, 0.0, 0.0))
    link = hand.add_geom(name="hand", type=kind.mjGEOM_CAPSULE, material="self")
    link.fromto, link.size[0] = (0.0, 0.0, 0.0, HAND, 0.0, 0.0), LIMB_RADIUS
    wrist = _add_hinge(hand, "wrist")
    wrist.limited, wrist.range = True, (-WRIST_RANGE, WRIST_RANGE)
    finger = hand.add_body(name="finger", pos=(0.12, 0.0, 0.0))
    finger.add_camera(name="hand", pos=(0.0, 0.0, 0.2), mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACK)
    finger.add_geom(name="finger", type=kind.mjGEOM_SPHERE, size=(FINGERTIP_RADIUS, 0.0, 0.0), material="effector")


def _add_hinge(body: mujoco.MjsBody, name: str) -> mujoco.MjsJoint:
    hinge = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, 0.0, 1.0))
    hinge.damping[0] = DAMPING
    return hinge
