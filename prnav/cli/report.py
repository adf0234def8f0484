"""``prnav-report``: one static page about one or more runs."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from prnav.cli._common import Parser, command
from prnav.files import check_writable, write_text


def parser() -> argparse.ArgumentParser:
    """The command's arguments."""
    p = Parser(
        prog="prnav-report",
        description="Write one HTML page about runs: results, learning curves, trajectories. It opens from disk.",
    )
    p.add_argument("runs", nargs="+", metavar="RUN", help="run directory (of prnav-train or prnav-eval)")
    p.add_argument("--out", metavar="HTML", help="page to write (default: report.html in the first run)")
    p.add_argument("--title", help="heading of the page")
    p.add_argument(
        "--video", action="store_true", help="also write films (MP4) of the worst, best and a random episode of each"
    )
    return p


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    options = parser().parse_args(argv)
    from prnav.report.page import make_page, read_run

    path = Path(options.out) if options.out else Path(options.runs[0]) / "report.html"
    runs = [read_run(run) for run in options.runs]
    check_writable(path)
    if options.video:
        from prnav.catalog import task_spec
        from prnav.evaluate.records import load_traces

        for evaluation in (evaluation for run in runs for evaluation in run.evaluations):
            for film in task_spec(evaluation.header["task"]).pictures.film(evaluation, load_traces(evaluation)):
                print(f"film  {film}")
    page = make_page(runs, options.title)
    write_text(path, page)
    print(f"page  {path}")
    return 0


if __name__ == "__main__":
    main()
