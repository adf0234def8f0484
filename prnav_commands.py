"""Where the commands begin: before anything is imported that takes time, so that Ctrl-C always ends them quietly.

A module of its own beside the package, since importing anything of the package imports NumPy and Gymnasium first. The
commands themselves are in :mod:`prnav.cli`.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import NoReturn


def _interrupted(number: int, frame: FrameType | None) -> NoReturn:
    """Nothing is begun yet that would have to be ended: say so and go."""
    os.write(2, f"{os.path.basename(sys.argv[0])}: interrupted\n".encode())
    os._exit(130)


def _run(name: str) -> NoReturn:
    # a shell that starts a command in the background has it ignore Ctrl-C: that stays
    listening = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if listening:
        signal.signal(signal.SIGINT, _interrupted)
    import importlib

    main = importlib.import_module(f"prnav.cli.{name}").main
    if listening:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(main())


def prnav() -> NoReturn:
    """``prnav``."""
    _run("prnav")


def train() -> NoReturn:
    """``prnav-train``."""
    _run("train")


def evaluate() -> NoReturn:
    """``prnav-eval``."""
    _run("eval")


def episodes() -> NoReturn:
    """``prnav-episodes``."""
    _run("episodes")


def scenes() -> NoReturn:
    """``prnav-scenes``."""
    _run("scenes")


def design() -> NoReturn:
    """``prnav-design``."""
    _run("design")


def bench() -> NoReturn:
    """``prnav-bench``."""
    _run("bench")


def report() -> NoReturn:
    """``prnav-report``."""
    _run("report")
