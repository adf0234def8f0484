"""The data card of the built-in homes: a contact sheet, figures of distributions, and the table of the splits."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSONObject, Untyped
from prnav.cli._scene_views import contact_sheet, views

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from prnav.episodes import EpisodeTable

FRAMES = (
    ("prhouses/test/03", 100), ("prhouses/test/04", 1), ("prhouses/test/03", 3), ("prhouses/test/11", 4),
    ("prhouses/test/12", 4), ("prhouses/test/01", 2), ("prhouses/val/02", 2), ("prhouses/test/07", 3),
    ("prhouses/test/09", 2), ("prhouses/test/11", 1), ("prhouses/test/07", 4), ("prhouses/val/02", 3),
)  # fmt: skip
"""Home and seed of the view of each picture on the contact sheet."""


@dataclass(frozen=True)
class HomeRow:
    """Figures of one home."""

    split: str
    storeys: int
    rooms: int
    walkable: float  #: [m2]
    share: float  #: of it on the largest island
    triangles: int
    texture_bytes: int


def write_sheet(path: Path, size: int) -> None:
    """The contact sheet as PNG: the first view of each of :data:`FRAMES`."""
    from PIL import Image

    from prnav.files import atomic_path
    from prnav.navmesh import load_navmesh
    from prnav.scene import load_scene

    cells = []
    for name, seed in FRAMES:
        scene = load_scene(name)
        cells.append(views(scene, load_navmesh(scene), 1, size, seed)[0])
    picture = Image.fromarray(contact_sheet(cells))
    with atomic_path(path) as temporary:
        picture.save(temporary, format="PNG", optimize=True)


def measure_homes(names: list[str], progress: Untyped = None) -> list[HomeRow]:
    """Figures of homes by id; ``progress`` wraps the ids."""
    from prnav.navmesh import load_navmesh
    from prnav.scene import load_scene
    from prnav.scene.houses import describe_house
    from prnav.scene.houses.manifest import house_ids

    rows = []
    for name in progress(names) if progress else names:
        scene, facts = load_scene(name), describe_house(house_ids()[name])
        areas = [island.area for island in load_navmesh(scene).islands]
        share = max(areas) / sum(areas)
        texels = scene.atlas.texels.nbytes
        split = name.split("/")[1]
        rows.append(HomeRow(split, facts.storeys, facts.rooms, sum(areas), share, len(scene.faces), texels))
    return rows


def card_table(rows: list[HomeRow]) -> str:
    """A Markdown table: one column per split."""
    splits = list(dict.fromkeys(row.split for row in rows))
    of = {split: [row for row in rows if row.split == split] for split in splits}

    def spread(key: str, form: str = "{:.0f}") -> list[str]:
        cells = []
        for split in splits:
            low, middle, high = np.percentile([getattr(row, key) for row in of[split]], [0, 50, 100])
            cells.append(f"{form.format(low)} - {form.format(middle)} - {form.format(high)}")
        return cells

    lines = [
        ["", *splits],
        ["---"] * (len(splits) + 1),
        ["homes", *(str(len(of[split])) for split in splits)],
        ["on two storeys", *(str(sum(row.storeys == 2 for row in of[split])) for split in splits)],
        ["walkable area [m2]", *spread("walkable")],
        ["rooms", *spread("rooms")],
        ["share on the largest island", *spread("share", "{:.3f}")],
        ["triangles", *spread("triangles", "{:,.0f}")],
        ["texture bytes", *spread("texture_bytes", "{:,.0f}")],
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def episode_lines(tables: dict[str, EpisodeTable]) -> str:
    """A Markdown table of the episodes' lengths and ratios."""
    lines = ["| episodes | number | geodesic [m] | geodesic to straight line |", "| --- | --- | --- | --- |"]
    for split, table in tables.items():
        cells = []
        for values in (table.geodesic_distance, _ratio(table)):
            low, middle, high = np.percentile(values, [0, 50, 100])
            cells.append(f"{low:.2f} - {middle:.2f} - {high:.2f}")
        lines.append(f"| {split} | {len(table):,} | {cells[0]} | {cells[1]} |")
    return "\n".join(lines)


def _ratio(table: EpisodeTable) -> NDArray[np.float64]:
    straight = np.linalg.norm(table.goal_position - table.start_position, axis=1)
    return np.asarray(table.geodesic_distance / np.maximum(straight, 1e-9))


def write_figure(path: Path, rows: list[HomeRow], tables: dict[str, EpisodeTable]) -> None:
    """Histograms of areas, rooms, lengths and ratios as PNG."""
    from prnav.style import SERIES, new_figure, save_png, styled

    figure = new_figure(9.0, 6.0)
    with styled():
        _draw(figure, rows, tables, SERIES)
    save_png(figure, path, dpi=100)


def _draw(figure: Figure, rows: list[HomeRow], tables: dict[str, EpisodeTable], colors: Sequence[str]) -> None:
    axes = figure.subplots(2, 2)
    by_storeys = [[row for row in rows if row.storeys == storeys] for storeys in (1, 2)]
    labels = ["one storey", "two storeys"]
    axes[0, 0].hist(
        [[row.walkable for row in part] for part in by_storeys],
        np.arange(30, 311, 20),
        stacked=True,
        label=labels,
        color=colors[:2],
    )
    axes[0, 0].set(xlabel="walkable area [m²]", ylabel="homes")
    axes[0, 0].legend()
    axes[0, 1].hist(
        [[row.rooms for row in part] for part in by_storeys], np.arange(3.5, 21), stacked=True, color=colors[:2]
    )
    axes[0, 1].set(xlabel="rooms", ylabel="homes")
    for k, (split, table) in enumerate(tables.items()):
        kind: JSONObject = {"density": True, "histtype": "step", "color": colors[k], "label": split}
        axes[1, 0].hist(table.geodesic_distance, np.arange(0, 31, 1.5), **kind)
        axes[1, 1].hist(np.minimum(_ratio(table), 4.0), np.arange(1.0, 4.01, 0.1), **kind)
    axes[1, 0].set(xlabel="geodesic distance [m]", ylabel="density of episodes")
    axes[1, 1].set(xlabel="geodesic distance / straight line, up to 4", ylabel="density of episodes")
    axes[1, 0].legend()
