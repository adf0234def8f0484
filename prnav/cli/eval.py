"""``prnav-eval``: play episodes with a trained or a reference agent, print the measures, keep the records."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from prnav.cli._common import add_data_options, check_data_options, command
from prnav.errors import ConfigError
from prnav.evaluate.agents import REFERENCE_AGENTS
from prnav.files import write_text

if TYPE_CHECKING:
    from prnav.env import EnvConfig
    from prnav.evaluate.learned import TrainedRun
    from prnav.evaluate.records import Evaluation

PICTURE = "trajectories.png"


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = argparse.ArgumentParser(
        prog="prnav-eval",
        description="Evaluate an agent on episodes, each played once, and report means with 95 %% bootstrap intervals.",
        epilog="Records go to RUN/eval/NAME (RUN is runs/AGENT for a reference agent). An interrupted evaluation goes "
        "on when the same command is given again.",
    )
    who = p.add_mutually_exclusive_group(required=True)
    who.add_argument("--run", metavar="DIR", help="directory of a training run: its last checkpoint acts")
    who.add_argument("--agent", choices=REFERENCE_AGENTS, help="a reference agent")
    what = p.add_argument_group("episodes")
    what.add_argument(
        "--split",
        help="built-in split: train, val or test (default: test; with --run the run's own); with --data its own "
        "(default: val), and so for a run that was trained on a data set",
    )
    what.add_argument("--episodes", type=_positive, metavar="N", help="only N episodes, dealt evenly over the scenes")
    what.add_argument(
        "--episodes-file",
        metavar="PATH",
        help="Habitat PointNav episodes: a file, or a folder with --split in it",
    )
    add_data_options(what, "folder with scene_datasets/ in it, or one under which the scenes of --episodes-file are")
    what.add_argument("--scene", metavar="FILE", action="append", default=[], help="mesh that they name (repeatable)")
    what.add_argument("--up", choices=("y", "z"), help="up axis of mesh files (default: what the episodes say, else y)")
    how = p.add_argument_group("how")
    how.add_argument(
        "--actions",
        choices=("greedy", "sampled"),
        default="sampled",
        help="of a trained agent (default: sampled, as it was trained and as Habitat evaluates)",
    )
    how.add_argument("--seed", type=int, default=0, help="seed of sampled actions (default: 0)")
    how.add_argument(
        "--num-envs", type=_positive, default=64, metavar="N", help="episodes at once; changes no result (default: 64)"
    )
    how.add_argument("--device", default="cpu", help="where a trained policy runs: cpu or cuda (default: cpu)")
    how.add_argument("--restart", action="store_true", help="drop what an interrupted evaluation left")
    out = p.add_argument_group("output")
    out.add_argument("--out", metavar="DIR", help="folder for records and pictures")
    out.add_argument("--json", metavar="FILE", help="also write measures and intervals as JSON")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_args(argv)
    from prnav.evaluate.pointgoal import evaluate_pointgoal, load_questions

    screen = Console(stderr=True)
    run = _load_run(options.run, screen)
    config = _environment(options, run)
    with _progress(screen) as bars:
        task = bars.add_task("loading scenes", total=None)

        def loading(done: int, total: int, name: str) -> None:
            bars.update(task, completed=done, total=total, description=f"loading {name or 'scenes'}")

        def playing(done: int, total: int) -> None:
            bars.update(task, completed=done, total=total, description="playing episodes")

        questions = load_questions(config, options.episodes, options.up, loading)
        directory = Path(options.out) if options.out else _directory(options, questions.name)
        evaluation = evaluate_pointgoal(
            questions,
            config,
            directory,
            agent=options.agent if run is None else run,
            actions=options.actions,
            seed=options.seed,
            num_envs=options.num_envs,
            device=_device(options.device),
            restart=options.restart,
            progress=playing,
        )
        bars.update(task, description="drawing trajectories")
        _draw(evaluation)
    _print(evaluation, Console())
    if options.json:
        write_text(options.json, json.dumps(evaluation.header, indent=1) + "\n")
    return 0


def _load_run(directory: str | None, screen: Console) -> TrainedRun | None:
    if directory is None:
        return None
    from prnav.evaluate.learned import load_run

    return load_run(directory, lambda text: screen.print(f"warning: {text}", style="yellow", highlight=False))


def _environment(options: argparse.Namespace, run: TrainedRun | None) -> EnvConfig:
    """The run's environment, or the default one, with the episodes that were asked for."""
    from prnav.env import EnvConfig

    check_data_options(options)
    config = EnvConfig(scenes="test", vision=False) if run is None else run.config.env
    changes: dict[str, object] = {}
    if options.episodes_file is not None or options.data is not None:
        split = options.split if options.episodes_file is not None else options.split or "val"
        changes |= {"episodes": options.episodes_file, "episode_split": split, "scene_files": ()}
        changes |= {"data": options.data, "data_root": None, "up": "y", "navmesh_files": options.navmesh != "build"}
    elif options.split is not None and config.data is not None:
        changes["episode_split"] = options.split
    elif options.split is not None:
        from prnav.scene import scene_ids

        scene_ids(options.split)  # refuses a split that is none
        changes |= {"scenes": options.split, "episodes": None, "max_scenes": None, "data": None}
    if options.data_root is not None:
        changes["data_root"] = options.data_root
    if options.scene:
        changes["scene_files"] = tuple(options.scene)
    if options.scene and changes.get("data", config.data) is not None:
        raise ConfigError("--scene and --data both say where scenes are: give one of them")
    no_data = changes.get("data", config.data) is None
    if (options.data_root or options.scene) and no_data and (changes.get("episodes") or config.episodes) is None:
        raise ConfigError("--scene and --data-root say where the scenes of episode files are: give --episodes-file too")
    return dataclasses.replace(config, **changes)  # type: ignore[arg-type]


