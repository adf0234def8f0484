"""What all commands share: one way to end on an error, one parser, one console.

**Exit statuses.** 0: what was asked for is done; also where the reader of a pipe went away. 1: a check was made, and
something is wrong with what was checked (``check``, ``doctor``). 2: an error, told in one line on stderr. 130: Ctrl-C.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import functools
import io
import math
import os
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from typing import NoReturn

from rich.console import Console

from prnav.aliases import Untyped
from prnav.errors import ConfigError, PrnavError, SceneNote

Main = Callable[[Sequence[str] | None], int | None]

DEBUG = "--debug"
"""Option that all commands understand anywhere: errors keep their tracebacks."""

LONGEST = 600
"""Most characters of an error's line."""


def command(main: Main) -> Callable[..., int]:
    """Turn ``main(argv)`` into an entry point that ends as this module's text says, whatever happens in it.

    Called with an argument list, the entry point returns the status; called by the shell, it exits with it.
    """

    @functools.wraps(main)
    def entry(argv: Sequence[str] | None = None) -> int:
        words = list(sys.argv[1:] if argv is None else argv)
        own = words[: words.index("--")] if "--" in words else words
        debug = DEBUG in own
        status = _run(main, [word for word in own if word != DEBUG] + words[len(own) :], argv is None, debug)
        if argv is None:
            sys.exit(status)
        return status

    return entry


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def __init__(self, *arguments: Untyped, **options: Untyped) -> None:
        super().__init__(*arguments, **options)
        self.add_argument(DEBUG, action="store_true", help="show where an error comes from")

    def print_help(self, file: Untyped = None) -> None:
        """Print help; where that cannot be, :func:`command` says so."""
        (file or sys.stdout).write(self.format_help())

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and exit with status 2."""
        self.exit(2, f"{one_line(f'{self.prog}: error: {message}')} (see {self.prog} --help)\n")


class Screen(Console):
    """A console that prints text as it is, on which a closed pipe is an ordinary :class:`BrokenPipeError`."""

    def __init__(self, **options: Untyped) -> None:
        super().__init__(**{"markup": False, "emoji": False, "highlight": False, **options})

    def on_broken_pipe(self) -> None:
        """Leave it to :func:`command`."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


def one_line(text: str) -> str:
    """A text without line breaks, control characters and what no terminal can show, and not too long."""
    line = " ".join(text.split())
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 40]} ... {line[-30:]}"


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


def whole_number(low: int, high: int, reason: str = "") -> Callable[[str], int]:
    """Type of an option that is a whole number from ``low`` to ``high``; ``reason`` says why no more."""

    def read(text: str) -> int:
        try:
            value = int(text) if len(text) < 40 else None
        except ValueError:
            value = None
        if value is None or not low <= value <= high:
            told = text if len(text) <= 40 else f"{text[:20]}... ({len(text)} characters)"
            why = f" ({reason})" if reason else ""
            raise argparse.ArgumentTypeError(f"{told!r} is not a whole number from {low} to {high}{why}")
        return value

    return read


def _show_warning(
    name: str, show: Callable[..., None], message: Untyped, category: type[Warning], *place: Untyped
) -> None:
    """Print a note on a scene as one line, once, and anything else as Python does."""
    if not issubclass(category, SceneNote):
        show(message, category, *place)
    elif (text := one_line(str(message))) not in _SHOWN:
        _SHOWN.add(text)
        with contextlib.suppress(OSError, ValueError):
            print(f"{name}: note: {text}", file=sys.stderr)


_SHOWN: set[str] = set()


def amount(low: float, high: float, unit: str) -> Callable[[str], float]:
    """Type of an option that is a number of some unit from ``low`` to ``high``."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text[:40]!r} is not a number of {unit} from {low:g} to {high:g}")
        return value

    return read


positive = whole_number(1, 10**9)
"""Type of an option that is a whole number of at least 1."""

natural = whole_number(0, 2**31 - 1)
"""Type of an option that is a whole number of at least 0, such as a seed."""

workers = whole_number(1, 1024, "each worker is a process")
"""Type of an option that says how many processes do the work."""

pixels = whole_number(16, 4096, "a picture of more would not fit into memory together with its rays")
"""Type of an option that says how many pixels a picture has per side."""


def _run(main: Main, argv: Sequence[str], from_shell: bool, debug: bool) -> int:
    name = os.path.basename(sys.argv[0]) if from_shell else "prnav"
    name = name if name.startswith("prnav") else "prnav"
    former = sys.unraisablehook
    sys.unraisablehook = _unraisable
    try:
        if from_shell:
            _print_anything()
        if any("\0" in word for word in argv):
            raise ConfigError("an argument holds a zero byte; no name and no path has one")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always", SceneNote)
                warnings.showwarning = functools.partial(_show_warning, name, warnings.showwarning)
                status = main(argv) or 0
        except SystemExit as ended:  # the parser's
            if not from_shell:
                raise
            status = ended.code if isinstance(ended.code, int) else 0
        if sys.stdout is not None:
            sys.stdout.flush()
        return status
    except BrokenPipeError:
        _forget_output()
        return 0
    except KeyboardInterrupt:
        if from_shell:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process ends anyway: no second Ctrl-C gets in between
        return _tell(f"{name}: interrupted", 130, debug)
    except Exception as error:
        return _tell(f"{name}: error: {explain(error)}", 2, debug)
    finally:
        sys.unraisablehook = former


def explain(error: Exception) -> str:
    """What an error is and what to do, in words that need no source code."""
    if isinstance(error, PrnavError):
        return str(error)
    if isinstance(error, MemoryError):
        text = str(error) or "nothing more could be allocated"
        return f"out of memory ({text}); ask for less, or give the process more"
    if isinstance(error, OSError) and error.strerror:
        names = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, str | bytes)]
        where = f"{names[-1]}: " if names else ""
        remedies = {
            errno.ENOSPC: "make room on the disk",
            errno.EDQUOT: "make room within the quota",
            errno.EACCES: "choose a place that you may write to",
            errno.EROFS: "choose a place that can be written to",
            errno.ENAMETOOLONG: "choose a shorter name",
            errno.ENOTDIR: "a file stands where a folder is needed: choose another place",
            errno.EEXIST: "a file stands where a folder is needed: choose another place",
            errno.EISDIR: "a folder stands where a file is needed: choose another place",
        }
        return f"{where}{error.strerror.lower()}; {remedies.get(error.errno or 0, 'give another path')}"
    told = str(error) or "no more is known"
    return f"unexpected {type(error).__name__}: {told}; this is a fault of prnav, {DEBUG} shows where"


def _tell(text: str, status: int, debug: bool) -> int:
    with contextlib.suppress(OSError, ValueError, AttributeError):
        if debug:
            traceback.print_exc()
        print(one_line(text), file=sys.stderr, flush=True)
    with contextlib.suppress(OSError, ValueError, AttributeError):
        sys.stdout.flush()
        return status
    _forget_output()
    return status


def _print_anything() -> None:
    """Print what a terminal's encoding lacks, and names that are no Unicode, as escapes."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _forget_output() -> None:
    """Let nothing that is still to be printed fail again when the interpreter ends."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _unraisable(unraisable: Untyped) -> None:
    """A Ctrl-C that came while Python could not raise it comes again; all else is told as usual."""
    if unraisable.exc_type is KeyboardInterrupt:
        signal.raise_signal(signal.SIGINT)
    else:
        sys.__unraisablehook__(unraisable)
