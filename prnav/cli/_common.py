"""What all commands share: one way to end on an error, and one console."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Sequence

from prnav.errors import PrnavError

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


def _run(main: Main, argv: Sequence[str] | None) -> int:
    name = os.path.basename(sys.argv[0]) if argv is None else "prnav"
    try:
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
