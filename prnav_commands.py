"""Where the commands begin: before anything is imported that takes time, so that Ctrl-C always ends them quietly.

A module of its own beside the package, since importing anything of the package imports NumPy and Gymnasium first. The
commands themselves are in :mod:`prnav.cli`.
"""

from __future__ import annotations

import _signal as signal  # built in: the module around it takes some milliseconds, in which Ctrl-C is a traceback
import os
import sys


def _interrupted(number: int, frame: object) -> None:
    """Nothing is begun yet that would have to be ended: say so and go."""
    os.write(2, f"{os.path.basename(sys.argv[0])}: interrupted\n".encode())
    os._exit(130)


# a shell that starts a command in the background has it ignore Ctrl-C: that stays
LISTENING = signal.getsignal(signal.SIGINT) is signal.default_int_handler
if LISTENING:
    signal.signal(signal.SIGINT, _interrupted)


def _run(name: str) -> None:
    import importlib

    main = importlib.import_module(f"prnav.cli.{name}").main
    if LISTENING:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(main())


def prnav() -> None:
    """``prnav``."""
    _run("prnav")


def train() -> None:
    """``prnav-train``."""
    _run("train")


def evaluate() -> None:
    """``prnav-eval``."""
    _run("eval")


def episodes() -> None:
    """``prnav-episodes``."""
    _run("episodes")


def scenes() -> None:
    """``prnav-scenes``."""
    _run("scenes")


def design() -> None:
    """``prnav-design``."""
    _run("design")


def bench() -> None:
    """``prnav-bench``."""
    _run("bench")


def report() -> None:
    """``prnav-report``."""
    _run("report")
