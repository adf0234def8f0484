"""Figures of control episodes, drawn from what traces hold: the return as it grows with simulated time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON, Untyped
from prnav.contracts import Evaluation, Trace
from prnav.contracts.records import pick_episodes
from prnav.domains.control.facts import EPISODE_STEPS
from prnav.errors import RecordError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GROWTH = "Return against simulation steps of the worst, the best and some random episodes; grey: all others."


@dataclass(frozen=True)
class ControlPictures:
    """A :class:`prnav.contracts.Pictures` of curves; matplotlib is imported when something is drawn."""

    def episodes(self, evaluation: Evaluation, traces: Sequence[Trace]) -> Figure:
        """How the returns of some episodes grew."""
        from prnav.style import SERIES, new_figure, styled

        figure = new_figure(7.0, 4.0)
        with styled():
            axes = figure.add_subplot()
            for trace in traces:
                _draw(axes, trace, evaluation.header, color="#d5dae0", linewidth=0.6)
            for (kind, rows), color in zip(pick_episodes(evaluation.rows).items(), SERIES, strict=False):
                for place, row in enumerate(rows):
                    _draw(axes, traces[row], evaluation.header, color=color, label=kind if place == 0 else None)
            _label(axes)
        return figure

    def pairs(
        self,
        evaluations: tuple[Evaluation, Evaluation],
        traces: tuple[Sequence[Trace], Sequence[Trace]],
        names: tuple[str, str],
    ) -> Figure | None:
        """Two agents' returns in the same episodes, each episode a thin line."""
        from prnav.style import SERIES, new_figure, styled

        figure = new_figure(7.0, 4.0)
        with styled():
            axes = figure.add_subplot()
            for evaluation, episodes, name, color in zip(evaluations, traces, names, SERIES, strict=False):
                for place, trace in enumerate(episodes):
                    label = name if place == 0 else None
                    _draw(axes, trace, evaluation.header, color=color, linewidth=0.8, label=label)
            _label(axes)
        return figure

    def figures(self, evaluation: Evaluation, traces: Sequence[Trace]) -> list[tuple[Figure, str]]:
        """How returns grew."""
        return [(self.episodes(evaluation, traces), GROWTH)]

    def breakdown(self, evaluations: Sequence[Evaluation], names: Sequence[str]) -> tuple[Figure, str] | None:
        """Episodes differ by their starts alone, so there is none."""
        return None

    def film(self, evaluation: Evaluation, traces: Sequence[Trace]) -> list[Path]:
        """Films are not made of these tasks.

        Raises:
            RecordError: always.
        """
        raise RecordError("films of control tasks are not made; reports show how returns grew")

    def trace(self, world: Untyped, episode: int, trace: Trace) -> NDArray[np.uint8]:
        """One episode's rewards as a small picture (H, W, 3)."""
        from prnav.style import new_figure, styled

        figure = new_figure(3.0, 1.5)
        with styled():
            axes = figure.add_subplot()
            axes.plot(trace["reward"], linewidth=0.8)
            axes.set_ylabel("reward")
        figure.canvas.draw()
        return np.array(figure.canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]


def _draw(axes: Axes, trace: Trace, header: Mapping[str, JSON], **style: Untyped) -> None:
    total = np.concatenate([[0.0], np.cumsum(trace["reward"])])
    axes.plot(np.arange(len(total)) * int(header.get("action_repeat", 1)), total, **style)


def _label(axes: Axes) -> None:
    axes.set_xlabel("simulation steps")
    axes.set_ylabel("return")
    axes.set_xlim(0, EPISODE_STEPS)
    axes.set_ylim(bottom=0)
    axes.legend()
