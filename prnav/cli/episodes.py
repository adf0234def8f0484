"""``prnav-episodes``: draw episodes in scenes, check files of them, and say what is in them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from prnav.aliases import JSONObject, Untyped
from prnav.cli._common import Parser, Screen, add_data_options, check_data_options, command, natural, positive, workers
from prnav.cli._progress import LineProgress
from prnav.errors import EpisodeError, SceneError

if TYPE_CHECKING:
    from prnav.episodes import EpisodeTable
    from prnav.navmesh import NavMesh
    from prnav.scene import SceneFile

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = Parser(prog="prnav-episodes", description="Episodes in Habitat's PointNav format.")
    commands = p.add_subparsers(dest="command", required=True)

    sub = commands.add_parser("generate", help="draw episodes in scenes by Habitat's rules")
    where = sub.add_mutually_exclusive_group()
    where.add_argument(
        "--scene",
        metavar="FILE",
        action="append",
        help="mesh file, built-in id, or with --data a scene of the set (repeatable)",
    )
    where.add_argument("--scenes", metavar="SPLIT", help="split of built-in homes, or with --data of the set (hm3d)")
    sub.add_argument("--split", metavar="NAME", required=True, help="name of the split to write")
    sub.add_argument("--per-scene", metavar="N", type=positive, required=True, help="episodes per scene")
    sub.add_argument("--seed", metavar="S", type=natural, default=0, help="another seed, other episodes (default: 0)")
    sub.add_argument("--out", metavar="DIR", type=Path, required=True, help="writes DIR/NAME/NAME.json.gz")
    sub.add_argument("--up", choices=("y", "z"), default="y", help="up axis of mesh files (default: y)")
    add_data_options(sub, "folder with scene_datasets/ in it, or one that scene ids in the file are relative to")
    sub.add_argument("--workers", metavar="N", type=workers, help="processes (default: one per core)")
    sub.add_argument(
        "--roofs",
        action="store_true",
        help="draw on roofs and ceilings too, which nobody gets onto from inside (default: not where there are rooms)",
    )
    sub.set_defaults(run=_generate)

    sub = commands.add_parser("builtin", help="draw the shipped episodes of the built-in homes anew")
    sub.add_argument("--split", choices=("val", "test"), action="append", help="default: both")
    sub.add_argument("--out", metavar="DIR", type=Path, help="folder to write to (default: where they are shipped)")
    sub.set_defaults(run=_builtin)

    sub = commands.add_parser("check", help="read a file or folder, and try its episodes in their scenes")
    _add_dataset(sub)
    sub.add_argument("--scene", metavar="FILE", type=Path, action="append", default=[], help="mesh file (repeatable)")
    add_data_options(sub, "folder with scene_datasets/ in it, or one under which its scenes are")
    sub.add_argument("--up", choices=("y", "z"), default="y", help="up axis where the file says none (default: y)")
    sub.set_defaults(run=_check)

    sub = commands.add_parser("info", help="scenes, distances and difficulty of a file or folder")
    _add_dataset(sub)
    sub.set_defaults(run=_info)
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_args(argv)
    status: int = options.run(options)
    return status


def _add_dataset(sub: argparse.ArgumentParser) -> None:
    sub.add_argument("path", metavar="PATH", help="episode file, folder in Habitat's layout, or builtin")
    sub.add_argument("--split", metavar="NAME", help="split of a folder or of builtin that has several")


def _progress() -> Progress:
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return LineProgress(*columns, console=Screen(stderr=True))


def _generate(options: argparse.Namespace) -> int:
    from prnav.episodes.bulk import BulkConfig, generate_files
    from prnav.episodes.generate import GenerationConfig

    check_data_options(options)
    if not _NAME.fullmatch(options.split):
        raise EpisodeError(f"--split {options.split!r} cannot name a file; use letters, digits, '-', '_' and '.'")
    places = _places(options)
    ids = list(places)
    folder = options.out / options.split
    path = folder / f"{options.split}.json.gz"
    _refuse_foreign_content(folder, ids)
    config = BulkConfig(
        options.per_scene,
        options.seed,
        _up(places, options.up),
        options.data,
        options.navmesh_from != "build",
        limits=GenerationConfig(roofs=options.roofs),
        root=None if options.data is not None else options.data_root,
    )
    with _progress() as bars:
        task = bars.add_task("", total=len(ids) * options.per_scene)

        def show(scene_id: str, episodes: int) -> None:
            bars.update(task, description=scene_id, advance=episodes)

        result = generate_files(places, path, config, options.workers, show)
    there = f", {_count(result.kept, 'scene')} of them there already" if result.kept else ""
    print(f"{path}: {_count(len(ids) * options.per_scene, 'episode')} in {_count(len(ids), 'scene')}{there}")
    if options.data is not None:
        files = sum(origin != "built" for origin in result.origins.values())
        print(f"navmeshes: {files} from files, {len(ids) - files} built")
    return 0


def _places(options: argparse.Namespace) -> dict[str, str | SceneFile]:
    """What to load for each scene id that episodes are to be drawn in.

    Raises:
        SceneError: no scene was named, or two would have the same id.
    """
    from prnav.scene import open_scene_set, scene_ids

    if options.data is not None:
        scene_set = open_scene_set(options.data, options.data_root)
        chosen = options.scene or scene_set.scene_ids(options.scenes)
        files = [scene_set.scene(name) for name in dict.fromkeys(chosen)]
        return {file.scene_id: file for file in files}
    if not options.scene and not options.scenes:
        raise SceneError("no scene is named: give --scene FILE, --scenes SPLIT or --data NAME with --data-root DIR")
    sources = scene_ids(options.scenes) if options.scenes else list(dict.fromkeys(options.scene))
    root = None if options.data_root is None else Path(options.data_root)
    ids = [_scene_id(source, root) for source in sources]
    twice = sorted({scene_id for scene_id in ids if ids.count(scene_id) > 1})
    if twice:
        raise SceneError(f"--scene: two files would both be called {twice[0]}; give --data-root, a folder above both")
    return dict(zip(ids, sources, strict=True))


def _up(places: Mapping[str, str | SceneFile], given: str) -> str:
    """Up axis for the header: that of a data set's scenes, where they share one of the plain ones."""
    from prnav.scene import SceneFile
    from prnav.scene.scene_file import AXES

    frames = {place.frame for place in places.values() if isinstance(place, SceneFile)}
    return next((up for up, frame in AXES.items() if frames == {frame}), given)


