"""Finger: two links that hang beside a spinner and push it round; everything moves in the plane of x and z.

There is no gravity. Targets and tips are sites, so they are seen but never touched.
"""

from __future__ import annotations

from prnav.domains.control.engine import mujoco
from prnav.domains.control.models.looks import add_looks

PHYSICS_STEP = 0.01  # [s]
HEIGHT = 0.4  # of both hubs above the floor [m]
HUB_DISTANCE = 0.2  # of each hub from the middle, along x [m]
CAPS = (0.04, 0.09)  # radius and half length of the spinner's capsules [m]
CAP_OFFSET = 0.02  # of each capsule from the spinner's hub, along x [m]
SPINNER_TIP = 0.13  # from the hub to the end of a capsule: the radius of the targets' circle [m]
JOINT_RANGE = 110.0  # of the finger's joints, to either side [degrees]
JOINT_DAMPING = 2.5  # [N m s/rad]
HINGE_DAMPING = 0.5  # of the spinner as the model is compiled, and in "turn" [N m s/rad]
SPIN_HINGE_DAMPING = 0.03  # in "spin" [N m s/rad]
HINGE_FRICTION = 0.1  # of the spinner [N m]
TORQUES = {"proximal": 30.0, "distal": 15.0}  # of the motors at full action [N m]
CONTACT_SOLIMP = (0.0, 0.9, 0.01, 0.5, 2.0)  # how softly contacts push back
TOUCH_GROUP = 3  # of sites that the renderer leaves out
EASY_TARGET_RADIUS = 0.07  # of the task "turn_easy" [m]


def finger_spin() -> mujoco.MjModel:
    """Model of the task "spin": the spinner turns easily, and neither target nor tip is drawn."""
    model = _finger()
    model.site("target").rgba[3] = model.site("tip").rgba[3] = 0.0
    model.joint("hinge").damping[0] = SPIN_HINGE_DAMPING
    return model


def finger_turn_easy() -> mujoco.MjModel:
    """Model of the task "turn_easy": the large target."""
    model = _finger()
    model.site("target").size[0] = EASY_TARGET_RADIUS
    return model


def _finger() -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.modelname = "finger"
    option = spec.option
    option.timestep, option.iterations = PHYSICS_STEP, 200
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_GRAVITY
    add_looks(spec)
    spec.default.geom.solimp = CONTACT_SOLIMP
    _add_surroundings(spec)
    _add_links(spec)
    _add_spinner(spec)
    for joint, torque in TORQUES.items():
        motor = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gear[0] = torque
        motor.ctrllimited, motor.ctrlrange = True, (-1.0, 1.0)
    _add_sensors(spec)
    return spec.compile()


