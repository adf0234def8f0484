"""Every field of the compiled bodies against recordings of the DeepMind Control Suite's models."""

from __future__ import annotations

import hashlib
import json

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

from prnav.domains.control import models  # noqa: E402

BUILD = {
    "reacher_hard": lambda: models.reacher_hard(inner_ball=False),
    "walker_stand": models.walker,
    "walker_walk": models.walker,
    "walker_run": models.walker,
    "finger_spin": models.finger_spin,
    "finger_turn_easy": models.finger_turn_easy,
}
ONLY_IN_317 = {"flexvert_J_colind", "flexvert_J_rowadr", "flexvert_J_rownnz", "nJfv"}
"""Fields that MuJoCo 4.0 no longer has; the models hold no flexes."""
GREW_IN_400 = {"nbuffer"}
"""Bytes of the compiled model, more with the fields that are new in MuJoCo 4.0."""
PREFIX = {"joint": "jnt", "camera": "cam", "material": "mat", "texture": "tex"}
"""How MuJoCo abbreviates kinds of elements in names of fields."""
TASKS = sorted(BUILD)


@pytest.fixture(params=TASKS, scope="module")
def pair(request, golden):
    with open(golden / "dmc" / request.param / "model.json") as file:
        return BUILD[request.param](), json.load(file)


def assert_close(name, got, want):
    got, want = np.asarray(got, np.float64), np.asarray(want, np.float64)
    assert got.shape == want.shape or got.size == want.size == 0, name
    np.testing.assert_allclose(got.ravel(), want.ravel(), rtol=0, atol=1e-12, err_msg=name)


def test_every_array_is_the_recorded_one(pair):
    model, recorded = pair
    assert len(recorded["arrays"]) > 200
    for name, values in recorded["arrays"].items():
        if name not in ONLY_IN_317:
            assert_close(name, getattr(model, name), values)


def test_sizes_are_the_recorded_ones(pair):
    model, recorded = pair
    for name, value in recorded["sizes"].items():
        if name not in ONLY_IN_317 | GREW_IN_400:
            assert getattr(model, name) == value, name


def test_options_statistics_and_visuals_are_the_recorded_ones(pair):
    model, recorded = pair
    for name, value in recorded["option"].items():
        assert_close(name, getattr(model.opt, name), value)
    for name, value in recorded["statistic"].items():
        assert_close(name, getattr(model.stat, name), value)
    for group, fields in recorded["visual"].items():
        for name, value in fields.items():
            if np.size(value):
                assert_close(f"{group}.{name}", getattr(getattr(model.vis, group), name), value)


def test_names_stand_in_the_recorded_order(pair):
    model, recorded = pair
    for kind, names in recorded["names"].items():
        prefix = PREFIX.get(kind, kind)
        count = getattr(model, f"n{prefix}")
        found = [getattr(model, "tex" if kind == "texture" else kind)(index).name for index in range(count)]
        assert found == names, kind


def test_textures_have_the_recorded_bytes(pair):
    model, recorded = pair
    for name, facts in recorded["texture_data"].items():
        start = int(model.tex(name).adr[0])
        data = model.tex_data[start : start + facts["width"] * facts["height"] * facts["nchannel"]]
        assert hashlib.sha256(data.tobytes()).hexdigest() == facts["sha256"], name


def test_the_inner_ball_adds_one_geom_and_changes_nothing_else():
    plain, model = models.reacher_hard(inner_ball=False), models.reacher_hard()
    inner = model.geom("target_inner")
    assert model.ngeom == plain.ngeom + 1
    assert inner.id == model.geom("target").id + 1 == 7  # drawn last among the world's geoms
    assert inner.type[0] == mujoco.mjtGeom.mjGEOM_SPHERE and inner.matid[0] == -1
    np.testing.assert_array_equal(inner.rgba, [0, 1, 0, 1])
    np.testing.assert_array_equal(inner.pos, model.geom("target").pos)
    assert inner.size[0] == model.geom("target").size[0] / 2
    others = [index for index in range(model.ngeom) if index != inner.id]
    for name in ("geom_type", "geom_pos", "geom_quat", "geom_size", "geom_matid", "geom_rgba", "geom_rbound"):
        np.testing.assert_array_equal(getattr(model, name)[others], getattr(plain, name), err_msg=name)
    for name in ("body_mass", "body_inertia", "dof_invweight0", "dof_damping", "actuator_gear", "cam_pos", "light_pos"):
        np.testing.assert_array_equal(getattr(model, name), getattr(plain, name), err_msg=name)
    assert model.stat.extent == plain.stat.extent  # clip planes stay where they are
