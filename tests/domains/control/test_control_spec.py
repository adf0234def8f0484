"""Control tasks as the catalog, evaluation and reports see them."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

import prnav  # noqa: E402
from prnav import catalog  # noqa: E402
from prnav.contracts import EpisodeRequest, Evaluation, Played  # noqa: E402
from prnav.contracts.measures import BY_KEY  # noqa: E402
from prnav.domains.control.evaluation import episodes_hash  # noqa: E402
from prnav.domains.control.facts import TASKS  # noqa: E402
from prnav.domains.control.mounts import load_mounts  # noqa: E402
from prnav.errors import ConfigError  # noqa: E402
from prnav.play import TraceRecorder, play  # noqa: E402
from prnav.train.config import load_train_config  # noqa: E402

NAMES = [f"control/{name}" for name in TASKS]


def played(name, agent, num_slots, episodes=3, **settings):
    spec = catalog.task_spec(name)
    config = spec.config_type(senses="state", action_repeat=100, split="val", **settings)
    world = spec.load(config, limit=episodes)
    slots = spec.make_slots(config, world, num_slots)
    done: list[Played] = []
    play(spec.evaluation.agent(agent, config, slots), slots, range(len(world)), 0, [TraceRecorder(done.append)])
    return spec, config, world, slots, sorted(done, key=lambda episode: episode.index)


@pytest.mark.parametrize("name", NAMES)
def test_the_catalog_knows_the_task(name):
    spec = catalog.task_spec(name)
    assert spec.name == name and spec.score in spec.measures
    assert set(spec.measures) <= set(BY_KEY)
    config = spec.config_type()
    assert spec.blind(config).senses == "nothing" and spec.held_out(config, "test").split == "test"
    assert spec.validation(config).split == "val"
    assert (spec.with_design(config, "some", 4).design, spec.with_design(config, "some", 4).grid) == ("some", 4)
    assert TASKS[config.task].env_name in catalog.GYMNASIUM


@pytest.mark.parametrize("name", NAMES)
def test_presets_are_of_their_task_and_budget(name):
    spec = catalog.task_spec(name)
    preset = load_train_config(spec.preset)
    assert preset.task == name and isinstance(preset.env, spec.config_type)
    assert preset.total_steps * preset.env.repeat == 20_000_000
    assert (preset.policy.memory, preset.policy.frames) == ("stack", 3)
    assert load_mounts(preset.env.design, prnav.ControlTask(preset.env.task).model).num_sensors == 4


@pytest.mark.parametrize("name", NAMES)
def test_records_are_recomputed_from_their_traces_whatever_the_number_of_slots(name):
    spec, config, world, slots, done = played(name, "random", 1)
    header = spec.evaluation.header(config, world, slots)
    assert header["episodes_hash"] == episodes_hash(world) and header["task"] == name
    for episode in done:
        again = spec.evaluation.recompute(episode.row, episode.trace, header)
        assert again.keys() == set(spec.measures)
        for measure, value in again.items():
            assert episode.row[measure] == pytest.approx(value, abs=1e-9)
        assert episode.row["steps"] == 1000 and len(episode.trace) == 10
        assert episode.trace["qpos"].shape[0] == 11
    *_, others = played(name, "random", 3)
    assert [episode.row for episode in others] == [episode.row for episode in done]
    assert len({episode.row["episode_id"] for episode in done}) == 3


def test_a_still_agent_does_nothing_and_an_unknown_one_is_refused():
    spec, config, world, slots, done = played("control/reacher-hard", "still", 2)
    for episode in done:
        assert not episode.trace["actions"].any() and np.ptp(episode.trace["qpos"], axis=0).max() < 1e-12
    with pytest.raises(ConfigError, match="agent 'clever' is not known; valid: random, still"):
        spec.evaluation.agent("clever", config, slots)


def test_a_request_for_scenes_or_an_unknown_split_is_one_line():
    evaluation = catalog.task_spec("control/walker-walk").evaluation
    assert evaluation.config(None, EpisodeRequest()).split == "test"
    with pytest.raises(ConfigError, match=r"--episodes-file: walker-walk has no scenes or episode files"):
        evaluation.config(None, EpisodeRequest(episodes_file="some.json"))
    with pytest.raises(ConfigError, match=r"--split dev: walker-walk has no such split; valid: train, val, test"):
        evaluation.config(None, EpisodeRequest(split="dev"))


def test_returns_are_drawn(tmp_path):
    spec, config, world, slots, done = played("control/walker-stand", "random", 3)
    header = {**spec.evaluation.header(config, world, slots), "agent": "random", "actions": "sampled"}
    evaluation = Evaluation(tmp_path, header, [episode.row for episode in done])
    traces = [episode.trace for episode in done]
    (figure, caption), *others = spec.pictures.figures(evaluation, traces)
    axes = figure.axes[0]
    assert not others and "Return" in caption
    ends = sorted(line.get_ydata()[-1] for line in axes.lines)
    assert ends[-1] == pytest.approx(max(episode.row["return"] for episode in done))
    assert spec.pictures.pairs((evaluation, evaluation), (traces, traces), ("a", "b")) is not None
    picture = spec.pictures.trace(world, 0, traces[0])
    assert picture.ndim == 3 and picture.shape[2] == 3 and picture.std() > 0
