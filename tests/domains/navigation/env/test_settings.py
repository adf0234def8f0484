"""One flat table of settings, each of which refuses what it cannot be."""

import dataclasses
from dataclasses import replace

import pytest

from prnav.config import from_mapping, load_config, to_mapping, to_toml
from prnav.domains.navigation.env.settings import (
    EpisodeSettings,
    FloorSettings,
    ReadoutSettings,
    RuleSettings,
    SceneSettings,
    SensorSettings,
)
from prnav.domains.navigation.pointgoal import PointGoalConfig, PointGoalEnvConfig
from prnav.domains.navigation.targetnav import TargetNavEnvConfig
from prnav.errors import ConfigError
from prnav.navmesh import NavMeshSettings
from prnav.sim import SimConfig
from prnav.train import load_train_config

FLAT = """
scenes = "val"
max_scenes = 3
episodes_per_scene = 7
episode_seed = 2
navmesh_files = false
max_texture_size = 512
texture_budget = 1000000
scene_files = ["a.glb"]
up = "z"
up_from_episodes = false
design = "fan"
grid = 2
rays_per_receptor = 9
camera_size = 64
engine = "reference"
device = "auto"
vision = false
sensors = ["camera", "gps"]

[rules]
max_steps = 20

[sim]
sliding = false

[navmesh]
agent_radius = 0.2

[readout]
exposure = [0.5, 2.0, 1.0, 1.0]
noise = [0.01]
bits = [8]
acceptance = "gaussian"
seed = 4
"""


def test_all_keys_stand_side_by_side(tmp_path):
    (tmp_path / "env.toml").write_text(FLAT)
    config = load_config(PointGoalEnvConfig, tmp_path / "env.toml")
    expected = PointGoalEnvConfig(
        scenes="val",
        max_scenes=3,
        episodes_per_scene=7,
        episode_seed=2,
        navmesh_files=False,
        max_texture_size=512,
        texture_budget=1000000,
        scene_files=("a.glb",),
        up="z",
        up_from_episodes=False,
        design="fan",
        grid=2,
        rays_per_receptor=9,
        camera_size=64,
        engine="reference",
        device="auto",
        vision=False,
        sensors=("camera", "gps"),
        rules=PointGoalConfig(max_steps=20),
        sim=SimConfig(sliding=False),
        navmesh=NavMeshSettings(agent_radius=0.2),
        readout=ReadoutSettings((0.5, 2.0, 1.0, 1.0), (0.01,), (8,), "gaussian", 4),
    )
    assert config == expected
    (tmp_path / "again.toml").write_text(to_toml(config))
    assert load_config(PointGoalEnvConfig, tmp_path / "again.toml") == config
    assert from_mapping(PointGoalEnvConfig, to_mapping(config), "here") == config


def test_every_field_belongs_to_one_subject():
    subjects = (SceneSettings, EpisodeSettings, SensorSettings, FloorSettings, RuleSettings)
    fields = [field.name for subject in subjects for field in dataclasses.fields(subject)]
    assert len(set(fields)) == len(fields)
    assert set(fields) == {field.name for field in dataclasses.fields(PointGoalEnvConfig)}


