"""prnav-scenes: list, generate, inspect, preview and export scenes."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from prnav.aliases import JSONObject
from prnav.cli._common import (
    Parser,
    Screen,
    add_data_options,
    amount,
    check_data_options,
    command,
    natural,
    pixels,
    whole_number,
    workers,
)
from prnav.cli._scene_views import contact_sheet, floor_levels, floor_map, views
from prnav.errors import NavMeshError, SceneError, SceneNote
from prnav.scene import DATA_SETS, SceneFile, SceneMesh, load_scene, open_scene_set, scene_ids

if TYPE_CHECKING:
    from prnav.episodes.check_files import Report
    from prnav.navmesh import NavMesh

_SPLITS = ("train", "val", "test")


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = Parser(prog="prnav-scenes", description="Built-in homes and mesh files.")
    commands = p.add_subparsers(dest="command", required=True)

    sub = commands.add_parser("list", help="ids of the built-in homes, or of a data set's scenes")
    sub.add_argument("--split", help="train, val or test; with --data a split folder of the set (hm3d)")
    _add_data(sub)
    sub.set_defaults(run=_list)

    sub = commands.add_parser("generate", help="make the built-in homes, keep them in the cache and check their hashes")
    sub.add_argument("--split", choices=_SPLITS, help="homes of one split (default: all)")
    sub.add_argument("--workers", type=whole_number(0, 1024), default=0, help="processes (default: one per core)")
    sub.add_argument("--manifest", type=Path, help="write the homes' hashes to this file instead of checking them")
    sub.set_defaults(run=_generate)

    sub = commands.add_parser("info", help="triangles, size, textures and walkable area of a scene")
    _add_source(sub)
    sub.add_argument("--json", metavar="FILE", type=Path, help="also write it as JSON")
    sub.set_defaults(run=_info)

    sub = commands.add_parser("preview", help="a picture of a scene: views from inside and a map of each floor")
    _add_source(sub)
    sub.add_argument("--out", type=Path, required=True, help="PNG file to write")
    sub.add_argument("--views", type=whole_number(1, 256), default=11, help="views from inside (default: 11)")
    sub.add_argument("--size", type=pixels, default=256, help="pixels of each (default: 256)")
    sub.add_argument("--seed", type=natural, default=0, help="where the views are taken, or where the goal is")
    sub.add_argument("--navmesh", action="store_true", help="draw the floor instead: islands, a path, distances")
    sub.set_defaults(run=_preview)

    sub = commands.add_parser("export", help="write a scene as binary glTF")
    _add_source(sub)
    sub.add_argument("--out", type=Path, required=True, help=".glb file to write")
    sub.set_defaults(run=_export)

    sub = commands.add_parser("card", help="pictures and tables of the built-in homes' data card")
    sub.add_argument("--out", type=Path, required=True, help="folder to write the pictures to")
    sub.add_argument("--split", choices=_SPLITS, help="homes of one split (default: all)")
    sub.add_argument("--size", type=pixels, default=320, help="pixels of each picture on the sheet (default: 320)")
    sub.set_defaults(run=_card)

    sub = commands.add_parser("check", help="try every scene, navmesh and episode file of a folder, in one pass")
    sub.add_argument("folder", metavar="DIR", type=Path, help="folder to search; with --data the data root")
    sub.add_argument("--data", choices=DATA_SETS, help="only this data set under DIR, with its configs and navmeshes")
    sub.add_argument("--data-root", metavar="DIR", help="folder that pictures of meshes may be in, above their own")
    sub.add_argument("--json", metavar="FILE", type=Path, help="also write what was found as JSON")
    sub.add_argument(
        "--timeout",
        metavar="S",
        type=amount(0.001, 1e6, "seconds"),
        default=300.0,
        help="seconds for a file (default: 300)",
    )
    sub.add_argument(
        "--memory",
        metavar="GB",
        type=amount(0.01, 1e5, "gigabytes"),
        default=4.0,
        help="memory for a file (default: 4)",
    )
    sub.add_argument("--workers", metavar="N", type=workers, default=1, help="files at once (default: 1)")
    sub.set_defaults(run=_check)
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    arguments = parser().parse_args(argv)
    status: int | None = arguments.run(arguments)
    return status or 0


def _add_source(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene", help="id of a built-in home (prhouses/test/00), a mesh file, or with --data a scene of the set"
    )
    parser.add_argument("--up", default="y", choices=("y", "z"), help="up axis of a file (default: y)")
    _add_data(parser)


def _add_data(parser: argparse.ArgumentParser) -> None:
    add_data_options(
        parser, "with --data the folder with scene_datasets/ in it, else one that a mesh's pictures are in"
    )


def _place(arguments: argparse.Namespace) -> str | SceneFile:
    check_data_options(arguments)
    if arguments.data is None:
        scene: str = arguments.scene
        return scene
    return open_scene_set(arguments.data, arguments.data_root).scene(arguments.scene)


def _open(arguments: argparse.Namespace) -> SceneMesh:
    root = None if arguments.data is not None else arguments.data_root
    return load_scene(_place(arguments), arguments.up, root=root)


def _open_navmesh(arguments: argparse.Namespace, scene: SceneMesh) -> tuple[NavMesh, str]:
    """Navmesh of the scene that was asked for, and where it is from."""
    from prnav.navmesh import NavMeshSettings, load_navmesh, scene_navmesh

    place = _place(arguments)
    if isinstance(place, SceneFile):
        return scene_navmesh(place, scene, NavMeshSettings(), arguments.navmesh_from != "build")
    return load_navmesh(scene), "built"


def _check(arguments: argparse.Namespace) -> int:
    import json

    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

    from prnav.cli._progress import LineProgress
    from prnav.episodes.check_files import CheckLimits, check_tasks, find_tasks
    from prnav.files import check_writable, write_text
    from prnav.version import __version__

    if arguments.json is not None:
        check_writable(arguments.json)
    limits = CheckLimits(arguments.timeout, arguments.memory, arguments.workers, arguments.data_root)
    tasks = find_tasks(arguments.folder, arguments.data)
    console = Screen(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with LineProgress(*columns, console=console) as bars:
        task = bars.add_task("", total=len(tasks))

        def show(report: Report) -> None:
            bars.update(task, advance=1, description=report.path)
            if report.problem is not None:
                print(f"broken  {report.path}: {report.problem}")
            elif report.warnings and report.kind == "episodes":
                print(f"note    {report.path}: {'; '.join(report.notes)}")
            else:
                for warning in report.warnings:
                    print(f"note    {report.path}: {warning}")

        reports = check_tasks(tasks, arguments.folder, arguments.data, limits, show)
    summary = _summary(reports)
    if arguments.json is not None:
        found = {"version": __version__, "folder": str(arguments.folder), "data": arguments.data, "summary": summary}
        write_text(arguments.json, json.dumps(found | {"files": [r.to_record() for r in reports]}, indent=1) + "\n")
    for kind, (good, broken) in summary.items():
        print(f"{kind:9} {good + broken:6,} tried, {broken:,} broken")
    return 1 if any(broken for _, broken in summary.values()) else 0


def _summary(reports: Sequence[Report]) -> dict[str, tuple[int, int]]:
    """Good and broken files by kind, those kinds that there are."""
    kinds = dict.fromkeys(sorted(report.kind for report in reports))
    return {
        kind: (
            sum(report.kind == kind and report.problem is None for report in reports),
            sum(report.kind == kind and report.problem is not None for report in reports),
        )
        for kind in kinds
    }


def _ids(split: str | None) -> list[str]:
    return [name for one in ([split] if split else _SPLITS) for name in scene_ids(one)]


def _list(arguments: argparse.Namespace) -> None:
    check_data_options(arguments)
    if arguments.data is not None:
        for name in open_scene_set(arguments.data, arguments.data_root).scene_ids(arguments.split):
            print(name)
        return
    from prnav.scene.houses.manifest import house_ids

    seeds = house_ids()
    for name in _ids(arguments.split):
        print(f"{name}  seed {seeds[name]}")


def _generate(arguments: argparse.Namespace) -> None:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from prnav.files import write_text
    from prnav.resources import available_cores
    from prnav.scene.houses.manifest import check_hashes, manifest_text
    from prnav.scene.houses.pool import make_homes

    if arguments.manifest and arguments.split:
        raise SceneError("--manifest names all homes: leave out --split")
    if arguments.workers < 0:
        raise SceneError(f"--workers {arguments.workers}: at least 1, or 0 for one per core")
    names, hashes = _ids(arguments.split), {}
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    console = Screen(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bars:
        task = bars.add_task("homes", total=len(names))
        for name, found in make_homes(names, arguments.workers or available_cores()):
            hashes[name] = found
            if not arguments.manifest:
                check_hashes(name, found)
            bars.advance(task)
    if arguments.manifest:
        write_text(arguments.manifest, manifest_text(hashes))
        print(f"{len(names)} homes, hashes written to {arguments.manifest}")
    else:
        print(f"{len(names)} homes in the cache, hashes as in the manifest")


def _info(arguments: argparse.Namespace) -> None:
    from prnav.navmesh.extent import extent_doubts

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneNote)  # printed below
        scene = _open(arguments)
    low, high = scene.bounds
    size = " x ".join(f"{value:.2f}" for value in high - low)
    texels = scene.atlas.texels.nbytes
    print(f"scene      {scene.name}")
    print(f"sha256     {scene.hash}")
    print(f"triangles  {len(scene.faces):,} ({len(scene.vertices):,} vertices)")
    print(f"size       {size} m (x, y, z), from ({', '.join(f'{value:.2f}' for value in low)})")
    print(f"textures   {scene.atlas.num_textures - 1}, {texels:,} bytes ({texels / 1e6:.1f} MB) with mip levels")
    notes = [*scene.notes, *extent_doubts(scene)]
    for note in notes:
        print(f"note       {note}")
    _info_plan(arguments.scene)
    facts: JSONObject = {
        "name": scene.name,
        "sha256": scene.hash,
        "triangles": len(scene.faces),
        "vertices": len(scene.vertices),
        "bounds": scene.bounds.tolist(),
        "textures": scene.atlas.num_textures - 1,
        "notes": notes,
        "walkable": None,
    }
    try:
        navmesh, origin = _open_navmesh(arguments, scene)
    except NavMeshError as error:
        print(f"walkable   nothing: {error}")
        _write_json(arguments.json, facts | {"problem": str(error)})
        return
    facts["walkable"] = [island.area for island in navmesh.islands]
    _write_json(arguments.json, facts | {"navmesh": origin})
    areas = sorted((island.area for island in navmesh.islands), reverse=True)
    share = 100.0 * areas[0] / sum(areas)
    print(f"floors at  {', '.join(f'{level:.1f}' for level in floor_levels(navmesh))} m")
    print(f"walkable   {sum(areas):.1f} m2 on {len(areas)} islands, {share:.1f} % on the largest")
    print(f"navmesh    {origin}")
    if len(areas) > 1:
        print(f"islands    {', '.join(f'{area:.1f}' for area in areas[:8])}{' ...' if len(areas) > 8 else ''} m2")


def _write_json(path: Path | None, facts: JSONObject) -> None:
    import json

    from prnav.files import write_text

    if path is not None:
        write_text(path, json.dumps(facts, indent=1) + "\n")


def _info_plan(name: str) -> None:
    """What the plan of a built-in home says; nothing about files."""
    from prnav.scene.houses import count_furniture, describe_house
    from prnav.scene.houses.manifest import house_ids

    if name not in house_ids():
        return
    facts = describe_house(house_ids()[name])
    print(f"storeys    {facts.storeys}")
    print(f"rooms      {facts.rooms} on {facts.floor_area:.1f} m2 inside the outer walls")
    furniture = count_furniture(house_ids()[name])
    print(f"furniture  {sum(furniture.values())} pieces of {len(furniture)} kinds")
    print(f"doors shut {', '.join(f'{a} to {b}' for a, b in facts.closed_doors) or 'none'}")
    print(f"shut off   {', '.join(facts.shut_off) or 'no room'}")


def _export(arguments: argparse.Namespace) -> None:
    from prnav.scene.export import save_glb

    if arguments.out.suffix.lower() != ".glb":
        raise SceneError(f"{arguments.out}: the name must end in .glb")
    scene = _open(arguments)
    save_glb(scene, arguments.out)
    print(f"{arguments.out}: {len(scene.faces):,} triangles, {arguments.out.stat().st_size / 1e6:.1f} MB")


def _preview(arguments: argparse.Namespace) -> None:
    from PIL import Image

    from prnav.files import atomic_path, check_writable

    if arguments.views < 1 or arguments.size < 16:
        raise SceneError(f"--views {arguments.views} --size {arguments.size}: at least 1 view of 16 pixels")
    if arguments.out.suffix.lower() != ".png":
        raise SceneError(f"{arguments.out}: the name must end in .png")
    check_writable(arguments.out)
    if arguments.navmesh:
        _preview_navmesh(arguments)
        return
    scene = _open(arguments)
    navmesh, _ = _open_navmesh(arguments, scene)
    maps = [floor_map(navmesh, level, arguments.size) for level in floor_levels(navmesh)]
    sheet = contact_sheet([*maps, *views(scene, navmesh, arguments.views, arguments.size, arguments.seed)])
    with atomic_path(arguments.out) as temporary:
        Image.fromarray(sheet).save(temporary, format="PNG")
    print(f"{arguments.out}: {'a map' if len(maps) == 1 else f'{len(maps)} maps'} and {arguments.views} views")


def _preview_navmesh(arguments: argparse.Namespace) -> None:
    from prnav.cli._navmesh_picture import save_navmesh_picture
    from prnav.navmesh import NavMesh

    if arguments.seed < 0:
        raise SceneError(f"--seed {arguments.seed}: at least 0")
    if arguments.scene.lower().endswith(".navmesh"):
        navmesh = NavMesh.load(arguments.scene)
    else:
        navmesh, _ = _open_navmesh(arguments, _open(arguments))
    title = arguments.scene if arguments.scene in _ids(None) else Path(arguments.scene).name
    storeys = save_navmesh_picture(navmesh, title, arguments.out, arguments.seed)
    print(f"{arguments.out}: {storeys} storey{'s' * (storeys != 1)}, {len(navmesh.islands)} islands")


def _card(arguments: argparse.Namespace) -> None:
    from rich.progress import Progress

    from prnav.cli._scene_card import card_table, episode_lines, measure_homes, write_figure, write_sheet
    from prnav.episodes import load_builtin_table

    if arguments.size < 16:
        raise SceneError(f"--size {arguments.size}: at least 16 pixels")
    console = Screen(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bars:
        rows = measure_homes(_ids(arguments.split), lambda names: bars.track(names, description="homes"))
    splits = [arguments.split] if arguments.split else list(_SPLITS)
    tables = {split: load_builtin_table(split, per_scene=56)[0] for split in splits}
    write_sheet(arguments.out / "prhouses.png", arguments.size)
    write_figure(arguments.out / "prhouses-distributions.png", rows, tables)
    print("Lowest, median and highest:\n")
    print(card_table(rows))
    print()
    print(episode_lines(tables))
    print(f"\n{arguments.out / 'prhouses.png'}, {arguments.out / 'prhouses-distributions.png'}")