def _directory(options: argparse.Namespace, split: str) -> Path:
    """``RUN/eval/NAME``, a name for each thing that is asked."""
    run = Path(options.run) if options.run else Path("runs") / options.agent
    name = split.removesuffix(".gz").removesuffix(".json")
    if options.run:
        name += f"-{options.actions}"
    if options.episodes is not None:
        name += f"-{options.episodes}"
    if options.seed:
        name += f"-seed{options.seed}"
    return run / "eval" / name


def _device(name: str) -> str:
    if name == "cpu":
        return name
    from prnav.train.trainer import choose_device

    if name not in ("auto", "cuda"):
        raise ConfigError(f"--device {name!r} is not known; valid: cpu, cuda, auto")
    return str(choose_device(name))


def _draw(evaluation: Evaluation) -> None:
    from prnav.evaluate.maps import load_maps
    from prnav.evaluate.records import load_trajectories
    from prnav.report.style import save_png
    from prnav.report.topdown import draw_episodes

    figure = draw_episodes(evaluation, load_trajectories(evaluation), load_maps(evaluation.directory))
    save_png(figure, evaluation.directory / PICTURE)


def _print(evaluation: Evaluation, console: Console) -> None:
    from prnav.report.tables import intervals_of, results_table

    head = evaluation.header
    title = f"{evaluation.label} on {head['split']}, {head['episodes']} episodes"
    console.print(results_table(title, intervals_of(head)))
    origins = list(head.get("navmeshes", {}).values())
    if any(origin != "built" for origin in origins):
        files = sum(origin != "built" for origin in origins)
        console.print(f"navmesh  {files} from files, {len(origins) - files} built", highlight=False)
    console.print(f"records  {evaluation.directory}", highlight=False, soft_wrap=True)
    console.print(f"picture  {evaluation.directory / PICTURE}", highlight=False, soft_wrap=True)


def _progress(screen: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=screen,
        transient=True,
        disable=not sys.stderr.isatty(),
    )


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not at least 1")
    return value


if __name__ == "__main__":
    main()
