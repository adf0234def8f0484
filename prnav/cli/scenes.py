"""prnav-scenes: list, generate, inspect, preview and export scenes."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from prnav.cli._common import command
from prnav.errors import NavMeshError, SceneError
from prnav.scene import SceneMesh, load_scene, scene_ids

if TYPE_CHECKING:
    from prnav.navmesh import NavMesh

_SPLITS = ("train", "val", "test")
_EYE = 1.25
_FOV = math.radians(90.0)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="prnav-scenes", description="Built-in homes and mesh files.")
    commands = parser.add_subparsers(dest="command", required=True)

    sub = commands.add_parser("list", help="ids of the built-in homes")
    sub.add_argument("--split", choices=_SPLITS)
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
    sub.add_argument("--seed", type=int, default=0, help="where the views are taken, or where the goal is")
    sub.add_argument("--navmesh", action="store_true", help="draw the floor instead: islands, a path, distances")
    sub.set_defaults(run=_preview)

    sub = commands.add_parser("export", help="write a scene as binary glTF")
    _add_source(sub)
    sub.add_argument("--out", type=Path, required=True, help=".glb file to write")
    sub.set_defaults(run=_export)

    arguments = parser.parse_args(argv)
    arguments.run(arguments)
    return 0


def _add_source(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", help="id of a built-in home (prhouses/test/00) or a mesh file")
    parser.add_argument("--up", default="y", choices=("y", "z"), help="up axis of a file (default: y)")


def _ids(split: str | None) -> list[str]:
    return [name for one in ([split] if split else _SPLITS) for name in scene_ids(one)]


def _list(arguments: argparse.Namespace) -> None:
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
    scene = load_scene(arguments.scene, arguments.up)
    low, high = scene.bounds
    size = " x ".join(f"{value:.2f}" for value in high - low)
    print(f"scene      {scene.name}")
    print(f"sha256     {scene.hash}")
    print(f"triangles  {len(scene.faces):,} ({len(scene.vertices):,} vertices)")
    print(f"size       {size} m (x, y, z), from ({', '.join(f'{value:.2f}' for value in low)})")
    print(f"textures   {scene.atlas.num_textures - 1}, {scene.atlas.texels.nbytes / 1e6:.1f} MB with mip levels")
    from prnav.navmesh import load_navmesh

    try:
        navmesh = load_navmesh(scene)
    except NavMeshError as error:
        print(f"walkable   nothing: {error}")
        return
    areas = sorted((island.area for island in navmesh.islands), reverse=True)
    share = 100.0 * areas[0] / sum(areas)
    print(f"walkable   {sum(areas):.1f} m2 on {len(areas)} islands, {share:.1f} % on the largest")
    if len(areas) > 1:
        print(f"islands    {', '.join(f'{area:.1f}' for area in areas[:8])}{' ...' if len(areas) > 8 else ''} m2")


def _export(arguments: argparse.Namespace) -> None:
    from prnav.scene.export import save_glb

    if arguments.out.suffix.lower() != ".glb":
        raise SceneError(f"{arguments.out}: the name must end in .glb")
    scene = load_scene(arguments.scene, arguments.up)
    save_glb(scene, arguments.out)
    print(f"{arguments.out}: {len(scene.faces):,} triangles, {arguments.out.stat().st_size / 1e6:.1f} MB")


def _preview(arguments: argparse.Namespace) -> None:
    from PIL import Image

    from prnav.files import atomic_path
    from prnav.navmesh import load_navmesh

    if arguments.views < 1 or arguments.size < 16:
        raise SceneError(f"--views {arguments.views} --size {arguments.size}: at least 1 view of 16 pixels")
    if arguments.out.suffix.lower() != ".png":
        raise SceneError(f"{arguments.out}: the name must end in .png")
    if arguments.navmesh:
        _preview_navmesh(arguments)
        return
    scene = load_scene(arguments.scene, arguments.up)
    navmesh = load_navmesh(scene)
    cells = [_map(navmesh, arguments.size), *_views(scene, navmesh, arguments.views, arguments.size, arguments.seed)]
    sheet = contact_sheet(cells)
    with atomic_path(arguments.out) as temporary:
        Image.fromarray(sheet).save(temporary, format="PNG")
    print(f"{arguments.out}: a map and {arguments.views} views")


def _preview_navmesh(arguments: argparse.Namespace) -> None:
    from prnav.cli._navmesh_picture import save_navmesh_picture
    from prnav.navmesh import NavMesh, load_navmesh

    if arguments.seed < 0:
        raise SceneError(f"--seed {arguments.seed}: at least 0")
    if arguments.scene.lower().endswith(".navmesh"):
        navmesh = NavMesh.load(arguments.scene)
    else:
        navmesh = load_navmesh(load_scene(arguments.scene, arguments.up))
    title = arguments.scene if arguments.scene in _ids(None) else Path(arguments.scene).name
    storeys = save_navmesh_picture(navmesh, title, arguments.out, arguments.seed)
    print(f"{arguments.out}: {storeys} storey{'s' * (storeys != 1)}, {len(navmesh.islands)} islands")


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
