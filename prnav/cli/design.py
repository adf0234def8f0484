"""``prnav-design``: sensor designs: look at them, find better ones, compare them."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from prnav.cli._common import Parser, Screen, command, natural, pixels, whole_number, workers
from prnav.cli._helpers import Helpers
from prnav.contracts.measures import BY_KEY
from prnav.errors import ConfigError, DesignError
from prnav.files import check_writable, write_text

if TYPE_CHECKING:
    from prnav.design.config import OptimizeConfig
    from prnav.sensors import Design

SWEEPS = ("spread", "gain", "axes", "interpolation", "dropout", "transfer", "cameras")


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = Parser(
        prog="prnav-design",
        description="Sensor designs: the library, pictures of them, and searches for better ones.",
        epilog="Searches and sweeps are interrupted by Ctrl-C and resume when the same command is given again.",
    )
    p.set_defaults(settings=None)
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    listing = commands.add_parser("list", help="the designs that travel with the package")
    listing.set_defaults(run=_list)

    show = commands.add_parser("show", help="draw a design on its body, and what each of its receptors sees")
    show.add_argument("design", help="name from the library, or a design file")
    show.add_argument("--out", required=True, metavar="PNG", help="picture to write")
    show.add_argument("--scene", default="prhouses/test/00", help="built-in home or mesh file to look at")
    show.add_argument("--up", choices=("y", "z"), default="y", help="up axis of a mesh file (default: y)")
    show.add_argument("--seed", type=natural, default=0, help="another seed looks from another place (default: 0)")
    show.add_argument("--size", type=pixels, default=256, help="pixels of a sensor's picture (default: 256)")
    show.add_argument(
        "--rays", type=whole_number(1, 4096), default=256, help="rays per receptor, a square number (default: 256)"
    )
    show.add_argument("--body-only", action="store_true", help="leave out what it sees")
    show.set_defaults(run=_show)

    random = commands.add_parser("random", help="write designs drawn from seeds")
    random.add_argument("--out", required=True, metavar="DIR", help="folder for the design files")
    random.add_argument(
        "--sensors", type=whole_number(1, 64), default=2, metavar="K", help="sensors of each (default: 2)"
    )
    random.add_argument(
        "--grid", type=whole_number(1, 64), default=4, metavar="B", help="receptors per row (default: 4)"
    )
    random.add_argument("--count", type=whole_number(1, 10_000), default=1, metavar="N", help="how many (default: 1)")
    random.add_argument("--seed", type=natural, default=0, help="of the first; the others count up (default: 0)")
    random.set_defaults(run=_random)

    optimize = commands.add_parser("optimize", help="search for a better design, from one or several starts")
    _settings(optimize)
    optimize.add_argument("--out", metavar="DIR", help="folder of the search (default: runs/NAME)")
    optimize.add_argument("--storage", metavar="URL", help="database of the study, for workers on several machines")
    _workers(optimize)
    optimize.set_defaults(run=_optimize)

    evaluate = commands.add_parser("evaluate", help="what designs are worth: the proxy's score, or trained specialists")
    evaluate.add_argument("design", nargs="+", help="names from the library, or design files")
    evaluate.add_argument("--proxy", action="store_true", help="the proxy's score, in seconds; trains nothing")
    evaluate.add_argument("--json", metavar="FILE", help="also write the scores as JSON")
    _plans(evaluate)
    evaluate.set_defaults(run=_evaluate, kind="designs", initial=None, found=None, random=0)

    sweep = commands.add_parser("sweep", help="train a specialist for every design of an analysis, side by side")
    sweep.add_argument("kind", choices=SWEEPS, help="the analysis")
    sweep.add_argument("--initial", nargs="*", default=[], metavar="DESIGN", help="initial designs")
    sweep.add_argument("--found", nargs="*", default=[], metavar="DESIGN", help="designs that were found from them")
    sweep.add_argument(
        "--random", type=whole_number(0, 10_000), default=8, metavar="N", help="random designs of a spread (default: 8)"
    )
    _plans(sweep)
    sweep.set_defaults(run=_sweep)

    compare = commands.add_parser("compare", help="table and figure of what searches and sweeps found")
    compare.add_argument("folder", nargs="+", help="folders that optimize, evaluate or sweep made")
    compare.add_argument(
        "--kind", choices=("designs", *SWEEPS, "proxy", "methods"), help="the figure (default: the folder's own)"
    )
    compare.add_argument("--measure", choices=tuple(BY_KEY), default="spl", help="what is compared (default: spl)")
    compare.add_argument("--scores", metavar="FILE", help="what evaluate --proxy --json wrote, for --kind proxy")
    compare.add_argument("--out", metavar="PNG", help="figure to write (default: KIND.png in the first folder)")
    compare.add_argument("--json", metavar="FILE", help="also write means and intervals as JSON")
    compare.set_defaults(run=_compare)
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = _parse(argv)
    options.run(options)
    return 0


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Options; ``key=value`` settings may stand anywhere."""
    words = list(sys.argv[1:] if argv is None else argv)
    settings = [word for word in words if "=" in word and not word.startswith("-")]
    options = parser().parse_args([word for word in words if word not in settings])
    if settings and options.settings is None:
        raise ConfigError(f"{settings[0]!r}: prnav-design {options.command} has no settings to change")
    if options.settings is not None:
        options.settings = settings
    return options


