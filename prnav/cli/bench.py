"""``prnav-bench``: speeds and errors, as lines or JSON."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence

from prnav.bench.table import available, format_rows, measure
from prnav.cli._common import Parser, amount, command


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    benchmarks = available()
    p = Parser(
        prog="prnav-bench",
        description="Measure this machine. Speeds of CPU code are per second of CPU time on one core.",
        epilog="benchmarks:\n" + "\n".join(f"  {name:<10}{text}" for name, text in benchmarks.items()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    p.add_argument("name", choices=tuple(benchmarks), metavar="NAME", help=", ".join(benchmarks))
    p.add_argument(
        "--seconds", type=amount(0.001, 1e5, "seconds"), metavar="S", help="how long each figure is measured"
    )
    p.add_argument("--device", metavar="DEVICE", help="cpu, cuda or cuda:N, for benchmarks that can use one (render)")
    p.add_argument("--scene", metavar="FILE", help="measure in this scene (render, accuracy, sim, navmesh)")
    p.add_argument("--up", choices=("y", "z"), default="y", help="up axis of a mesh file (default: y)")
    p.add_argument("--data-root", metavar="DIR", help="folder that its pictures may be in, above its own")
    p.add_argument("--json", action="store_true", help="print rows as JSON")
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_args(argv)
    from prnav.scene import load_scene

    scene = None if options.scene is None else load_scene(options.scene, options.up, root=options.data_root)
    rows = measure(options.name, options.seconds, options.device, scene)
    if options.json:
        print(json.dumps(rows, indent=1))
    else:
        print(format_rows(rows))
        print(f"measured on {rows[0]['device']} by prnav {rows[0]['version']}")
    return 0


if __name__ == "__main__":
    main()
