"""``prnav-eval``: play episodes with trained or reference agents, print the measures, keep the records."""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from prnav.catalog import DEFAULT_TASK, TASKS, task_spec
from prnav.cli._common import (
    Parser,
    Screen,
    add_data_options,
    check_data_options,
    command,
    natural,
    positive,
    whole_number,
    workers,
)
from prnav.cli._progress import LineProgress
from prnav.errors import ConfigError
from prnav.files import check_writable, write_text

if TYPE_CHECKING:
    from prnav.contracts import EpisodeRequest, Evaluation, TaskConfig, TaskSpec
    from prnav.evaluate.intervals import Interval
    from prnav.evaluate.learned import TrainedRun

PICTURE = "trajectories.png"

Actions = Literal["sampled", "greedy"]


@dataclass(frozen=True, eq=False)
class Entry:
    """One evaluation that is asked for."""

    agent: str | TrainedRun
    folder: Path
    """Of the run, or of the reference agent."""
    actions: Actions | None
    """How a trained agent chooses; None for a reference agent."""


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = Parser(
        prog="prnav-eval",
        description="Evaluate agents on episodes, each played once, and report means with 95 % bootstrap intervals.",
        epilog="Records go to RUN/eval/NAME (RUN is runs/AGENT for a reference agent). An interrupted evaluation "
        "resumes when the same command is given again. Several agents on the same episodes are compared with the "
        "first, paired by episode.",
    )
    who = p.add_argument_group("agents (one at least, each repeatable)")
    who.add_argument(
        "--run", metavar="DIR", action="append", default=[], help="directory of a training run: its last checkpoint"
    )
    who.add_argument(
        "--agent",
        metavar="NAME",
        action="append",
        default=[],
        help="a reference agent, none of which sees; in homes: shortest-path, random, forward, goal-follower, "
        "wall-follower, blind",
    )
    what = p.add_argument_group("episodes")
    what.add_argument("--task", choices=tuple(TASKS), help=f"of reference agents (default: {DEFAULT_TASK})")
    what.add_argument(
        "--split",
        help="built-in split: train, val or test (default: test; with --run the run's own); with --data its own "
        "(default: val), and so for a run that was trained on a data set",
    )
    what.add_argument("--episodes", type=positive, metavar="N", help="only N episodes, dealt evenly over the scenes")
    what.add_argument(
        "--episodes-file",
        metavar="PATH",
        help="Habitat PointNav episodes: a file, or a folder with --split in it",
    )
    add_data_options(what, "folder with scene_datasets/ in it, or one under which the scenes of --episodes-file are")
    what.add_argument("--scene", metavar="FILE", action="append", default=[], help="mesh that they name (repeatable)")
    what.add_argument("--up", choices=("y", "z"), help="up axis of mesh files (default: what the episodes say, else y)")
    what.add_argument(
        "--target",
        choices=("visible", "invisible"),
        help="of tasks with a target: whether it is seen (default: as it was trained); invisible tells whether the "
        "agent goes by it",
    )
    how = p.add_argument_group("how")
    how.add_argument(
        "--actions",
        choices=("sampled", "greedy", "both"),
        default="both",
        help="of trained agents: sampled, as they were trained and as Habitat evaluates, or the likeliest "
        "(default: both, each on its own line)",
    )
    how.add_argument("--seed", type=natural, default=0, help="seed of sampled actions (default: 0)")
    how.add_argument(
        "--num-envs",
        type=whole_number(1, 1 << 16),
        default=64,
        metavar="N",
        help="episodes at once; changes no result (default: 64)",
    )
    how.add_argument(
        "--workers", type=workers, metavar="N", help="processes; changes no result (default: one per core)"
    )
    how.add_argument("--device", default="cpu", help="where a trained policy runs: cpu or cuda (default: cpu)")
    how.add_argument("--restart", action="store_true", help="drop what an interrupted evaluation left")
    out = p.add_argument_group("output")
    out.add_argument("--out", metavar="DIR", help="folder for records and pictures (one in it for each evaluation)")
    out.add_argument("--json", metavar="FILE", help="also write measures and intervals as JSON")
    out.add_argument(
        "--submit", action="store_true", help="also write submission.json beside the records: one self-describing file"
    )
    out.add_argument("--verify", metavar="FILE", help="compute such a file again from its records, and play nothing")
    out.add_argument("--records", metavar="DIR", help="where the records of --verify are (default: beside the file)")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_args(argv)
    if options.verify is not None:
        return _verify(options)
    if not options.run and not options.agent:
        raise ConfigError("no agent given; give --run DIR or --agent NAME (or --verify FILE)")
    if options.json:
        check_writable(options.json)
    screen = Screen(stderr=True)
    entries = _entries(options, screen)
    evaluations = []
    for entry in entries:
        evaluation = _evaluate(entry, options, screen, several=len(entries) > 1)
        _print(evaluation, Screen())
        if options.submit:
            from prnav.evaluate.submission import write_submission

            path = write_submission(evaluation)
            Screen().print(f"result   {path}", highlight=False, soft_wrap=True)
        evaluations.append(evaluation)
    report = _compare(evaluations, Screen())
    if options.json:
        head = evaluations[0].header
        write_text(options.json, json.dumps({**head, **report} if report else head, indent=1) + "\n")
    return 0