def _settings(p: argparse.ArgumentParser) -> None:
    p.add_argument("--config", default="design-quick", metavar="NAME|FILE", help="the search (default: design-quick)")
    p.set_defaults(settings=[])
    p.epilog = "key=value changes any setting of the config, for example method=joint or search.trials=200"


def _workers(p: argparse.ArgumentParser) -> None:
    p.add_argument("--workers", type=workers, default=1, metavar="N", help="processes side by side (default: 1)")
    p.add_argument(
        "--join",
        type=whole_number(0, 1 << 20),
        default=0,
        metavar="I",
        help="only take part, as worker I, in what another started",
    )


def _plans(p: argparse.ArgumentParser) -> None:
    _settings(p)
    p.add_argument("--out", metavar="DIR", help="folder of the plan and its runs (default: runs/KIND)")
    p.add_argument(
        "--seeds", type=whole_number(1, 1000), default=1, metavar="N", help="specialists per design (default: 1)"
    )
    p.add_argument(
        "--task",
        action="append",
        default=[],
        metavar="NAME:CONFIG",
        help="another task's config, beside that of --config",
    )
    p.add_argument(
        "--slurm", type=whole_number(0, 4096), default=0, metavar="N", help="submit N workers to SLURM (needs submitit)"
    )
    _workers(p)


def _list(options: argparse.Namespace) -> None:
    from prnav.sensors import design_summaries

    table = Table()
    for column in ("design", "for", "sensors", "grid"):
        table.add_column(column, justify="left" if column in ("design", "for") else "right", no_wrap=True)
    table.add_column("idea", overflow="fold")
    for name, model, sensors, grid, description in sorted(design_summaries(), key=lambda d: (d.model, d.name)):
        table.add_row(name, model or "navigation", str(sensors), f"{grid} x {grid}", description)
    Screen().print(table)


def _show(options: argparse.Namespace) -> None:
    from prnav.report.designs import draw_design
    from prnav.sensors import design_model, load_design
    from prnav.style import save_png

    check_writable(options.out)
    if model := design_model(options.design):
        from prnav.domains.control.drawing import draw_standing

        figure, design = draw_standing(options.design, model)
        print(f"{design.name}: {textwrap.shorten(design.description, 200)}")
        print(f"picture  {save_png(figure, options.out)}")
        return
    design = load_design(options.design)
    sight, place = None, ""
    if not options.body_only:
        from prnav.domains.navigation.pictures.design_sight import see, telling_pose
        from prnav.navmesh import load_navmesh
        from prnav.render import Renderer
        from prnav.scene import load_scene

        scene = load_scene(options.scene, up=options.up)
        renderer = Renderer([scene], rays_per_receptor=options.rays)
        position, yaw = telling_pose(renderer, load_navmesh(scene), options.seed)
        sight = see(renderer, design, position, yaw, options.size)
        place = f"in {scene.name} at ({position[0]:.1f}, {position[2]:.1f})"
    path = save_png(draw_design(design, sight, place), options.out)
    print(f"{design.name}: {textwrap.shorten(design.description, 200)}")
    print(f"picture  {path}")


def _random(options: argparse.Namespace) -> None:
    from prnav.sensors import random_design, save_design

    for seed in range(options.seed, options.seed + options.count):
        design = random_design(seed, options.sensors, options.grid)
        path = Path(options.out) / f"{design.name}.toml"
        save_design(design, path)
        print(path)


