"""prnav-scenes: list, generate, inspect, preview and export scenes."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from prnav.cli._common import command
from prnav.cli._scene_views import contact_sheet, floor_levels, floor_map, views
from prnav.errors import NavMeshError, SceneError
from prnav.scene import load_scene, scene_ids

_SPLITS = ("train", "val", "test")


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
    sub.add_argument("--workers", type=int, default=0, help="processes (default: one per core)")
    sub.add_argument("--manifest", type=Path, help="write the homes' hashes to this file instead of checking them")
    sub.set_defaults(run=_generate)

    sub = commands.add_parser("info", help="triangles, size, textures and walkable area of a scene")
    _add_source(sub)
    sub.set_defaults(run=_info)

    sub = commands.add_parser("preview", help="a picture of a scene: views from inside and a map of each floor")
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

    sub = commands.add_parser("card", help="pictures and tables of the built-in homes' data card")
    sub.add_argument("--out", type=Path, required=True, help="folder to write the pictures to")
    sub.add_argument("--split", choices=_SPLITS, help="default: all")
    sub.add_argument("--size", type=int, default=320, help="pixels of each picture on the sheet (default: 320)")
    sub.set_defaults(run=_card)

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
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from prnav.files import write_text
    from prnav.scene.houses.manifest import check_hashes, manifest_text
    from prnav.scene.houses.pool import make_homes, usable_cores

    if arguments.manifest and arguments.split:
        raise SceneError("--manifest names all homes: leave out --split")
    if arguments.workers < 0:
        raise SceneError(f"--workers {arguments.workers}: at least 1, or 0 for one per core")
    names, hashes = _ids(arguments.split), {}
    with Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()) as bars:
        task = bars.add_task("homes", total=len(names))
        for name, found in make_homes(names, arguments.workers or usable_cores()):
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
    scene = load_scene(arguments.scene, arguments.up)
    low, high = scene.bounds
    size = " x ".join(f"{value:.2f}" for value in high - low)
    texels = scene.atlas.texels.nbytes
    print(f"scene      {scene.name}")
    print(f"sha256     {scene.hash}")
    print(f"triangles  {len(scene.faces):,} ({len(scene.vertices):,} vertices)")
    print(f"size       {size} m (x, y, z), from ({', '.join(f'{value:.2f}' for value in low)})")
    print(f"textures   {scene.atlas.num_textures - 1}, {texels:,} bytes ({texels / 1e6:.1f} MB) with mip levels")
    _info_plan(arguments.scene)
    from prnav.navmesh import load_navmesh

    try:
        navmesh = load_navmesh(scene)
    except NavMeshError as error:
        print(f"walkable   nothing: {error}")
        return
    areas = sorted((island.area for island in navmesh.islands), reverse=True)
    share = 100.0 * areas[0] / sum(areas)
    print(f"floors at  {', '.join(f'{level:.1f}' for level in floor_levels(navmesh))} m")
    print(f"walkable   {sum(areas):.1f} m2 on {len(areas)} islands, {share:.1f} % on the largest")
    if len(areas) > 1:
        print(f"islands    {', '.join(f'{area:.1f}' for area in areas[:8])}{' ...' if len(areas) > 8 else ''} m2")


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
    maps = [floor_map(navmesh, level, arguments.size) for level in floor_levels(navmesh)]
    sheet = contact_sheet([*maps, *views(scene, navmesh, arguments.views, arguments.size, arguments.seed)])
    with atomic_path(arguments.out) as temporary:
        Image.fromarray(sheet).save(temporary, format="PNG")
    print(f"{arguments.out}: {'a map' if len(maps) == 1 else f'{len(maps)} maps'} and {arguments.views} views")


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


def _card(arguments: argparse.Namespace) -> None:
    from rich.progress import track

    from prnav.cli._scene_card import card_table, episode_lines, measure_homes, write_figure, write_sheet
    from prnav.episodes import load_builtin_table

    if arguments.size < 16:
        raise SceneError(f"--size {arguments.size}: at least 16 pixels")
    rows = measure_homes(_ids(arguments.split), lambda names: track(names, description="homes"))
    splits = [arguments.split] if arguments.split else list(_SPLITS)
    tables = {split: load_builtin_table(split, per_scene=56)[0] for split in splits}
    write_sheet(arguments.out / "prhouses.png", arguments.size)
    write_figure(arguments.out / "prhouses-distributions.png", rows, tables)
    print("Lowest, median and highest:\n")
    print(card_table(rows))
    print()
    print(episode_lines(tables))
    print(f"\n{arguments.out / 'prhouses.png'}, {arguments.out / 'prhouses-distributions.png'}")
