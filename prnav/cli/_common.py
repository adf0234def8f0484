"""What all commands share: one way to end on an error, and one console."""

from __future__ import annotations

import argparse
import functools
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from prnav.errors import ConfigError, PrnavError, SceneNote

Main = Callable[[Sequence[str] | None], int | None]


def command(main: Main) -> Callable[..., int]:
    """Turn ``main(argv)`` into an entry point.

    A :class:`PrnavError` becomes one line on stderr and exit status 2; Ctrl-C exits with 130, a closed pipe with 0.
    Anything else is a bug of ours and keeps its traceback. Called with an argument list, the entry point returns the
    status; called by the shell, it exits with it.
    """

    @functools.wraps(main)
    def entry(argv: Sequence[str] | None = None) -> int:
        status = _run(main, argv)
        if argv is None:
            sys.exit(status)
        return status

    return entry


def add_data_options(parser: argparse.ArgumentParser | argparse._ArgumentGroup, root_help: str) -> None:
    """Add ``--data``, ``--data-root`` and ``--navmesh-from``, which all commands that open scenes share."""
    from prnav.scene.datasets import DATA_SETS

    parser.add_argument("--data", choices=DATA_SETS, help="data set in Habitat's layout under --data-root")
    parser.add_argument("--data-root", metavar="DIR", help=root_help)
    parser.add_argument(
        "--navmesh-from",
        choices=("file", "build"),
        help="with --data: take the .navmesh beside a scene where there is one, or build all (default: file)",
    )


def check_data_options(options: argparse.Namespace) -> None:
    """Refuse ``--data`` without ``--data-root``, and ``--navmesh-from`` without ``--data``."""
    if options.data is not None and options.data_root is None:
        raise ConfigError(f"--data {options.data} needs --data-root DIR, the folder with scene_datasets/ in it")
    if options.data is None and options.navmesh_from is not None:
        raise ConfigError(
            "--navmesh-from chooses among the files of a data set: give --data NAME and --data-root DIR too"
        )


def positive(text: str) -> int:
    """An option's whole number of at least 1."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not at least 1")
    return value


def _show_warning(name: str, show: Callable[..., None], message: Any, category: type[Warning], *place: Any) -> None:
    """Print a note on a scene as one line, once, and anything else as Python does."""
    if not issubclass(category, SceneNote):
        show(message, category, *place)
    elif (text := " ".join(str(message).split())) not in _SHOWN:
        _SHOWN.add(text)
        print(f"{name}: note: {text}", file=sys.stderr)


_SHOWN: set[str] = set()


def _run(main: Main, argv: Sequence[str] | None) -> int:
    name = os.path.basename(sys.argv[0]) if argv is None else "prnav"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", SceneNote)
            warnings.showwarning = functools.partial(_show_warning, name, warnings.showwarning)
            return main(argv) or 0
    except PrnavError as error:
        print(f"{name}: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{name}: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