def _optimize(options: argparse.Namespace) -> None:
    from prnav.design.config import load_optimize_config
    from prnav.design.optimize import Optimizer

    config = load_optimize_config(options.config, tuple(options.settings))
    folder = Path(options.out) if options.out else Path("runs") / config.name
    with _Board() as board:
        optimizer = Optimizer(config, folder, board.say, board.loading, options.storage, board.warn)
        if options.join:
            optimizer.help()
            return
        with _helpers(options, "optimize", folder) as helpers:
            best = optimizer.run()
        for line in helpers.told():
            board.warn(line)
    _print_optimized(config, folder, best)


def _print_optimized(config: OptimizeConfig, folder: Path, best: Design) -> None:
    from prnav.report.design_results import gains, load_rows
    from prnav.result_kinds import read_start

    console = Screen()
    table = Table(title=f"{config.name}: {config.method}", title_justify="left", title_style="bold")
    for column in ("start", "designs tried", "steps", "initial", "found"):
        table.add_column(column, justify="right")
    for number in range(config.starts):
        start = read_start(folder / f"start-{number}" / "start.json")
        scores = (f"{start[name]:.4f}" for name in ("initial", "found"))
        table.add_row(str(number), str(start["trials"]), f"{start['steps']:,}", *scores)
    console.print(table)
    if config.judge:
        found = gains(load_rows([folder]), config.measure)
        console.print(
            f"specialists: {found.improved} of {len(found.starts)} starts improved; gain in {config.measure} "
            f"{found.gain.mean:+.3f} (95 % interval {found.gain.low:+.3f} to {found.gain.high:+.3f})",
            highlight=False,
        )
        console.print(f"compare  prnav-design compare {folder} --kind gain", highlight=False, soft_wrap=True)
    console.print(f"design   {folder / 'design.toml'} ({best.name})", highlight=False, soft_wrap=True)


def _evaluate(options: argparse.Namespace) -> None:
    if not options.proxy:
        _sweep(options)
        return
    from prnav.design.config import load_optimize_config
    from prnav.design.optimize import load_probe
    from prnav.sensors import load_design

    designs = [load_design(name) for name in options.design]
    config = load_optimize_config(options.config, tuple(options.settings))
    with _Board() as board:
        proxy = load_probe(config, board.loading)
        told = {}
        for done, design in enumerate(designs):
            board.say("proxy", done, len(designs), design.name)
            parts = proxy.parts(design)
            told[design.name] = {"score": proxy.weighted(parts), **parts}
    keys = list(next(iter(told.values())))
    table = Table(
        title="R² of what a design's readings tell, homes never seen", title_justify="left", title_style="bold"
    )
    table.add_column("design")
    for key in keys:
        table.add_column(key, justify="right")
    for name, parts in sorted(told.items(), key=lambda item: -item[1]["score"]):
        table.add_row(name, *(f"{parts[key]:.3f}" for key in keys))
    Screen().print(table)
    if options.json:
        write_text(options.json, json.dumps(told, indent=1) + "\n")


def _sweep(options: argparse.Namespace) -> None:
    from prnav.design import sweep

    folder = Path(options.out) if options.out else Path("runs") / options.kind
    if not options.join:
        configs = _configs(options)
        sweep.write_plan(folder, options.kind, _designs(options, next(iter(configs.values()))), configs, options.seeds)
        if options.slurm:
            _submit(options.slurm, folder)
            return
    with _Board() as board:
        with _helpers(options, "sweep", folder) as helpers:
            done = sweep.work(
                folder, lambda at, of, text: board.say("specialists", at, of, text), board.loading, board.warn
            )
            helpers.wait()
        for line in helpers.told():
            board.warn(line)
    rows = sweep.collect(folder)
    _, jobs = sweep.read_plan(folder)
    print(f"specialists  {len(rows)} of {len(jobs)} done in {folder}")
    if len(rows) == len(jobs) and not options.join:
        print(f"compare  prnav-design compare {folder}")
    elif not options.join:
        print(f"the others are held by other workers; give the command again when these have finished ({done} done)")