def _entries(options: argparse.Namespace, screen: Console) -> list[Entry]:
    """The evaluations to make, in the order they were asked for."""
    entries: list[Entry] = []
    for directory in options.run:
        from prnav.evaluate.learned import load_run

        run = load_run(directory, lambda text: screen.print(f"warning: {text}", style="yellow", highlight=False))
        if options.task not in (None, run.config.task):
            raise ConfigError(f"run {directory} is for {run.config.task}; leave out --task {options.task}")
        kinds: tuple[Actions, ...] = ("sampled", "greedy") if options.actions == "both" else (options.actions,)
        entries += [Entry(run, Path(directory), kind) for kind in kinds]
    known = task_spec(_task_name(options)).evaluation.agents
    for name in options.agent:
        if name not in known:
            raise ConfigError(f"--agent {name!r} is not known; valid: {', '.join(known)}")
    return entries + [Entry(name, Path("runs") / name, None) for name in options.agent]


def _evaluate(entry: Entry, options: argparse.Namespace, screen: Console, several: bool) -> Evaluation:
    from prnav.evaluate.evaluation import evaluate, load_questions
    from prnav.resources import available_cores

    spec = task_spec(_task_name(options))
    trained = None if isinstance(entry.agent, str) else entry.agent.config.env
    config = spec.evaluation.config(trained, _request(options))
    with _progress(screen) as bars:
        line = bars.add_task("loading scenes", total=None)

        def loading(done: int, total: int, name: str) -> None:
            bars.update(line, completed=done, total=total, description=f"loading {name or 'scenes'}")

        def playing(done: int, total: int) -> None:
            bars.update(line, completed=done, total=total, description="playing episodes")

        spec.prepare(config, loading, options.episodes)
        questions = load_questions(spec, config, options.episodes, loading)
        evaluation = evaluate(
            questions,
            config,
            _directory(entry, options, _folder_name(entry, options, spec, config), several),
            agent=entry.agent,
            actions=entry.actions or "sampled",
            seed=options.seed,
            num_envs=options.num_envs,
            workers=options.workers or available_cores(),
            device=_device(options.device),
            restart=options.restart,
            progress=playing,
        )
        bars.update(line, description="drawing trajectories")
        _draw(evaluation)
    return evaluation


def _task_name(options: argparse.Namespace) -> str:
    """The task that all agents play: what is asked for, or that of the first run."""
    from prnav.train import RunFolder

    if options.task or not options.run:
        return options.task or DEFAULT_TASK
    return RunFolder(Path(options.run[0])).load_config().task


def _verify(options: argparse.Namespace) -> int:
    from prnav.evaluate.submission import verify_submission

    evaluation = verify_submission(options.verify, options.records)
    _print_results(evaluation, Screen())
    print(f"verified  {options.verify}: every measure follows from the records in {evaluation.directory}")
    return 0


