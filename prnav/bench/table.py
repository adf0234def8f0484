"""The benchmarks there are, what a row is, and how speed is measured.

A benchmark ``NAME`` is a function ``measure_NAME(seconds=...)`` in ``prnav/bench`` that returns rows.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import platform
import time
from collections.abc import Callable, Sequence

import prnav
from prnav.aliases import JSONObject
from prnav.errors import ConfigError
from prnav.scene import SceneMesh

Row = JSONObject
"""``name``, ``metric``, ``value``, ``unit``, ``device``, ``version``."""

BENCHMARKS: dict[str, tuple[str, str]] = {
    "navmesh": ("prnav.bench.navmesh", "walking, goal distances and paths on a floor, beside networkx and scipy"),
    "render": ("prnav.bench.render", "photoreceptor readings and pictures per second, by engine"),
    "accuracy": ("prnav.bench.accuracy", "error of readings against rays per receptor"),
    "scaling": ("prnav.bench.scaling", "rendering speed against triangles and agents"),
    "sim": ("prnav.bench.sim", "environment steps per second"),
    "control": ("prnav.bench.control", "physics, readings and environment steps of the control tasks"),
    "train": (
        "prnav.bench.train",
        "the paper's transformer beside plain torch, the quick-start end to end, two workers beside one",
    ),
}
"""Module and one line about each benchmark; those whose module is not there yet are not offered."""


def available() -> dict[str, str]:
    """Benchmarks of this version: name to what they measure."""
    return {name: text for name, (module, text) in BENCHMARKS.items() if importlib.util.find_spec(module)}


def measure(
    name: str, seconds: float | None = None, device: str | None = None, scene: SceneMesh | None = None
) -> list[Row]:
    """Rows of a benchmark; each figure is measured for about ``seconds`` (its own default where None).

    Args:
        name: of the benchmark.
        seconds: how long each figure is measured.
        device: for benchmarks that can use one.
        scene: measured in place of the benchmark's own scenes.

    Raises:
        ConfigError: there is no such benchmark, or it has no choice of device or scene.
    """
    if name not in available():
        raise ConfigError(f"benchmark {name!r} is not known; valid: {', '.join(available())}")
    function = getattr(importlib.import_module(BENCHMARKS[name][0]), f"measure_{name}")
    options: JSONObject = {} if seconds is None else {"seconds": seconds}
    if device is not None:
        if "device" not in inspect.signature(function).parameters:
            raise ConfigError(f"benchmark {name!r} runs on the CPU; leave --device out")
        options["device"] = device
    if scene is not None:
        if "scene" not in inspect.signature(function).parameters:
            raise ConfigError(f"benchmark {name!r} has scenes of its own; leave --scene out")
        options["scene"] = scene
    rows: list[Row] = function(**options)
    return rows


def device_name(cores: int = 1) -> str:
    """What a figure of the CPU was measured on."""
    return f"{platform.machine()} {platform.system()}, {cores} core{'s' * (cores > 1)}"


def row(name: str, metric: str, value: float, unit: str, device: str | None = None) -> Row:
    """One figure, to four significant digits."""
    return {
        "name": name,
        "metric": metric,
        "value": float(f"{value:.4g}"),
        "unit": unit,
        "device": device or device_name(),
        "version": prnav.__version__,
    }


def rate(work: Callable[[], int], seconds: float) -> float:
    """Things done per second of CPU time of this process; ``work`` does some and says how many.

    CPU time, so that other work on a shared machine matters less. The first call, which may compile, does not count.
    """
    return rates_by_turns([work], seconds)[0]


def rates_by_turns(works: Sequence[Callable[[], int]], seconds: float) -> list[float]:
    """:func:`rate` of several things that take turns, so that other work on the machine slows all of them alike."""
    done, spent = [0] * len(works), [0.0] * len(works)
    for work in works:
        work()
    while True:
        for place, work in enumerate(works):
            start = time.process_time()
            done[place] += work()
            spent[place] += time.process_time() - start
        if min(spent) >= seconds:
            break
    return [count / time_taken for count, time_taken in zip(done, spent, strict=True)]


def format_rows(rows: Sequence[Row]) -> str:
    """Lines of ``name metric value unit`` in columns."""
    columns = [[r["name"], r["metric"], f"{r['value']:,.6g}", r["unit"]] for r in rows]
    widths = [max(len(line[i]) for line in columns) for i in range(4)] if columns else []
    return "\n".join(
        f"{line[0]:<{widths[0]}}  {line[1]:<{widths[1]}}  {line[2]:>{widths[2]}}  {line[3]}" for line in columns
    )
