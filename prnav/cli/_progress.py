"""Progress as a bar on a terminal, and as a line every few seconds where the output goes elsewhere."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import Progress, ProgressColumn, TaskID

from prnav.aliases import Untyped

LINE_SECONDS = 10.0
"""How often a line is printed where there is no terminal to redraw."""


class LineProgress(Progress):
    """A progress bar that prints lines instead where its console is no terminal."""

    def __init__(self, *columns: ProgressColumn, console: Console) -> None:
        super().__init__(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._lines = not console.is_terminal
        self._printed = time.monotonic()

    def update(self, task_id: TaskID, **changes: Untyped) -> None:
        """As rich's; where there is no terminal, a line if the last one was a while ago."""
        super().update(task_id, **changes)
        self._print_line(task_id)

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        """As rich's; where there is no terminal, a line if the last one was a while ago."""
        super().advance(task_id, advance)
        self._print_line(task_id)

    def _print_line(self, task_id: TaskID) -> None:
        now = time.monotonic()
        if not self._lines or now - self._printed < LINE_SECONDS:
            return
        self._printed = now
        task = self._tasks[task_id]
        count = f"{task.completed:,.0f}" + (f" of {task.total:,.0f}" if task.total else "")
        text = f"{task.description}  {count}" if task.description else count
        self.console.print(text, highlight=False, markup=False, soft_wrap=True)