def _compare(evaluations: Sequence[Evaluation], console: Console) -> dict[str, object]:
    """Print how several evaluations differ; the same for ``--json``."""
    if len(evaluations) < 2:
        return {}
    from prnav.evaluate.compare import differences, group_differences, same_episodes, seed_groups
    from prnav.report.tables import differences_table, seeds_table, that_fit

    names = [evaluation.label for evaluation in evaluations]
    paired, groups = differences(evaluations, names), seed_groups(evaluations)
    if paired:
        for part in that_fit(paired, console.width):
            console.print(differences_table(part))
    elif not same_episodes(evaluations):
        console.print("these evaluations are of different episodes, so they are not compared", highlight=False)
    between = group_differences(groups)
    if groups:
        for few in that_fit(groups, console.width):
            console.print(seeds_table(few))
    if between:
        for part in that_fit(between, console.width):
            console.print(differences_table(part))
    return {
        "evaluations": [evaluation.header for evaluation in evaluations],
        "differences": [dataclasses.asdict(difference) for difference in paired],
        "seeds": [{"name": group.name, "seeds": group.seeds, "measures": _as_json(group.measures)} for group in groups],
        "seed_differences": [dataclasses.asdict(difference) for difference in between],
    }


def _as_json(measures: Mapping[str, Interval]) -> dict[str, dict[str, float]]:
    return {key: dataclasses.asdict(interval) for key, interval in measures.items()}


def _request(options: argparse.Namespace) -> EpisodeRequest:
    """The episodes that were asked for."""
    from prnav.contracts import EpisodeRequest

    check_data_options(options)
    return EpisodeRequest(
        split=options.split,
        episodes_file=options.episodes_file,
        data=options.data,
        data_root=options.data_root,
        navmesh_from=options.navmesh_from,
        scenes=tuple(options.scene),
        up=options.up,
        target=options.target,
    )


def _folder_name(entry: Entry, options: argparse.Namespace, spec: TaskSpec, config: TaskConfig) -> str:
    """A name for each thing that is asked of an agent."""
    name = spec.evaluation.name(config)
    if entry.actions is not None:
        name += f"-{entry.actions}"
    elif spec.name != DEFAULT_TASK:
        name = f"{spec.name.replace('/', '-')}-{name}"
    name += spec.evaluation.suffix(config)
    if options.episodes is not None:
        name += f"-{options.episodes}"
    return f"{name}-seed{options.seed}" if options.seed else name


def _directory(entry: Entry, options: argparse.Namespace, name: str, several: bool) -> Path:
    """Where the records go: ``RUN/eval/NAME``, or what --out says."""
    if not options.out:
        return entry.folder / "eval" / name
    return Path(options.out) / f"{entry.folder.name}-{name}" if several else Path(options.out)


def _device(name: str) -> str:
    if name == "cpu":
        return name
    from prnav.train.machine import choose_device

    if name not in ("auto", "cuda"):
        raise ConfigError(f"--device {name!r} is not known; valid: cpu, cuda, auto")
    return str(choose_device(name))


def _draw(evaluation: Evaluation) -> None:
    from prnav.evaluate.records import load_traces
    from prnav.style import save_png

    figure = task_spec(evaluation.header["task"]).pictures.episodes(evaluation, load_traces(evaluation))
    save_png(figure, evaluation.directory / PICTURE)


def _print_results(evaluation: Evaluation, console: Console) -> None:
    from prnav.report.tables import intervals_of, results_table

    head = evaluation.header
    title = f"{evaluation.label} on {head['split']}, {head['episodes']} episodes"
    console.print(results_table(title, intervals_of(head)))
    origins = list(head.get("navmeshes", {}).values())
    if any(origin != "built" for origin in origins):
        files = sum(origin != "built" for origin in origins)
        console.print(f"navmesh  {files} from files, {len(origins) - files} built", highlight=False)


def _print(evaluation: Evaluation, console: Console) -> None:
    _print_results(evaluation, console)
    console.print(f"records  {evaluation.directory}", highlight=False, soft_wrap=True)
    console.print(f"picture  {evaluation.directory / PICTURE}", highlight=False, soft_wrap=True)


def _progress(screen: Console) -> Progress:
    return LineProgress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=screen,
    )


if __name__ == "__main__":
    main()
