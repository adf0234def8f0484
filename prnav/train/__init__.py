"""Training: PPO as pure functions, rollouts, checkpoints, and the loop."""

from prnav.train.config import TrainConfig, group_sizes, load_train_config, without_readings
from prnav.train.distributed import Workers, join_workers
from prnav.train.imitation import ImitationConfig
from prnav.train.ppo import PPOConfig
from prnav.train.rows import Counters, MetricsRow
from prnav.train.run_folder import RunFolder, read_metrics
from prnav.train.trainer import Trainer, load_policy

__all__ = [
    "Counters",
    "ImitationConfig",
    "MetricsRow",
    "PPOConfig",
    "RunFolder",
    "TrainConfig",
    "Trainer",
    "Workers",
    "group_sizes",
    "join_workers",
    "load_policy",
    "load_train_config",
    "read_metrics",
    "without_readings",
]