def _configs(options: argparse.Namespace) -> dict[str, OptimizeConfig]:
    """The config of each task."""
    from prnav.design.config import load_optimize_config

    first = load_optimize_config(options.config, tuple(options.settings))
    configs = {first.train.task: first}
    for text in options.task:
        name, sign, config = text.partition(":")
        if not sign:
            raise ConfigError(f"--task {text!r} is not of the form NAME:CONFIG, for example mine:design-mine.toml")
        configs[name] = load_optimize_config(config, tuple(options.settings))
    return configs


def _designs(options: argparse.Namespace, config: OptimizeConfig) -> list[tuple[str, Design]]:
    """Designs of an analysis with their groups."""
    from prnav.design import variants
    from prnav.sensors import load_design

    kind = options.kind
    if kind == "designs":
        designs = [load_design(name) for name in options.design]
        return [(design.name, design) for design in designs]
    initial = [load_design(name) for name in options.initial]
    found = [load_design(name) for name in options.found]
    if kind in ("spread", "transfer"):
        return variants.spread([*initial, *found], options.random, config.sensors, config.grid, config.seed)
    if kind == "gain":
        return variants.pairs(initial, found)
    if kind == "cameras":
        return [("Habitat's default", load_design("habitat-camera")), *((design.name, design) for design in found)]
    if len(found) != 1 or (kind != "dropout" and len(initial) != 1):
        needs = "--found DESIGN" if kind == "dropout" else "--initial DESIGN --found DESIGN"
        raise DesignError(f"the analysis {kind} is of one search; give {needs}")
    if kind == "dropout":
        return variants.without_each(found[0])
    return {"axes": variants.single_axes, "interpolation": variants.interpolated}[kind](initial[0], found[0])


def _compare(options: argparse.Namespace) -> None:
    from prnav.cli._design_compare import compare

    compare(options)


def _helpers(options: argparse.Namespace, name: str, folder: Path) -> Helpers:
    """The other workers of this machine."""
    words = [name]
    if name == "optimize":
        words += ["--config", str(folder / "config.toml")]
        words += ["--storage", options.storage] if options.storage else []
    else:
        words.append(options.kind if options.kind != "designs" else "spread")
    return Helpers(words, folder, 0 if options.join else options.workers - 1)


def _submit(count: int, folder: Path) -> None:
    """Ask SLURM for workers of a plan."""
    try:
        import submitit
    except ImportError as error:
        raise ConfigError(f"--slurm needs submitit ({error}); install it with: pip install submitit") from error
    executor = submitit.AutoExecutor(folder=str(folder / "slurm"))
    executor.update_parameters(cpus_per_task=2, timeout_min=24 * 60, name="prnav-design")
    words = [sys.executable, "-m", "prnav.cli.design", "sweep", "spread", "--out", str(folder.resolve()), "--join", "1"]
    jobs = [executor.submit(subprocess.run, words, check=True) for _ in range(count)]
    print(f"submitted  {', '.join(job.job_id for job in jobs)}; results: prnav-design compare {folder}")


class _Board:
    """A line that is redrawn, or a printed line per event where there is no terminal."""

    def __init__(self) -> None:
        self.console = Screen(stderr=True, highlight=False)
        columns = (TextColumn("{task.description}", markup=False), BarColumn(bar_width=20), TimeElapsedColumn())
        self.bar = Progress(*columns, console=self.console, disable=not self.console.is_terminal)
        self.task = self.bar.add_task("starting", total=None)
        self._last = ""

    def __enter__(self) -> _Board:
        self.bar.start()
        return self

    def __exit__(self, *unused: object) -> None:
        self.bar.stop()

    def say(self, stage: str, done: int, of: int, text: str) -> None:
        """Show how a stage gets on."""
        self.bar.update(self.task, completed=done, total=of, description=f"{stage} {done:,}/{of:,}  {text}")
        line = f"{stage:11} {done:>9,}/{of:<9,} {text}"
        if self.bar.disable and line != self._last:
            self.console.print(line, soft_wrap=True)
            self._last = line

    def warn(self, text: str) -> None:
        """Print what the user should know, above the line."""
        self.console.print(f"warning: {text}", style="yellow", markup=False, soft_wrap=True)

    def loading(self, done: int, total: int, name: str) -> None:
        """Show which scene is loading."""
        self.bar.update(self.task, completed=done, total=total, description=f"loading {name or 'scenes'}")


if __name__ == "__main__":
    main()
