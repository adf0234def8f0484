"""prnav-scenes: list, generate, inspect, preview and export scenes."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from prnav.cli._common import add_data_options, check_data_options, command
from prnav.errors import NavMeshError, SceneError
from prnav.scene import DATA_SETS, SceneFile, SceneMesh, load_scene, open_scene_set, scene_ids

if TYPE_CHECKING:
    from prnav.episodes.check_files import Report
    from prnav.navmesh import NavMesh

_SPLITS = ("train", "val", "test")
_EYE = 1.25
_FOV = math.radians(90.0)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="prnav-scenes", description="Built-in homes and mesh files.")
    commands = parser.add_subparsers(dest="command", required=True)

    sub = commands.add_parser("list", help="ids of the built-in homes, or of a data set's scenes")
    sub.add_argument("--split", help="train, val or test; with --data a split folder of the set (hm3d)")
    _add_data(sub)
    sub.set_defaults(run=_list)

    sub = commands.add_parser("generate", help="make the built-in homes, keep them in the cache and check their hashes")
    sub.add_argument("--split", choices=_SPLITS)
    sub.add_argument("--manifest", type=Path, help="write the homes' hashes to this file instead of checking them")
    sub.set_defaults(run=_generate)

    sub = commands.add_parser("info", help="triangles, size, textures and walkable area of a scene")
    _add_source(sub)
    sub.set_defaults(run=_info)

    sub = commands.add_parser("preview", help="a picture of a scene: views from inside and a map")
    _add_source(sub)
    sub.add_argument("--out", type=Path, required=True, help="PNG file to write")
    sub.add_argument("--views", type=int, default=11, help="views from inside (default: 11)")
    sub.add_argument("--size", type=int, default=256, help="pixels of each (default: 256)")
    sub.add_argument("--seed", type=int, default=0, help="where the views are taken")
    sub.set_defaults(run=_preview)

    sub = commands.add_parser("export", help="write a scene as binary glTF")
    _add_source(sub)
    sub.add_argument("--out", type=Path, required=True, help=".glb file to write")
    sub.set_defaults(run=_export)

    sub = commands.add_parser("check", help="try every scene, navmesh and episode file of a folder, in one pass")
    sub.add_argument("folder", metavar="DIR", type=Path, help="folder to search; with --data the data root")
    sub.add_argument("--data", choices=DATA_SETS, help="only this data set under DIR, with its configs and navmeshes")
    sub.add_argument("--json", metavar="FILE", type=Path, help="also write what was found as JSON")
    sub.add_argument("--timeout", metavar="S", type=float, default=300.0, help="seconds for a file (default: 300)")
    sub.add_argument("--memory", metavar="GB", type=float, default=4.0, help="memory for a file (default: 4)")
    sub.add_argument("--workers", metavar="N", type=int, default=1, help="files at once (default: 1)")
    sub.set_defaults(run=_check)

    arguments = parser.parse_args(argv)
    status: int | None = arguments.run(arguments)
    return status or 0


def _add_source(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene", help="id of a built-in home (prhouses/test/00), a mesh file, or with --data a scene of the set"
    )
    parser.add_argument("--up", default="y", choices=("y", "z"), help="up axis of a file (default: y)")
    _add_data(parser)


def _add_data(parser: argparse.ArgumentParser) -> None:
    add_data_options(parser, "folder with scene_datasets/ in it")


def _place(arguments: argparse.Namespace) -> str | SceneFile:
    check_data_options(arguments)
    if arguments.data is None:
        scene: str = arguments.scene
        return scene
    return open_scene_set(arguments.data, arguments.data_root).scene(arguments.scene)


def _open(arguments: argparse.Namespace) -> SceneMesh:
    return load_scene(_place(arguments), arguments.up)


def _open_navmesh(arguments: argparse.Namespace, scene: SceneMesh) -> tuple[NavMesh, str]:
    """Navmesh of the scene that was asked for, and where it is from."""
    from prnav.navmesh import NavMeshSettings, load_navmesh, scene_navmesh

    place = _place(arguments)
    if isinstance(place, SceneFile):
        return scene_navmesh(place, scene, NavMeshSettings(), arguments.navmesh != "build")
    return load_navmesh(scene), "built"


def _check(arguments: argparse.Namespace) -> int:
    import json

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from prnav.episodes.check_files import CheckLimits, check_tasks, find_tasks
    from prnav.files import write_text
    from prnav.version import __version__

    limits = CheckLimits(arguments.timeout, arguments.memory, arguments.workers)
    tasks = find_tasks(arguments.folder, arguments.data)
    console = Console(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bars:
        task = bars.add_task("", total=len(tasks))

        def show(report: Report) -> None:
            bars.update(task, advance=1, description=report.path)
            if report.problem is not None:
                print(f"broken  {report.path}: {report.problem}")
            elif any("not here" in note for note in report.notes):
                print(f"note    {report.path}: {'; '.join(report.notes)}")

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
    from rich.progress import track

    from prnav.files import write_text
    from prnav.scene.houses.manifest import check_hash, manifest_text

    if arguments.manifest and arguments.split:
        raise SceneError("--manifest names all homes: leave out --split")
    names, hashes = _ids(arguments.split), {}
    for name in track(names, description="homes"):
        hashes[name] = load_scene(name).hash
        if not arguments.manifest:
            check_hash(name, hashes[name])
    if arguments.manifest:
        write_text(arguments.manifest, manifest_text(hashes))
        print(f"{len(names)} homes, hashes written to {arguments.manifest}")
    else:
        print(f"{len(names)} homes in the cache, hashes as in the manifest")


def _info(arguments: argparse.Namespace) -> None:
    scene = _open(arguments)
    low, high = scene.bounds
    size = " x ".join(f"{value:.2f}" for value in high - low)
    print(f"scene      {scene.name}")
    print(f"sha256     {scene.hash}")
    print(f"triangles  {len(scene.faces):,} ({len(scene.vertices):,} vertices)")
    print(f"size       {size} m (x, y, z), from ({', '.join(f'{value:.2f}' for value in low)})")
    print(f"textures   {scene.atlas.num_textures - 1}, {scene.atlas.texels.nbytes / 1e6:.1f} MB with mip levels")
    try:
        navmesh, origin = _open_navmesh(arguments, scene)
    except NavMeshError as error:
        print(f"walkable   nothing: {error}")
        return
    areas = sorted((island.area for island in navmesh.islands), reverse=True)
    share = 100.0 * areas[0] / sum(areas)
    print(f"walkable   {sum(areas):.1f} m2 on {len(areas)} islands, {share:.1f} % on the largest")
    print(f"navmesh    {origin}")
    if len(areas) > 1:
        print(f"islands    {', '.join(f'{area:.1f}' for area in areas[:8])}{' ...' if len(areas) > 8 else ''} m2")


def _export(arguments: argparse.Namespace) -> None:
    from prnav.scene.export import save_glb

    if arguments.out.suffix.lower() != ".glb":
        raise SceneError(f"{arguments.out}: the name must end in .glb")
    scene = _open(arguments)
    save_glb(scene, arguments.out)
    print(f"{arguments.out}: {len(scene.faces):,} triangles, {arguments.out.stat().st_size / 1e6:.1f} MB")


def _preview(arguments: argparse.Namespace) -> None:
    from PIL import Image

    from prnav.files import atomic_path

    if arguments.views < 1 or arguments.size < 16:
        raise SceneError(f"--views {arguments.views} --size {arguments.size}: at least 1 view of 16 pixels")
    if arguments.out.suffix.lower() != ".png":
        raise SceneError(f"{arguments.out}: the name must end in .png")
    scene = _open(arguments)
    navmesh, _ = _open_navmesh(arguments, scene)
    cells = [_map(navmesh, arguments.size), *_views(scene, navmesh, arguments.views, arguments.size, arguments.seed)]
    sheet = contact_sheet(cells)
    with atomic_path(arguments.out) as temporary:
        Image.fromarray(sheet).save(temporary, format="PNG")
    print(f"{arguments.out}: a map and {arguments.views} views")


def _views(scene: SceneMesh, navmesh: NavMesh, count: int, size: int, seed: int) -> NDArray[np.uint8]:
    """Views (count, size, size, 3) from places spread over the largest island, each towards the most open side."""
    from prnav.render import Renderer

    renderer = Renderer([scene])
    places = navmesh.random_points(max(400, 8 * count), seed)
    islands = navmesh.island_of(places)
    largest = max(range(len(navmesh.islands)), key=lambda island: navmesh.islands[island].area)
    places = _spread(places[islands == largest], count)
    yaws = np.arange(12) * (2.0 * math.pi / 12.0)
    pose = np.array([0.0, _EYE, 0.0, 0.0, math.radians(-8.0), 0.0, _FOV])
    # the open side is the one with the largest median depth in a small picture
    tries = len(places) * len(yaws)
    depth = renderer.depth(
        np.zeros(tries, dtype=np.int64),
        np.repeat(places, len(yaws), axis=0),
        np.tile(yaws, len(places)),
        np.broadcast_to(pose, (tries, 1, 7)),
        size=8,
    )
    capped = np.median(np.minimum(depth, 30.0).reshape(len(places), len(yaws), -1), axis=2)
    best = yaws[np.argmax(capped, axis=1)]
    designs = np.broadcast_to(pose, (len(places), 1, 7))
    images = renderer.read(np.zeros(len(places), dtype=np.int64), places, best, designs, grid=size)
    return np.rint(images[:, 0] * 255.0).astype(np.uint8)


def _spread(places: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """``count`` places far from each other: each the farthest from those before it."""
    chosen = [0]
    distance = np.linalg.norm(places - places[0], axis=1)
    while len(chosen) < min(count, len(places)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return places[chosen]


def _map(navmesh: NavMesh, size: int) -> NDArray[np.uint8]:
    """The walkable floor at the lowest level, white on grey, (size, size, 3)."""
    low, high = navmesh.bounds
    scale = float(max(high[0] - low[0], high[2] - low[2])) / (size - 8)
    floor = float(low[1]) + 0.1
    walkable = navmesh.topdown(floor, scale)
    picture = np.full((size, size, 3), 70, dtype=np.uint8)
    rows, columns = min(walkable.shape[0], size), min(walkable.shape[1], size)
    top, left = (size - rows) // 2, (size - columns) // 2
    picture[top : top + rows, left : left + columns][walkable[:rows, :columns]] = 245
    return picture


def contact_sheet(cells: Sequence[NDArray[Any]], gap: int = 4) -> NDArray[np.uint8]:
    """Pictures of one size side by side in a grid that is wider than tall."""
    columns = math.ceil(math.sqrt(len(cells) * 4 / 3))
    rows = math.ceil(len(cells) / columns)
    height, width = cells[0].shape[:2]
    sheet = np.zeros((rows * (height + gap) + gap, columns * (width + gap) + gap, 3), dtype=np.uint8)
    for k, cell in enumerate(cells):
        y, x = gap + k // columns * (height + gap), gap + k % columns * (width + gap)
        sheet[y : y + height, x : x + width] = cell
    return sheet
