"""``prnav-design``: list sensor designs and look at them."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from prnav.cli._common import command


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = argparse.ArgumentParser(prog="prnav-design", description="Sensor designs: the library, and pictures of them.")
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    listing = commands.add_parser("list", help="the designs that travel with the package")
    listing.set_defaults(run=_list)
    show = commands.add_parser("show", help="draw a design on its body, and what each of its receptors sees")
    show.add_argument("design", help="name from the library, or a design file")
    show.add_argument("--out", required=True, metavar="PNG", help="picture to write")
    show.add_argument("--scene", default="prhouses/test/00", help="built-in home or mesh file to look at")
    show.add_argument("--up", choices=("y", "z"), default="y", help="up axis of a mesh file (default: y)")
    show.add_argument("--seed", type=int, default=0, help="another seed looks from another place (default: 0)")
    show.add_argument("--size", type=int, default=256, help="pixels of a sensor's picture (default: 256)")
    show.add_argument("--rays", type=int, default=256, help="rays per receptor, a square number (default: 256)")
    show.add_argument("--body-only", action="store_true", help="leave out what it sees")
    show.set_defaults(run=_show)
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_args(argv)
    options.run(options)
    return 0


def _list(options: argparse.Namespace) -> None:
    from prnav.sensors import library_designs, load_design

    table = Table()
    for column in ("design", "sensors", "grid"):
        table.add_column(column, justify="left" if column == "design" else "right", no_wrap=True)
    table.add_column("idea", overflow="fold")
    for name in library_designs():
        design = load_design(name)
        table.add_row(name, str(design.num_sensors), f"{design.grid} x {design.grid}", design.description)
    Console().print(table)


def _show(options: argparse.Namespace) -> None:
    from prnav.report.designs import draw_design, see, telling_pose
    from prnav.report.style import save_png
    from prnav.sensors import load_design

    design = load_design(options.design)
    sight, place = None, ""
    if not options.body_only:
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


if __name__ == "__main__":
    main()
