"""``prnav-train``: train an agent, watch it, stop and resume."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from prnav.catalog import TASKS, task_spec
from prnav.cli._common import (
    Parser,
    Screen,
    add_data_options,
    check_data_options,
    command,
    natural,
    whole_number,
)
from prnav.cli._watch import load_validation, with_wandb
from prnav.errors import ConfigError

if TYPE_CHECKING:
    from prnav.contracts import BatchEnv, World
    from prnav.train import MetricsRow, RunFolder, TrainConfig

LINE_SECONDS = 15.0
"""How often a line is printed where there is no terminal to redraw."""

Show = Callable[["MetricsRow"], None]


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = Parser(
        prog="prnav-train",
        description="Train a navigation agent; evaluate it with prnav-eval --run DIR.",
        epilog="Ctrl-C, SIGTERM and SIGUSR1 save a checkpoint and end; --resume continues from it, bit for bit.",
    )
    p.add_argument("task", choices=tuple(TASKS), help="what the agent learns")
    p.add_argument("settings", nargs="*", metavar="key=value", help="any config key: ppo.learning_rate=1e-4")
    p.add_argument(
        "--config", metavar="NAME|FILE", help="a shipped experiment or a TOML file (default: the task's quickstart)"
    )
    p.add_argument(
        "--steps",
        type=whole_number(1, 10**15),
        metavar="N",
        help="simulation steps in all; a warm start keeps its share of them",
    )
    p.add_argument("--seed", type=natural, metavar="S", help="seed of weights, actions and episode order")
    p.add_argument("--warmstart", choices=("imitation", "none"), help="whether to imitate the oracle first")
    p.add_argument("--blind", action="store_true", help="train an agent without photoreceptors")
    p.add_argument("--wandb", metavar="PROJECT", help="also send metrics to Weights & Biases (pip install wandb)")
    where = p.add_argument_group("run directory")
    where.add_argument("--run", metavar="DIR", help="folder of the run (default: runs/NAME)")
    where.add_argument("--resume", action="store_true", help="resume the run in that folder, if there is one")
    data = p.add_argument_group("data")
    data.add_argument("--episodes-file", metavar="PATH", help="Habitat PointNav episodes: a file, or a folder")
    data.add_argument("--split", metavar="NAME", help="split to take from a folder of episodes")
    add_data_options(data, "folder with scene_datasets/ in it, or one under which the scenes of --episodes-file are")
    data.add_argument("--scene", metavar="FILE", action="append", help="mesh that the episodes name (repeatable)")
    data.add_argument("--up", choices=("y", "z"), help="up axis of mesh files (default: what the episodes say, else y)")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_intermixed_args(argv)
    from prnav.train import RunFolder, Trainer, join_workers

    config = configure(options)
    folder = RunFolder(Path(options.run) if options.run else Path("runs") / config.name)
    workers = join_workers()
    workers.on_first(lambda: check_folder(folder, config, options.resume))
    console = Screen(stderr=True, highlight=False, quiet=not workers.first)
    groups, world = load_environments(config, console)
    board = progress_bar(console)
    report = reporter(config, console, board)
    trainer = Trainer(
        config,
        groups,
        folder,
        report=report if options.wandb is None or not workers.first else with_wandb(report, options.wandb, config),
        warn=lambda text: console.print(f"warning: {text}", style="yellow", soft_wrap=True),
        data=config.spec.facts(config.env, world),
        workers=workers,
        validation=lambda: load_validation(config),
    )
    try:
        trainer.begin()
        for line in [*opening(config, trainer.step, folder.path, workers.size), *config.spec.notes(config.env, world)]:
            console.print(line, soft_wrap=True)
        with board:
            stopped = trainer.train()
    finally:
        trainer.close()
        workers.leave()
    for line in closing(trainer.step, trainer.seconds, config, folder.path, stopped):
        console.print(line, soft_wrap=True)
    return 0


def check_folder(folder: RunFolder, config: TrainConfig, resume: bool) -> None:
    """Hold the command line to what is in the run's folder, before scenes are loaded.

    Raises:
        ConfigError: a run is there and is not to be resumed, or has another config.
    """
    if not folder.exists():
        return
    if not resume:
        raise ConfigError(
            f"run {folder.path} exists already; resume it with --resume, or choose another folder with --run DIR"
        )
    folder.check_resumable(config)


def configure(options: argparse.Namespace) -> TrainConfig:
    """The run's config: a file's, or, when a run is resumed without one, the run's own; then the command line's."""
    from prnav.train import load_train_config, without_readings

    check_data_options(options)
    settings = list(options.settings)
    for key, value in (("total_steps", options.steps), ("seed", options.seed)):
        if value is not None:
            settings.append(f"{key}={value}")
    for key, text in (
        ("env.episodes", options.episodes_file),
        ("env.episode_split", options.split),
        ("env.data", options.data),
        ("env.data_root", options.data_root),
        ("env.up", options.up),
    ):
        if text is not None:
            settings.append(f"{key}={_quoted(text)}")
    if options.navmesh_from is not None:
        settings.append(f"env.navmesh_files={'true' if options.navmesh_from == 'file' else 'false'}")
    if options.scene and options.data is not None:
        raise ConfigError("--scene and --data both say where scenes are: give one of them")
    if options.scene:
        settings.append(f"env.scene_files=[{', '.join(map(_quoted, options.scene))}]")
    own = Path(options.run) / "config.toml" if options.run and options.resume else None
    goes_on = own is not None and own.exists()
    name = options.config or (str(own) if goes_on else task_spec(options.task).preset)
    config = load_train_config(name, tuple(settings))
    if config.task != options.task:
        raise ConfigError(f"config {name} is for {config.task}; use prnav-train {config.task}, or another --config")
    if options.steps is not None and not goes_on and not any(key.startswith("imitation.steps=") for key in settings):
        config = with_scaled_warm_start(config, load_train_config(name))
    if options.warmstart == "none":
        config = replace(config, imitation=replace(config.imitation, steps=0))
    elif options.warmstart == "imitation" and not config.imitation.steps:
        config = replace(config, imitation=replace(config.imitation, steps=max(1, config.total_steps // 5)))
    return without_readings(config) if options.blind and config.policy.encoder != "blind" else config


def with_scaled_warm_start(config: TrainConfig, written: TrainConfig) -> TrainConfig:
    """``config`` with the warm start's share of the whole run as it was ``written``, before ``--steps`` changed it.

    A warm start that is cut short ends while the oracle still takes most steps, and leaves a policy that never walked
    on its own.
    """
    steps = config.total_steps * written.imitation.steps // written.total_steps
    return replace(config, imitation=replace(config.imitation, steps=steps))


def _quoted(text: str) -> str:
    """``text`` as a TOML literal string."""
    if "'" in text or not text.isprintable():
        raise ConfigError(f"{text!r} holds a quote or a control character; rename it or use a config file")
    return f"'{text}'"


def load_environments(config: TrainConfig, console: Console) -> tuple[list[BatchEnv], World]:
    """The run's environments in groups over one world, with a line that says what is loading."""
    from prnav.train import group_sizes

    with console.status("loading scenes") as status:

        def loading(done: int, total: int, name: str) -> None:
            status.update(Text(f"loading {done}/{total} {name}"))

        spec = config.spec
        spec.prepare(config.env, loading)
        world = spec.load(config.env, loading)
        groups = [spec.make_envs(config.env, world, size) for size in group_sizes(config.num_envs, config.groups)]
        return groups, world