def _scene_id(source: str, data_root: Path | None) -> str:
    """What an episode file calls a scene: a built-in id, a path relative to the data root, or a file name."""
    if source.startswith("prhouses/"):
        return source
    path = Path(source)
    if data_root is None:
        return path.name
    if not path.resolve().is_relative_to(data_root.resolve()):
        raise SceneError(f"{source}: not inside the data root {data_root}; give a folder above it, or leave it out")
    return path.resolve().relative_to(data_root.resolve()).as_posix()


def _refuse_foreign_content(folder: Path, ids: Sequence[str]) -> None:
    """Refuse a folder whose ``content`` has scenes that would be read together with those about to be written."""
    from prnav.episodes.files import content_names

    ours = {f"{name}.json.gz" for name in content_names(ids).values()} if len(ids) > 1 else set()
    content = folder / "content"
    found = [file.name for file in content.iterdir()] if content.is_dir() else []
    foreign = sorted(name for name in found if name not in ours and not name.startswith("."))
    if foreign:
        raise EpisodeError(
            f"{content} holds episodes of other scenes ({foreign[0]}), which would be read together with these; "
            "remove the folder, or choose another --out or --split"
        )


def _builtin(options: argparse.Namespace) -> int:
    from prnav.episodes import builtin_path, make_builtin_episodes, save_episodes

    for split in options.split or ("val", "test"):
        path = builtin_path(split) if options.out is None else options.out / f"{split}.json.gz"
        with _progress() as bars:
            task = bars.add_task(split, total=None)

            def show(done: int, count: int, name: str, bars: Progress = bars, task: Untyped = task) -> None:
                bars.update(task, description=name, completed=done, total=count)

            dataset = make_builtin_episodes(split, show)
        save_episodes(dataset, path)
        print(f"{path}: {len(dataset.episodes)} episodes in {len(dataset.scene_ids)} scenes")
    return 0