def _add_surroundings(spec: mujoco.MjSpec) -> None:
    world, xyaxes = spec.worldbody, mujoco.mjtOrientation.mjORIENTATION_XYAXES
    world.add_light(
        name="light",
        pos=(0.0, 0.0, 2.0),
        diffuse=(0.6, 0.6, 0.6),
        specular=(0.3, 0.3, 0.3),
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
    )
    world.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.6, 0.2, 10.0), material="grid")
    above = world.add_camera(name="cam0", pos=(0.0, -1.0, 0.8))
    above.alt.type, above.alt.xyaxes = xyaxes, (1.0, 0.0, 0.0, 0.0, 1.0, 2.0)
    level = world.add_camera(name="cam1", pos=(0.0, -1.0, 0.4))
    level.alt.type, level.alt.xyaxes = xyaxes, (1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    world.add_site(
        name="target",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=(0.0, 0.0, HEIGHT),
        size=(0.03, 0.005, 0.005),
        material="target",
    )


def _add_links(spec: mujoco.MjSpec) -> None:
    kind, hinge = mujoco.mjtGeom, mujoco.mjtJoint.mjJNT_HINGE
    proximal = spec.worldbody.add_body(name="proximal", pos=(-HUB_DISTANCE, 0.0, HEIGHT))
    hub = proximal.add_geom(name="proximal_decoration", type=kind.mjGEOM_CYLINDER, material="decoration")
    hub.fromto, hub.size[0] = (0.0, -0.033, 0.0, 0.0, 0.033, 0.0), 0.034
    shoulder = proximal.add_joint(name="proximal", type=hinge, axis=(0.0, -1.0, 0.0), ref=-90.0)
    shoulder.limited, shoulder.range, shoulder.damping[0] = True, (-JOINT_RANGE, JOINT_RANGE), JOINT_DAMPING
    link = proximal.add_geom(name="proximal", type=kind.mjGEOM_CAPSULE, material="self")
    link.fromto, link.size[0] = (0.0, 0.0, 0.0, 0.0, 0.0, -0.17), 0.03
    distal = proximal.add_body(name="distal", pos=(0.0, 0.0, -0.18))
    elbow = distal.add_joint(name="distal", type=hinge, axis=(0.0, -1.0, 0.0))
    elbow.limited, elbow.range, elbow.damping[0] = True, (-JOINT_RANGE, JOINT_RANGE), JOINT_DAMPING
    link = distal.add_geom(name="distal", type=kind.mjGEOM_CAPSULE, material="self", contype=0, conaffinity=0)
    link.fromto, link.size[0] = (0.0, 0.0, 0.0, 0.0, 0.0, -0.16), 0.028
    tip = distal.add_geom(name="fingertip", type=kind.mjGEOM_CAPSULE, material="effector")
    tip.fromto, tip.size[0] = (0.0, 0.0, -0.13, 0.0, 0.0, -0.161), 0.03
    for name, x in (("touchtop", 0.01), ("touchbottom", -0.01)):
        distal.add_site(
            name=name,
            type=kind.mjGEOM_ELLIPSOID,
            pos=(x, 0.0, -0.17),
            size=(0.025, 0.03, 0.025),
            material="site",
            group=TOUCH_GROUP,
        )


def _add_spinner(spec: mujoco.MjSpec) -> None:
    kind = mujoco.mjtGeom
    spinner = spec.worldbody.add_body(name="spinner", pos=(HUB_DISTANCE, 0.0, HEIGHT))
    hinge = spinner.add_joint(name="hinge", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, -1.0, 0.0))
    hinge.limited, hinge.damping[0], hinge.frictionloss = False, HINGE_DAMPING, HINGE_FRICTION
    for name, x in (("cap1", CAP_OFFSET), ("cap2", -CAP_OFFSET)):
        spinner.add_geom(name=name, type=kind.mjGEOM_CAPSULE, pos=(x, 0.0, 0.0), size=(*CAPS, 0.0), material="self")
    spinner.add_site(
        name="tip",
        type=kind.mjGEOM_SPHERE,
        pos=(0.0, 0.0, SPINNER_TIP),
        size=(0.02, 0.005, 0.005),
        material="target",
    )
    hub = spinner.add_geom(name="spinner_decoration", type=kind.mjGEOM_CYLINDER, material="decoration")
    hub.fromto, hub.size[0] = (0.0, -0.045, 0.0, 0.0, 0.045, 0.0), 0.02


def _add_sensors(spec: mujoco.MjSpec) -> None:
    sensor, thing = mujoco.mjtSensor, mujoco.mjtObj
    joint, site, body = thing.mjOBJ_JOINT, thing.mjOBJ_SITE, thing.mjOBJ_XBODY
    for name, kind, on, what in (
        ("proximal", sensor.mjSENS_JOINTPOS, joint, "proximal"),
        ("distal", sensor.mjSENS_JOINTPOS, joint, "distal"),
        ("proximal_velocity", sensor.mjSENS_JOINTVEL, joint, "proximal"),
        ("distal_velocity", sensor.mjSENS_JOINTVEL, joint, "distal"),
        ("hinge_velocity", sensor.mjSENS_JOINTVEL, joint, "hinge"),
        ("tip", sensor.mjSENS_FRAMEPOS, site, "tip"),
        ("target", sensor.mjSENS_FRAMEPOS, site, "target"),
        ("spinner", sensor.mjSENS_FRAMEPOS, body, "spinner"),
        ("touchtop", sensor.mjSENS_TOUCH, site, "touchtop"),
        ("touchbottom", sensor.mjSENS_TOUCH, site, "touchbottom"),
        ("touchtop_pos", sensor.mjSENS_FRAMEPOS, site, "touchtop"),
        ("touchbottom_pos", sensor.mjSENS_FRAMEPOS, site, "touchbottom"),
    ):
        spec.add_sensor(name=name, type=kind, objtype=on, objname=what)
