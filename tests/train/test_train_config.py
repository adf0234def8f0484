"""The shipped experiments and what the command line makes of them."""

from dataclasses import replace

import pytest

from prnav.cli.train import configure, main, parser, summary
from prnav.config import load_config, to_toml
from prnav.errors import ConfigError
from prnav.train import TrainConfig, load_train_config, without_readings
from prnav.train.config import config_names


def configured(*arguments: str) -> TrainConfig:
    return configure(parser().parse_intermixed_args(["pointgoal", *arguments]))


@pytest.mark.parametrize(
    "name", ["quickstart", "quickstart-camera", "quickstart-blind", "paper-pointgoal", "quickstart-targetnav"]
)
def test_shipped_experiments_load_and_come_back_from_toml(name, tmp_path):
    assert name in config_names()
    config = load_train_config(name)
    assert config.name == name
    (tmp_path / "config.toml").write_text(to_toml(config))
    assert load_config(TrainConfig, tmp_path / "config.toml") == config


def test_the_paper_is_the_papers():
    config = load_train_config("paper-pointgoal")
    assert (config.total_steps, config.num_envs, config.ppo.rollout_steps, config.ppo.epochs) == (
        230_000_000,
        30,
        64,
        4,
    )
    assert (config.ppo.learning_rate, config.ppo.mini_batches, config.imitation.steps) == (2.5e-4, 1, 0)
    assert (config.policy.encoder, config.policy.transformer_layers, config.policy.lstm_layers) == ("transformer", 3, 2)


def test_the_blind_preset_is_the_quick_start_without_light():
    assert load_train_config("quickstart-blind") == without_readings(load_train_config("quickstart"))
    assert configured("--blind") == load_train_config("quickstart-blind")


def test_options_and_settings_change_the_config():
    config = configured(
        "--steps", "5", "--seed", "7", "ppo.clip=0.1", "--scene", "a b.glb", "--scene", "c.obj", "--up", "z"
    )
    assert (config.total_steps, config.seed, config.ppo.clip) == (5, 7, 0.1)
    assert (config.env.scene_files, config.env.up) == (("a b.glb", "c.obj"), "z")
    config = configured("--episodes-file", "e.json.gz", "--data-root", "d", "--split", "val")
    assert (config.env.episodes, config.env.data_root, config.env.episode_split) == ("e.json.gz", "d", "val")


def test_warm_start_on_and_off():
    assert configured("--warmstart", "none").imitation.steps == 0
    assert (
        configured("--config", "paper-pointgoal", "--warmstart", "imitation", "--steps", "1000").imitation.steps == 200
    )
    quick = load_train_config("quickstart")
    assert configured("--warmstart", "imitation").imitation == quick.imitation


def test_a_warm_start_keeps_its_share_of_a_shorter_run(tmp_path):
    quick = load_train_config("quickstart")
    half = configured("--steps", str(quick.total_steps // 2))
    assert half.imitation == replace(quick.imitation, steps=quick.imitation.steps // 2)
    assert configured("--steps", "1000", "imitation.steps=900").imitation.steps == 900
    (tmp_path / "config.toml").write_text(to_toml(half))
    longer = configured("--run", str(tmp_path), "--resume", "--steps", "9000000")
    assert (longer.total_steps, longer.imitation) == (9_000_000, half.imitation)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ppo.clipp=1"], "unknown key 'ppo.clipp'; did you mean ppo.clip"),
        (["ppo.clip=yes"], "'ppo.clip' is 'yes'; it must be of type float"),
        (["--config", "quikstart"], "config 'quikstart' is not known; valid: .*quickstart"),
        (["--config", "no/such.toml"], "no/such.toml: cannot be read"),
        (["num_envs=2"], "mini_batches is [0-9]+; it must be at most num_envs .2., since"),
        (["--scene", "it's.glb"], "holds a quote or a control character; rename it"),
        (["policy.width=0"], "width is 0; it must be at least 1"),
    ],
)
def test_what_is_wrong_is_one_line_with_its_remedy(arguments, message, capsys):
    with pytest.raises(ConfigError, match=message):
        configured(*arguments)
    assert main(["pointgoal", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("prnav: error: config") or "holds a quote" in error
    assert error.count("\n") == 1


def test_an_old_run_is_not_overwritten(tmp_path, capsys):
    (tmp_path / "config.toml").write_text(to_toml(load_train_config("quickstart")))
    (tmp_path / "metrics.jsonl").write_text('{"step": 4096}\n')
    assert main(["pointgoal", "--run", str(tmp_path)]) == 2
    assert "exists already; resume it with --resume" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["config.toml", "metrics.jsonl"]
    assert main(["pointgoal", "--run", str(tmp_path), "--resume", "--seed", "9"]) == 2
    assert "seed is 0 in its config.toml and 9 now" in capsys.readouterr().err


def test_a_resumed_run_takes_its_own_config(tmp_path):
    own = replace(load_train_config("quickstart"), seed=5, name="mine")
    (tmp_path / "config.toml").write_text(to_toml(own))
    assert configured("--run", str(tmp_path), "--resume", "--steps", "9") == replace(own, total_steps=9)


def test_the_progress_line_names_what_matters():
    row = {"phase": "ppo", "measures": {"reward": 1.5, "success": 0.5, "spl": 0.25}, "losses": {"entropy": 0.75}}
    text = summary({**row, "times": {"steps_per_second": 2500.4}})
    assert text == "ppo         2,500 steps/s  reward 1.50  success 0.50  spl 0.25  entropy 0.75"


def test_python_m_prnav_train_is_the_command():
    import subprocess
    import sys

    done = subprocess.run([sys.executable, "-m", "prnav.train", "--help"], capture_output=True, text=True)
    assert done.returncode == 0 and "usage: prnav-train" in done.stdout


def test_each_task_has_its_own_preset(capsys):
    config = configure(parser().parse_intermixed_args(["targetnav"]))
    assert config == load_train_config("quickstart-targetnav")
    assert (config.task, config.env.kind.name) == ("targetnav", "targetnav")
    assert main(["targetnav", "--config", "quickstart"]) == 2
    assert (
        "config quickstart is for pointgoal; use prnav-train pointgoal, or another --config" in capsys.readouterr().err
    )
    assert load_train_config("quickstart", ("task=targetnav",)).env.rules.visible
    with pytest.raises(ConfigError, match=r"task is 'golf'; valid: 'pointgoal', 'targetnav'"):
        load_train_config("quickstart", ("task=golf",))
    with pytest.raises(ValueError, match=r"task is 'targetnav' and env is a PointGoalEnvConfig; it must be"):
        replace(load_train_config("quickstart"), task="targetnav")