def test_settings_of_a_data_set_and_of_files_load():
    data = from_mapping(PointGoalEnvConfig, {"data": "mp3d", "data_root": "there", "scenes": "val_mini"}, "here")
    assert data.scenes == "val_mini"
    assert PointGoalEnvConfig(episodes="mine.json.gz", episode_split="val").episode_split == "val"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"scenes": "tst"}, "scenes is 'tst'; valid: 'train', 'val', 'test'"),
        ({"max_scenes": 0}, "max_scenes is 0; it must be a whole number and at least 1"),
        ({"data": "mp4d", "data_root": "."}, "data is 'mp4d'; valid: "),
        ({"data": "mp3d"}, "data is 'mp3d', and data_root does not say where it is"),
        ({"data_root": " "}, "data_root is ' '; it must be a text that is not empty"),
        ({"scene_files": ["a.glb", ""]}, r"scene_files\[1\] is ''; it must be a text that is not empty"),
        ({"up": "x"}, "up is 'x'; valid: 'y', 'z'"),
        ({"max_texture_size": 0}, "max_texture_size is 0; it must be a whole number and at least 1"),
        ({"texture_budget": -1}, "texture_budget is -1; it must be a whole number and at least 1"),
        ({"episodes_per_scene": 0}, "episodes_per_scene is 0; it must be a whole number and at least 1"),
        ({"episode_seed": -1}, "episode_seed is -1; it must be a whole number and at least 0"),
        ({"episode_split": " "}, "episode_split is ' '; it must be a text that is not empty"),
        ({"grid": 0}, "grid is 0; it must be a whole number and at least 1"),
        ({"rays_per_receptor": 5}, "rays_per_receptor is 5; it must be a square of a whole number: 1, 4, 9"),
        ({"camera_size": -1}, r"camera_size is -1; it must be 0 \(photoreceptors\) or more"),
        ({"engine": "nonsense"}, "engine is 'nonsense'; valid: 'auto', 'embree', 'warp', 'reference', 'egl', 'osmesa'"),
        ({"device": "tpu"}, "device is 'tpu'; valid: 'cpu', 'cuda', 'auto'"),
        ({"device": "cuda", "engine": "embree"}, "engine is 'embree' and device 'cuda'; there it must be 'auto' or"),
        ({"design": "frward"}, "design is 'frward'; valid: .*'forward'.*, or the path of a .toml file"),
        ({"sensors": []}, "sensors is empty; list at least one of 'compass', 'design'"),
        ({"sensors": ["gps", "sonar"]}, r"sensors\[1\] is 'sonar'; valid: 'compass', 'design', 'gps', 'pointgoal'"),
        ({"sensors": ["gps", "gps"]}, "sensors names 'gps' twice"),
        ({"sensors": ["camera"]}, "sensors names 'camera' and camera_size is 0; give the pixels of a side"),
        ({"sensors": ["gps"], "camera_size": 8}, "camera_size is 8 and sensors does not name 'camera'"),
        ({"sensors": "gps"}, r"'sensors' is 'gps'; it must be a list, such as \['gps'\]"),
        ({"readout": {"noise": 0.1}}, r"'readout.noise' is 0.1; it must be a list, such as \[0.1\]"),
        ({"readout": {"noise": [-0.1]}}, "readout: noise is -0.1; it must be a number of at least 0"),
        ({"readout": {"bits": [17]}}, "readout: bits is 17; it must be a whole number of at least 0 and at most 16"),
        (
            {"readout": {"acceptance": "round"}},
            "readout: acceptance is 'round'; valid: 'uniform', 'cosine', 'gaussian'",
        ),
        ({"readout": {"seed": -1}}, "readout: seed is -1; it must be a whole number and at least 0"),
        ({"rules": {"max_steps": 0}}, "rules: max_steps is 0; it must be at least 1"),
        ({"sim": {"forward_step": 0.0}}, "sim: forward_step is 0.0; it must be above 0 m"),
        ({"navmesh": {"cell_size": 0.0}}, "navmesh: cell_size is 0.0; it must be at least"),
        ({"task": {"max_steps": 3}}, r"\[task\] is now called \[rules\]; rename it"),
    ],
)
def test_a_wrong_value_is_named_with_what_is_valid(values, text):
    with pytest.raises(ConfigError, match=f"^config here: .*{text}") as told:
        from_mapping(PointGoalEnvConfig, values, "here")
    assert "\n" not in str(told.value)


def test_a_wrong_value_is_refused_without_a_file_too():
    with pytest.raises(ValueError, match="engine is 'nonsense'; valid: 'auto'"):
        PointGoalEnvConfig(engine="nonsense")
    with pytest.raises(ValueError, match="grid is 4.5; it must be a whole number"):
        replace(PointGoalEnvConfig(), grid=4.5)
    with pytest.raises(ValueError, match="navmesh is None; it must be a NavMeshSettings"):
        PointGoalEnvConfig(navmesh=None)
    with pytest.raises(ValueError, match="rules.slack is nan; it must be finite"):
        PointGoalEnvConfig(rules=PointGoalConfig(slack=float("nan")))


def test_a_task_without_a_goal_to_tell_refuses_its_sensor():
    with pytest.raises(ValueError, match="sensors names 'pointgoal', and targetnav does not tell where its goal is"):
        TargetNavEnvConfig(sensors=("photoreceptors", "pointgoal"))


@pytest.mark.parametrize("table", ["task", "targetnav"])
def test_tables_of_earlier_runs_are_told_their_new_name(table):
    with pytest.raises(ConfigError, match=rf"\[env.{table}\] is now called \[env.rules\]; rename it"):
        load_train_config("quickstart-targetnav", (f"env.{table}.max_steps=9",))
