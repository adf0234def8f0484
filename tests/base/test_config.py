from dataclasses import dataclass, field
from typing import Literal

import pytest

from prnav.config import config_hash, from_mapping, load_config, to_mapping, to_toml
from prnav.errors import ConfigError


@dataclass(frozen=True)
class Ppo:
    learning_rate: float = 2.5e-4
    epochs: int = 4

    def __post_init__(self):
        if self.learning_rate <= 0:
            raise ValueError(f"learning_rate is {self.learning_rate}; it must be positive")


@dataclass(frozen=True)
class Experiment:
    name: str = "a"
    encoder: Literal["compact", "blind"] = "compact"
    scenes: tuple[str, ...] = ("train",)
    limit: int | None = None
    fast: bool = False
    ppo: Ppo = field(default_factory=Ppo)


@pytest.fixture
def toml(tmp_path):
    def write(text):
        path = tmp_path / "experiment.toml"
        path.write_text(text)
        return path

    return write


def test_round_trip(toml):
    config = Experiment("b", "blind", ("x", "y"), 3, True, Ppo(1e-5))
    assert load_config(Experiment, toml(to_toml(config))) == config
    assert from_mapping(Experiment, to_mapping(config), "here") == config
    assert config_hash(config) != config_hash(Experiment())


def test_overrides_are_toml_or_bare_strings(toml):
    config = load_config(
        Experiment, toml(""), ["ppo.learning_rate=1e-3", "encoder=blind", "scenes=['a','b']", "limit=2"]
    )
    assert config == Experiment(encoder="blind", scenes=("a", "b"), limit=2, ppo=Ppo(1e-3))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[ppo]\nlerning_rate = 1.0", r"unknown key 'ppo.lerning_rate'; did you mean ppo.learning_rate\?"),
        ("zzz = 1", "unknown key 'zzz'; valid here: name, encoder"),
        ("encoder = 'resnet'", "'encoder' is 'resnet'; valid: 'compact', 'blind'"),
        ("limit = 'x'", "'limit' is 'x'; it must be of type int"),
        ("fast = 1", "'fast' is 1; it must be of type bool"),
        ("scenes = 'train'", "'scenes' is 'train'; it must be a list"),
        ("ppo = 3", r"'ppo' is 3; it must be a table \[ppo\]"),
        ("[ppo]\nlearning_rate = -1", "ppo: learning_rate is -1.0; it must be positive"),
        ("[ppo]\nlearning_rate = nan", "must be finite"),
        ("[ppo]\nepochs = true", "must be of type int"),
        ("a = ", "not valid TOML"),
    ],
)
def test_errors_name_the_file_the_key_and_what_is_valid(toml, text, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load_config(Experiment, toml(text))
    assert "experiment.toml" in str(caught.value)


def test_a_missing_file_and_a_malformed_override_say_so(toml, tmp_path):
    with pytest.raises(ConfigError, match="none.toml: cannot be read"):
        load_config(Experiment, tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="not of the form key=value"):
        load_config(Experiment, toml(""), ["learning_rate"])
