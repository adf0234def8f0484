"""Episodes: read from and written to Habitat's PointNav files, drawn anew in a scene, and kept as columns."""

from prnav.episodes.builtin import (
    BUILTIN_NAME,
    builtin_path,
    check_scenes,
    load_builtin_episodes,
    load_builtin_table,
    load_train_table,
    make_builtin_episodes,
    make_header,
    train_table,
    up_axis,
)
from prnav.episodes.episode import Episode, EpisodeDataset, Goal
from prnav.episodes.files import load_episodes, save_episodes
from prnav.episodes.generate import GenerationConfig, generate_episodes, generate_table
from prnav.episodes.table import EpisodeTable, concatenate_tables, difficulty, load_episode_table

__all__ = [
    "BUILTIN_NAME",
    "builtin_path",
    "Episode",
    "EpisodeDataset",
    "EpisodeTable",
    "GenerationConfig",
    "Goal",
    "check_scenes",
    "concatenate_tables",
    "difficulty",
    "generate_episodes",
    "generate_table",
    "load_builtin_episodes",
    "load_builtin_table",
    "load_episode_table",
    "load_episodes",
    "make_builtin_episodes",
    "make_header",
    "save_episodes",
    "load_train_table",
    "train_table",
    "up_axis",
]