def _load(options: argparse.Namespace) -> tuple[EpisodeTable, JSONObject, str]:
    from prnav.episodes import load_builtin_table, load_episode_table

    if options.path == "builtin":
        if options.split is None:
            raise EpisodeError("builtin episodes have several splits; add --split val or --split test")
        return *load_builtin_table(options.split), f"built-in episodes ({options.split})"
    return *load_episode_table(options.path, options.split), options.path


def _check(options: argparse.Namespace) -> int:
    from prnav.episodes.check import duplicate_ids, misplaced

    check_data_options(options)
    table, header, source = _load(options)
    problems = duplicate_ids(table)
    absent: list[str] = []
    with _progress() as bars:
        for scene_id in bars.track(table.scene_ids, description="scenes"):
            try:
                navmesh = _open_navmesh(scene_id, header, source, options, len(table.scene_ids) == 1)
            except SceneError as error:
                given = options.scene or options.data_root is not None or scene_id.startswith("prhouses/")
                (problems if given else absent).append(f"{scene_id}: {error}")
                continue
            except EpisodeError as error:
                problems.append(str(error))
                continue
            problems.extend(misplaced(table, scene_id, navmesh))
    for line in problems:
        print(line)
    found = _count(len(problems), "problem") if problems else "no problem"
    print(f"{source}: {_count(len(table), 'episode')} in {_count(len(table.scene_ids), 'scene')}, {found}")
    if absent:
        print(f"not tried, as {_count(len(absent), 'scene')} could not be opened: {absent[0]}")
    return 1 if problems else 0


def _open_navmesh(scene_id: str, header: JSONObject, source: str, options: argparse.Namespace, only: bool) -> NavMesh:
    """Navmesh of the scene that episodes name (``only`` this one), after the scene was held against the header."""
    from prnav.episodes import check_scenes, up_axis
    from prnav.navmesh import NavMeshSettings, load_navmesh, scene_navmesh
    from prnav.scene import load_scene, open_scene_set, resolve_scene

    if options.data is not None:
        place = open_scene_set(options.data, options.data_root).scene(scene_id)
        scene = load_scene(place)
        check_scenes(header, {scene_id: scene}, source)
        return scene_navmesh(place, scene, NavMeshSettings(), options.navmesh_from != "build")[0]
    found = resolve_scene(scene_id, options.data_root, options.scene, only=only)
    scene = load_scene(found, up_axis(header, options.up, source), root=options.data_root)
    check_scenes(header, {scene_id: scene}, source)
    return load_navmesh(scene)


def _info(options: argparse.Namespace) -> int:
    from prnav.episodes import difficulty

    table, header, source = _load(options)
    counts = np.bincount(table.scene_index, minlength=len(table.scene_ids))
    print(f"file         {source}")
    print(f"episodes     {len(table):,}")
    print(f"scenes       {len(table.scene_ids)}, {counts.min():,} to {counts.max():,} episodes each")
    for scene_id, count in list(zip(table.scene_ids, counts, strict=True))[:6]:
        print(f"             {scene_id}  {count:,}")
    if len(table.scene_ids) > 6:
        print(f"             ... {len(table.scene_ids) - 6} more")
    straight = np.linalg.norm(table.goal_position - table.start_position, axis=1)
    known = np.isfinite(table.geodesic_distance) & (straight > 0)
    if known.any():
        distances = table.geodesic_distance[known]
        print(f"geodesic     {_spread(distances)} m")
        print(f"to straight  {_spread(distances / straight[known])}")
        words = [difficulty(distance) for distance in distances]
        print(f"difficulty   {', '.join(f'{words.count(w):,} {w}' for w in ('easy', 'medium', 'hard'))}")
    made = header.get("prnav")
    if isinstance(made, dict):
        print(f"made by      prnav {made.get('version')}, seed {made.get('seed')}, up {made.get('up')}")
    return 0


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}{'s' * (number != 1)}"


def _spread(values: np.ndarray[Untyped, Untyped]) -> str:
    low, quarter, middle, three, high = np.percentile(values, [0, 25, 50, 75, 100])
    return f"{low:.2f} to {high:.2f}, quartiles {quarter:.2f} {middle:.2f} {three:.2f}, mean {values.mean():.2f}"
