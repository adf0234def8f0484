"""Physics, states and rewards against recordings of the DeepMind Control Suite, and against themselves.

Bars for rollouts leave room for chaos: the recordings were made with MuJoCo 3.17, whose bits differ from 4.0's.
"""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import prnav
from prnav.domains.control.facts import EPISODE_STEPS, TASKS
from prnav.errors import ControlError, RenderError

TOUCH = {"finger-spin": slice(7, 9), "finger-turn-easy": slice(7, 9)}
"""Where an observation holds forces, which a state alone does not determine."""


def flat(array):
    """Seeds and kinds of action on one axis."""
    return array.reshape(-1, *array.shape[2:])


def played(task, rollouts, steps=None):
    actions = flat(rollouts["action"])[:, :steps]
    return task.rollout(flat(rollouts["qpos"])[:, 0], flat(rollouts["qvel"])[:, 0], flat(rollouts["target"]), actions)


def test_rollouts_follow_the_recorded_ones(task, rollouts):
    steps, bar = (100, 1e-6) if task.facts.body == "walker" else (250, 1e-9)
    got = played(task, rollouts, steps)
    np.testing.assert_allclose(got.qpos, flat(rollouts["qpos"])[:, 1 : steps + 1], rtol=0, atol=bar)
    np.testing.assert_allclose(got.reward, flat(rollouts["reward"])[:, :steps], rtol=0, atol=1e-9)
    if task.facts.body != "walker":
        np.testing.assert_allclose(got.qvel, flat(rollouts["qvel"])[:, 1:], rtol=0, atol=bar)
        np.testing.assert_allclose(got.obs, flat(rollouts["obs"])[:, 1:], rtol=0, atol=bar)


def test_rollouts_are_those_of_mujoco_4_to_the_bit(task, rollouts):
    import mujoco

    if not mujoco.__version__.startswith("4.0."):
        pytest.skip(f"the recording was made with MuJoCo 4.0.0, and this is {mujoco.__version__}")
    got = played(task, rollouts)
    np.testing.assert_allclose(got.qpos, flat(rollouts["qpos_400"])[:, 1:], rtol=0, atol=1e-12)
    np.testing.assert_allclose(got.qvel, flat(rollouts["qvel_400"])[:, 1:], rtol=0, atol=1e-12)


def test_single_steps_lead_where_the_recorded_ones_do(task, rollouts):
    qpos, qvel = flat(rollouts["qpos"]), flat(rollouts["qvel"])
    steps = qpos.shape[1] - 1
    rows = (-1, qpos.shape[2]), (-1, qvel.shape[2])
    target = np.repeat(flat(rollouts["target"]), steps, axis=0)
    actions = flat(flat(rollouts["action"]))[:, None]
    got = task.rollout(qpos[:, :-1].reshape(rows[0]), qvel[:, :-1].reshape(rows[1]), target, actions)
    np.testing.assert_allclose(got.qpos[:, 0], qpos[:, 1:].reshape(rows[0]), rtol=0, atol=1e-7)
    np.testing.assert_allclose(got.qvel[:, 0], qvel[:, 1:].reshape(rows[1]), rtol=0, atol=5e-6)


