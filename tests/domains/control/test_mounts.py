"""Designs of sensors on the bodies of the control tasks."""

from __future__ import annotations

import math

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

from prnav.domains.control.mounts import (  # noqa: E402
    PLANS,
    DesignMounts,
    load_mounts,
    make_design,
    model_name,
    model_surfaces,
    sensor_axes,
)
from prnav.errors import DesignError  # noqa: E402
from prnav.sensors import design_summaries, design_to_toml, library_designs, load_design, pose_to_theta  # noqa: E402
from prnav.sensors import theta_to_pose as to_pose  # noqa: E402

MODELS = {name: plan.build() for name, plan in PLANS.items()}
DESIGNS = [(s.model, s.name) for s in design_summaries() if s.model]


def test_models_are_told_apart():
    for name, model in MODELS.items():
        assert model_name(model) == name
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    with pytest.raises(DesignError, match="valid models: reacher, walker, finger"):
        model_name(empty)


def test_each_model_has_designs_of_two_four_and_eight_sensors():
    for name in MODELS:
        assert library_designs(name) == [f"{name}-{count}" for count in (2, 4, 8)]
        assert not set(library_designs(name)) & set(library_designs())


@pytest.mark.parametrize(("model", "name"), DESIGNS)
def test_library_designs_sit_on_their_bodies(model, name, tmp_path):
    mounts = load_mounts(name, MODELS[model])
    assert mounts.num_sensors == int(name.split("-")[1]) == len(mounts.body_ids)
    places, axes, fovs = mounts.theta_to_pose(np.zeros((1, mounts.num_sensors, 7)))
    assert (places[0] == mounts.design.sensors[:, :3]).all() and (fovs[0] == mounts.design.sensors[:, 6]).all()
    np.testing.assert_allclose(np.linalg.det(axes), 1.0, atol=1e-12)
    theta = np.random.default_rng(0).normal(size=(20, mounts.num_sensors, 7)) * 0.3
    poses = to_pose(theta, mounts.design)
    np.testing.assert_allclose(to_pose(pose_to_theta(poses, mounts.design), mounts.design), poses, atol=1e-9)
    path = tmp_path / "design.toml"
    path.write_text(design_to_toml(mounts.design))
    again = load_design(path, bodies=model_surfaces(MODELS[model]))
    np.testing.assert_allclose(again.sensors, mounts.design.sensors, atol=1e-11)
    assert [seat.body for seat in again.seats] == [seat.body for seat in mounts.design.seats]


def test_without_a_name_the_standard_design_is_taken():
    for name, model in MODELS.items():
        assert load_mounts("", model).design.name == f"{name}-4"


def test_a_sensor_looks_along_x_with_z_up_and_turns_left():
    axes = sensor_axes([[0, 0, 0, 0, 0, 0, 1], [0, 0, 0, math.pi / 2, 0, 0, 1], [0, 0, 0, 0, math.pi / 2, 0, 1]])
    np.testing.assert_allclose(axes[0], np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]]).T, atol=1e-15)
    np.testing.assert_allclose(-axes[1][:, 2], [0, 1, 0], atol=1e-15)  # yaw: to the left
    np.testing.assert_allclose(-axes[2][:, 2], [0, 0, 1], atol=1e-15)  # pitch: up


def design_file(tmp_path, text):
    path = tmp_path / "d.toml"
    path.write_text('name = "d"\n' + text)
    return path


SENSOR = "[[sensors]]\nbody = {body!r}\nposition = {position}\n"


@pytest.mark.parametrize(
    ("body", "position", "message"),
    [
        ("tail", [0.07, 0.0, 0.1], r"d\.toml: sensor 0: body 'tail' is not known; valid: torso, right_thigh"),
        ("torso", [0.01, 0.0, 0.1], r"sensor 0: position .* lies inside the body \(capsule of radius 0\.07 m"),
        ("torso", [0.3, 0.0, 0.1], "sensor 0: position .* lies off the body"),
    ],
)
def test_sensors_that_cannot_be_placed_are_named(tmp_path, body, position, message):
    path = design_file(tmp_path, '[body]\nmodel = "walker"\n' + SENSOR.format(body=body, position=position))
    with pytest.raises(DesignError, match=message):
        load_mounts(path, MODELS["walker"])


def test_a_sensor_inside_another_geom_of_its_body_is_named():
    design = make_design("d", MODELS["finger"], [("distal", [0.0, 0.028, -0.14, 0, 0, 0, 1])])
    with pytest.raises(DesignError, match="sensor 0 on distal lies inside fingertip; move it out"):
        DesignMounts(design, MODELS["finger"])


def test_designs_for_other_bodies_are_refused(tmp_path):
    with pytest.raises(DesignError, match="body 'torso' is not known; valid: arm, hand, finger"):
        load_mounts("walker-2", MODELS["reacher"])
    with pytest.raises(DesignError, match="is for the bodies of 'walker', which are not here"):
        load_design("walker-2")
    with pytest.raises(DesignError, match="sensor 0: body '' is not known"):
        load_mounts("ring", MODELS["walker"])
    path = design_file(tmp_path, "[[sensors]]\nbody = 'torso'\nposition = [0.0, 1.0, -0.1]\n")
    with pytest.raises(DesignError, match="names body 'torso', but the design is for a single one"):
        load_design(path)
    path = design_file(
        tmp_path,
        '[body]\nmodel = "walker"\n'
        + SENSOR.format(body="torso", position=[0.07, 0.0, 0.1])
        + '[[sensors]]\nbody = "torso"\nmirror_of = 0\n',
    )
    with pytest.raises(DesignError, match="mirror_of and tied_to need one body with an axis"):
        load_mounts(path, MODELS["walker"])


def test_drawings_show_every_sensor():
    from prnav.domains.control.drawing import draw_standing, frusta

    mounts = load_mounts("walker-4", MODELS["walker"])
    data = mujoco.MjData(MODELS["walker"])
    mujoco.mj_forward(MODELS["walker"], data)
    drawn = frusta(mounts, data, 0.5)
    np.testing.assert_allclose(drawn[0][0], data.body("torso").xpos + mounts.design.sensors[0, :3], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(drawn[0][1] - drawn[0][0], axis=1), 0.5, atol=1e-12)
    figure, design = draw_standing("walker-4", "walker")
    assert design.num_sensors == 4 and "walker-4" in figure.get_suptitle()
