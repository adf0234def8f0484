"""``prnav``: what concerns the whole installation."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from rich import box
from rich.markup import escape
from rich.table import Table

from prnav.cli._common import Parser, Screen, command
from prnav.version import __version__

_MARKS = {"ok": "[green]ok[/]", "missing": "[yellow]not there[/]", "broken": "[red]broken[/]"}


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = Parser(
        prog="prnav",
        description="Indoor navigation with photoreceptors.",
        epilog="Other commands: prnav-train, prnav-eval, prnav-report, prnav-episodes, prnav-scenes, prnav-design, "
        "prnav-bench; each has --help.",
    )
    p.add_argument("--version", action="version", version=f"prnav {__version__}")
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("doctor", help="what works on this machine, and how to get what does not").set_defaults(
        run=_doctor
    )
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_args(argv)
    status: int = options.run()
    return status


def _doctor() -> int:
    from prnav.cli._doctor import examine, healthy

    with Screen(stderr=True).status("looking around"):
        findings = examine()
    table = Table(box=box.SIMPLE_HEAD, title=f"prnav {__version__}", title_justify="left", title_style="bold")
    table.add_column("what", no_wrap=True)
    table.add_column("state", no_wrap=True)
    table.add_column("found", overflow="fold")
    table.add_column("how to get it", overflow="fold")
    for finding in findings:
        mark = _MARKS["broken" if finding.required and finding.status != "ok" else finding.status]
        table.add_row(finding.name, mark, escape(finding.detail), escape(finding.remedy))
    Screen().print(table, highlight=False)
    if healthy(findings):
        print("Everything that is required works.")
        return 0
    broken = ", ".join(finding.name for finding in findings if finding.required and finding.status != "ok")
    print(f"prnav doctor: required and not working: {broken}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    main()