def test_states_and_rewards_of_probe_states_are_the_recorded_ones(task, rollouts):
    state = rollouts["probe_qpos"], rollouts["probe_qvel"], rollouts["probe_target"]
    np.testing.assert_allclose(task.observe(*state), rollouts["probe_obs"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(task.reward(*state), rollouts["probe_reward"], rtol=0, atol=1e-9)
    assert np.ptp(rollouts["probe_reward"]) > 0.1


def test_states_and_rewards_along_whole_recordings_are_the_recorded_ones(task, rollouts):
    qpos, qvel, obs = flat(rollouts["qpos"]), flat(rollouts["qvel"]), flat(rollouts["obs"])
    target = np.repeat(flat(rollouts["target"])[:, None], qpos.shape[1], axis=1)
    state = flat(qpos), flat(qvel), flat(target)
    reward = task.reward(*state).reshape(qpos.shape[:2])
    np.testing.assert_allclose(reward[:, 1:], flat(rollouts["reward"]), rtol=0, atol=1e-9)
    got = task.observe(*state).reshape(obs.shape)
    np.testing.assert_allclose(got[:, 0], obs[:, 0], rtol=0, atol=1e-9)
    got, obs = got.copy(), obs.copy()
    got[..., TOUCH.get(task.name, [])] = obs[..., TOUCH.get(task.name, [])] = 0.0
    np.testing.assert_allclose(got, obs, rtol=0, atol=1e-9)


def test_whole_episodes_return_what_was_recorded(task, rollouts):
    if task.facts.body == "walker":
        pytest.skip("a walker's rollout is chaotic after some 150 steps")
    got = task.rollout(
        flat(rollouts["long_qpos0"]),
        flat(rollouts["long_qvel0"]),
        flat(rollouts["long_target"]),
        flat(rollouts["long_action"]),
    )
    assert got.reward.shape[1] == EPISODE_STEPS
    np.testing.assert_allclose(got.reward.sum(axis=1), rollouts["long_return"].ravel(), rtol=0, atol=1e-6)


def test_episodes_start_where_the_suite_starts_them(task, rollouts):
    starts = task.starts(rollouts["seed"])
    np.testing.assert_allclose(starts.qpos, rollouts["qpos"][:, 0, 0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(starts.target, rollouts["target"][:, 0], rtol=0, atol=1e-12)


def test_starts_depend_on_their_seed_alone_and_are_within_limits(task):
    seeds = np.arange(100)
    starts = task.starts(seeds)
    order = np.random.default_rng(0).permutation(100)[:37]
    some = task.starts(seeds[order])
    np.testing.assert_array_equal(some.qpos, starts.qpos[order])
    np.testing.assert_array_equal(some.target, starts.target[order])
    limited = task.model.jnt_limited.astype(bool)
    low, high = task.model.jnt_range[limited].T
    assert (starts.qpos[:, limited] >= low).all() and (starts.qpos[:, limited] <= high).all()
    assert np.ptp(starts.qpos, axis=0)[task.model.jnt_type == 3].min() > 1.0
    if task.name == "reacher-hard":
        radius = np.linalg.norm(starts.target[:, :2], axis=1)
        assert radius.min() >= 0.05 and radius.max() <= 0.2


def test_the_finger_starts_free_of_contact():
    mujoco = pytest.importorskip("mujoco")
    task = prnav.ControlTask("finger-spin")
    data = mujoco.MjData(task.model)
    for qpos in task.starts(np.arange(50)).qpos:
        data.qpos[:] = qpos
        mujoco.mj_forward(task.model, data)
        assert data.ncon == 0


def test_bits_do_not_depend_on_threads_batch_or_order(task):
    random = np.random.default_rng(1)
    count, steps = 70, 12  # more than one batch that keeps its simulations' data
    starts = task.starts(np.arange(count))
    qvel = random.normal(size=(count, task.model.nv))
    actions = random.uniform(-1, 1, (count, steps, task.model.nu))
    whole = task.rollout(starts.qpos, qvel, starts.target, actions)
    assert np.isfinite(whole.qpos).all()
    threaded = prnav.ControlTask(task.name, threads=3)
    order = random.permutation(count)
    for other, rows in ((threaded, np.arange(count)), (task, order), (threaded, order[:5]), (task, order[:1])):
        part = other.rollout(starts.qpos[rows], qvel[rows], starts.target[rows], actions[rows])
        for got, want in zip(part, whole, strict=True):
            np.testing.assert_array_equal(got, want[rows])


def test_a_simulation_is_mujocos_own_step_by_step(task):
    mujoco = pytest.importorskip("mujoco")
    steps = 20
    actions = np.random.default_rng(2).uniform(-1, 1, (1, steps, task.model.nu))
    start = task.starts([3])
    got = task.rollout(start.qpos, np.zeros((1, task.model.nv)), start.target, actions)
    data = mujoco.MjData(task.model)
    data.qpos[:] = start.qpos[0]
    mujoco.mj_forward(task.model, data)
    for step in range(steps):
        data.ctrl[:] = actions[0, step]
        mujoco.mj_step2(task.model, data)
        for _ in range(task.facts.physics_steps - 1):
            mujoco.mj_step(task.model, data)
        mujoco.mj_step1(task.model, data)
        np.testing.assert_allclose(got.qpos[0, step], data.qpos, rtol=0, atol=1e-12)


def test_a_diverging_simulation_does_not_touch_the_others(task, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    starts = task.starts(np.arange(4))
    qvel = np.zeros((4, task.model.nv))
    actions = np.random.default_rng(3).uniform(-1, 1, (4, 5, task.model.nu))
    good = task.rollout(starts.qpos, qvel, starts.target, actions)
    qvel[2] = 9e9
    got = task.rollout(starts.qpos, qvel, starts.target, actions)
    for value, want in zip(got, good, strict=True):
        assert np.isnan(value[2]).all()
        np.testing.assert_array_equal(value[[0, 1, 3]], want[[0, 1, 3]])
    assert not list(tmp_path.iterdir()) and capfd.readouterr() == ("", "")


def test_actions_beyond_their_bounds_count_as_the_bounds(task):
    start, qvel = task.starts([5]), np.zeros((1, task.model.nv))
    ones = np.ones((1, 4, task.model.nu))
    np.testing.assert_array_equal(
        task.rollout(start.qpos, qvel, start.target, 7.0 * ones).qpos,
        task.rollout(start.qpos, qvel, start.target, ones).qpos,
    )


def test_bad_input_is_one_clear_line(task):
    facts, model = task.facts, task.model
    starts = task.starts([0, 1])
    qvel, actions = np.zeros((2, model.nv)), np.zeros((2, 3, model.nu))
    with pytest.raises(ControlError, match=rf"{task.name}: qpos has shape .*; it must be \(2, {model.nq}\)"):
        task.observe(starts.qpos[:, 1:], qvel, starts.target)
    with pytest.raises(ControlError, match="qvel holds numbers that are not finite"):
        task.reward(starts.qpos, qvel * np.nan, starts.target)
    with pytest.raises(ControlError, match=r"qvel holds 1e\+12; physics needs numbers within 1e\+10 of 0"):
        task.reward(starts.qpos, qvel + 1e12, starts.target)
    with pytest.raises(ControlError, match=r"target has shape \(2, 2\); it must be \(2, 3\)"):
        task.reward(starts.qpos, qvel, starts.target[:, :2])
    with pytest.raises(ControlError, match=rf"actions have shape .*; it must be \(B, T, {model.nu}\)"):
        task.rollout(starts.qpos, qvel, starts.target, actions[..., 1:])
    with pytest.raises(ControlError, match="actions hold numbers that are not finite"):
        task.rollout(starts.qpos, qvel, starts.target, actions + np.inf)
    with pytest.raises(ControlError, match="1 rows of actions for 2 states"):
        task.rollout(starts.qpos, qvel, starts.target, actions[:1])
    with pytest.raises(ControlError, match="there are no states"):
        task.observe(starts.qpos[:0], qvel[:0], starts.target[:0])
    assert facts.observation_size == task.observe(starts.qpos, qvel, starts.target).shape[1]


def test_readings_of_sensors_are_as_good_as_the_recorded_ones(task, golden):
    with np.load(golden / "dmc" / task.name.replace("-", "_") / "readings.npz") as file:
        recorded = {name: file[name] for name in file.files}
    usual = np.flatnonzero(~np.isin(recorded["row_label"].astype(str), ["inside", "below"]))[::5]
    states = recorded["row_state"][usual]
    seen = task.read(
        recorded["qpos"][states],
        recorded["target"][states],
        [str(body) for body in recorded["sensor_body"][usual]],
        recorded["sensor_pos"][usual],
        recorded["sensor_quat"][usual],
        np.radians(recorded["sensor_fovy"][usual]),
        grid=4,
        rays_per_receptor=64,
    )
    error = np.abs(seen - recorded["reading_4x4"][usual])
    assert seen.dtype == np.float32 and error.mean() <= 1 / 255 and np.quantile(error, 0.99) <= 8 / 255


def test_readings_refuse_unknown_bodies_and_wrong_shapes(task):
    start = task.starts([0])
    body = task.model.body(1).name
    sensor = {"positions": [[0, 0, 0.1]], "quaternions": [[1, 0, 0, 0]], "fovs": [1.0]}
    with pytest.raises(ControlError, match=rf"{task.name} has no body 'head'; valid: world, {body}"):
        task.read(start.qpos, start.target, ["head"], **sensor)
    with pytest.raises(ControlError, match="2 names of bodies for 1 states"):
        task.read(start.qpos, start.target, [body, body], **sensor)
    with pytest.raises(ControlError, match=r"quaternions has shape \(1, 3\); it must be \(1, 4\)"):
        task.read(start.qpos, start.target, [body], **{**sensor, "quaternions": [[0, 0, 0]]})
    with pytest.raises(RenderError, match="field of view"):
        task.read(start.qpos, start.target, [body], **{**sensor, "fovs": [4.0]})


def test_an_unknown_task_names_the_valid_ones():
    with pytest.raises(ControlError, match="control task 'walker-fly' is unknown; valid: reacher-hard, walker-stand"):
        prnav.ControlTask("walker-fly")


def in_a_fresh_process(script: str) -> str:
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_prnav_leaves_mujoco_out():
    script = "import sys, prnav; prnav.ControlTask; print('mujoco' in sys.modules, 'numba' in sys.modules)"
    assert in_a_fresh_process(script).split() == ["False", "False"]


def test_a_missing_mujoco_is_one_line_that_names_the_extra():
    script = """
import sys
sys.modules["mujoco"] = None
import prnav
try:
    prnav.ControlTask("walker-walk")
except prnav.PrnavError as error:
    print(error)
"""
    (line,) = in_a_fresh_process(script).splitlines()
    assert "needs MuJoCo" in line and "prnav[control]" in line


def test_a_mujoco_that_is_too_old_is_one_line():
    script = """
import sys, types
old = types.ModuleType("mujoco")
old.__version__ = "3.3.7"
sys.modules["mujoco"] = old
import prnav
try:
    prnav.ControlTask("walker-walk")
except prnav.PrnavError as error:
    print(error)
"""
    (line,) = in_a_fresh_process(script).splitlines()
    assert "MuJoCo 3.3.7 is too old" in line and "4.0 or newer" in line and "prnav[control]" in line


def test_facts_are_the_papers():
    repeats = {name: facts.action_repeat for name, facts in TASKS.items()}
    assert repeats.pop("finger-turn-easy") == 4 and set(repeats.values()) == {2}
    millions = [facts.paper_steps // 1_000_000 for facts in TASKS.values()]
    assert millions == [100, 200, 200, 200, 200, 300]
