"""A small room with episodes, an evaluation and a run in it, and every command as something to be attacked."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from prnav.cli.episodes import main as episodes
from prnav.cli.eval import main as evaluate
from prnav.cli.train import main as train

sys.path.insert(0, str(Path(__file__).parents[1] / "scene"))
from data_trees import write_room

CONFIG = """\
name = "small"
task = "pointgoal"
total_steps = 256
num_envs = 4
groups = 2
threads = 1
checkpoint_steps = 64
window = 20

[env]
episodes = {episodes!r}
scene_files = [{scene!r}]
design = "forward"
grid = 1
rays_per_receptor = 1

[policy]
width = 8
transformer_layers = 1
transformer_heads = 2
feedforward = 8
position_width = 4
lstm_hidden = 8
lstm_layers = 1

[imitation]
steps = 0

[ppo]
rollout_steps = 8
mini_batches = 2
epochs = 1
"""


class Place:
    """A folder with a room, episodes in it, a config, an evaluation and a run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.scene = write_room(folder / "room.glb")
        out = str(folder / "episodes")
        assert episodes(["generate", "--scene", str(self.scene), "--split", "s", "--per-scene", "8", "--out", out]) == 0
        self.episodes = folder / "episodes" / "s" / "s.json.gz"
        self.config = folder / "small.toml"
        self.config.write_text(CONFIG.format(episodes=str(self.episodes), scene=str(self.scene)))
        self.run = folder / "run"
        assert train(["pointgoal", "--config", str(self.config), "--run", str(self.run)]) == 0
        assert evaluate([*self.eval_words("--run", str(self.run)), "--actions", "greedy", "--submit"]) == 0

    def eval_words(self, *agent: str) -> list[str]:
        """Arguments of a small evaluation, but for where it goes."""
        return [*agent, "--episodes-file", str(self.episodes), "--scene", str(self.scene), "--workers", "1"]

    def commands(self, out: str) -> dict[str, tuple[str, list[str]]]:
        """Every command that writes: module of :mod:`prnav.cli`, arguments with ``out`` as where it goes to."""
        scene = str(self.scene)
        return {
            "train": ("train", ["pointgoal", "--config", str(self.config), "--run", out]),
            "eval": ("eval", [*self.eval_words("--agent", "random"), "--episodes", "2", "--out", out]),
            "eval json": (
                "eval",
                [
                    *self.eval_words("--agent", "random"),
                    *("--episodes", "2", "--out", str(self.folder / "e"), "--json", out),
                ],
            ),
            "generate": ("episodes", ["generate", "--scene", scene, "--split", "s", "--per-scene", "4", "--out", out]),
            "export": ("scenes", ["export", scene, "--out", out + ".glb"]),
            "preview": ("scenes", ["preview", scene, "--out", out + ".png", "--views", "1", "--size", "16"]),
            "navmesh": ("scenes", ["preview", scene, "--out", out + ".png", "--navmesh"]),
            "check": ("scenes", ["check", str(self.folder / "episodes"), "--json", out]),
            "report": ("report", [str(self.run), "--out", out]),
            "show": ("design", ["show", "forward", "--body-only", "--out", out]),
            "random": ("design", ["random", "--out", out]),
        }


@pytest.fixture(scope="session")
def place(tmp_path_factory):
    return Place(tmp_path_factory.mktemp("place"))


@pytest.fixture
def copied(place, tmp_path):
    """The run with its evaluation, to be spoilt."""
    return Path(shutil.copytree(place.run, tmp_path / "run"))
