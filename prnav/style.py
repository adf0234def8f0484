"""Colours and figure defaults of everything the project draws, and figures to files."""

from __future__ import annotations

import base64
import contextlib
import io
import os
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.text import Text

from prnav.aliases import Untyped
from prnav.files import atomic_path

INK, MUTED, FAINT, PAPER = "#1f2933", "#66727f", "#d5dae0", "#ffffff"
FLOOR, WALL = "#f3efe6", "#8a8f98"
START, GOAL, COLLISION = "#1769aa", "#1a8a4a", "#d92d20"
SERIES = ("#1769aa", "#e07a1f", "#1a8a4a", "#8e44ad", "#b4472e", "#4b5563", "#0f8b8d", "#b8860b")
"""Colours of runs, in order; told apart by most colour-blind readers too."""
TIME = LinearSegmentedColormap.from_list("time", ["#27187e", "#2a6fdb", "#16a5b8", "#5fc98a"])
"""Colour map of time along a trajectory, dark to light; without red, which is for collisions."""

_DEFAULTS: Untyped = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": MUTED,
    "axes.titlecolor": INK,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#eceff2",
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "svg.hashsalt": "prnav",
}


def new_figure(width: float, height: float) -> Figure:
    """Empty figure of that size in inches, in the house style, with its own off-screen canvas."""
    with matplotlib.rc_context(_DEFAULTS):
        figure = Figure(figsize=(width, height), layout="constrained", facecolor=PAPER)
    FigureCanvasAgg(figure)
    return figure


def styled() -> AbstractContextManager[None]:
    """Context in which axes are made in the house style."""
    return matplotlib.rc_context(_DEFAULTS)


@contextlib.contextmanager
def _as_written(figure: Figure) -> Iterator[None]:
    """Context in which a figure is drawn with its texts as they are: a name may hold dollar signs, or any character.

    Only ticks of logarithmic axes are formulas, which matplotlib writes itself.
    """
    axes = [axis for one in figure.axes for axis in (one.xaxis, one.yaxis)]
    formulas = any(axis.get_scale() == "log" for axis in axes)
    ticks = {id(text) for axis in axes if axis.get_scale() == "log" for text in axis.get_ticklabels(which="both")}
    for text in figure.findobj(Text):
        if id(text) not in ticks:
            text.set_parse_math(False)
    with matplotlib.rc_context({"text.parse_math": formulas}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield


def save_png(figure: Figure, path: str | os.PathLike[str], dpi: int = 130) -> Path:
    """Write a figure atomically; the same figure gives the same bytes."""
    with atomic_path(path) as temporary, _as_written(figure):
        figure.savefig(temporary, format="png", dpi=dpi, metadata={"Software": None})
    return Path(path)


def data_uri(figure: Figure, dpi: int = 110) -> str:
    """A figure as a ``data:`` address, to stand inside a page."""
    buffer = io.BytesIO()
    with _as_written(figure):
        figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()