def opening(config: TrainConfig, step: int, folder: Path, workers: int = 1) -> list[str]:
    """What is about to be done."""
    count = f"{workers} workers with {config.num_envs}" if workers > 1 else f"{config.num_envs}"
    warm = config.imitation.steps
    plan = f"imitate the shortest-path oracle for {warm:,} steps (warm start), then PPO" if warm else "PPO from scratch"
    first = f"run {folder}: {config.task}, {config.policy.encoder} agent, {count} environments"
    second = f"plan: {plan}, {config.total_steps:,} steps in all"
    lines = [first, second]
    return [*lines, f"resumed at step {step:,}"] if step else lines


def closing(step: int, seconds: float, config: TrainConfig, folder: Path, stopped: str | None) -> list[str]:
    """What was done, and what to do next."""
    rate = f"{step / seconds:,.0f} steps/s" if seconds else "nothing left to do"
    if stopped is not None:
        return [
            f"{stopped}: saved at step {step:,} of {config.total_steps:,}",
            f"resume with: prnav-train {config.task} --run {folder} --resume",
        ]
    learnt = "warm start by imitation, then PPO" if config.imitation.steps else "PPO from scratch"
    command = f"prnav-eval --run {folder} {config.spec.evaluation.hint(config.env)}"
    return [
        f"trained {step:,} steps in {seconds / 60:.1f} min ({rate}); {learnt}",
        f"evaluate with: {command.rstrip()}",
    ]


def progress_bar(console: Console) -> Progress:
    """A line that is redrawn, on a terminal."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TextColumn("{task.completed:,.0f}/{task.total:,.0f}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )


def reporter(config: TrainConfig, console: Console, bar: Progress) -> Show:
    """Shows rows of metrics: on the bar, or as a line now and then where there is no terminal."""
    task: TaskID = bar.add_task("starting", total=config.total_steps)
    last: tuple[float, str] = (float("-inf"), "")

    def show(row: MetricsRow) -> None:
        nonlocal last
        text = summary(row)
        bar.update(task, description=text, completed=min(row["step"], config.total_steps))
        due = time.monotonic() - last[0] >= LINE_SECONDS or row["phase"] != last[1]
        if bar.disable and (due or row["step"] >= config.total_steps):
            console.print(f"{row['step']:>11,}  {text}", soft_wrap=True)
            last = (time.monotonic(), row["phase"])

    return show


def summary(row: MetricsRow) -> str:
    """One line of metrics."""
    measures, losses = row["measures"], row["losses"]
    parts = [f"{row['phase']:9}", f"{row['times']['steps_per_second']:6,.0f} steps/s"]
    parts += [f"{name} {measures[name]:.2f}" for name in ("reward", "success", "spl") if name in measures]
    parts += [f"entropy {losses['entropy']:.2f}"]
    return "  ".join(parts)


if __name__ == "__main__":
    sys.exit(main())
