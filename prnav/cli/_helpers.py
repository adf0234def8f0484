"""The other workers of this machine on a search or a sweep: the same command, told to take part.

What a worker says stands in ``worker-I.log`` of the folder; its warnings and its error are told again at the end.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from prnav.processes import deaf_children

BEGIN = "from prnav.processes import become_worker; become_worker(); from prnav.cli.design import main; main()"
TOLD = ("warning:", "prnav: error:", "-c: error:")
"""How lines begin that are told again."""


class Helpers:
    """Context in which the workers run; they end with it, and earlier where nothing is left to do."""

    def __init__(self, words: Sequence[str], folder: Path, count: int) -> None:
        """Workers 1 to ``count`` of ``prnav-design WORDS --out FOLDER``."""
        self.logs = [folder / f"worker-{number}.log" for number in range(1, count + 1)]
        self._began = [log.stat().st_size if log.exists() else 0 for log in self.logs]
        self._words, self._folder = list(words), folder
        self._processes: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Helpers:
        self._folder.mkdir(parents=True, exist_ok=True)
        with deaf_children():
            for number, log in enumerate(self.logs, start=1):
                with open(log, "ab") as file:
                    command = [*self._words, "--out", str(self._folder), "--join", str(number)]
                    process = subprocess.Popen(
                        [sys.executable, "-c", BEGIN, *command], stdout=subprocess.DEVNULL, stderr=file
                    )
                self._processes.append(process)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._processes:
            if process.poll() is None:
                process.terminate()
        self.wait()

    def wait(self) -> None:
        """Until all have ended."""
        for process in self._processes:
            process.wait()

    def told(self) -> list[str]:
        """What workers warned of since they were started here, each line once, with the log that it stands in."""
        lines: dict[str, str] = {}
        for log, began in zip(self.logs, self._began, strict=True):
            text = log.read_bytes()[began:].decode("utf-8", errors="replace") if log.exists() else ""
            for line in text.splitlines():
                if line.strip().startswith(TOLD):
                    lines.setdefault(line.strip(), log.name)
        return [f"{name}: {line}" for line, name in lines.items()]
