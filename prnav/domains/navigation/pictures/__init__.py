"""Pictures of navigation: floor plans with trajectories, what receptors saw, films."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.contracts import Evaluation, Trace
from prnav.contracts.records import pick_episodes
from prnav.domains.navigation.maps import floor_of, load_maps, make_maps
from prnav.domains.navigation.sights import load_sights

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from prnav.domains.navigation.env import EpisodeSource

EPISODES = "Worst and best episodes by SPL, and random ones. Red dots are steps that hit something."
HOUSE = "Up to fifty trajectories in the scene with the most episodes, coloured by time."
SIGHT = "An episode drawn at random: its map, moments of it, and what every receptor read at every step."
BREAKDOWN = "Success in groups of equally many episodes, at each group's median, with 95 % intervals."


@dataclass(frozen=True)
class NavigationPictures:
    """A :class:`prnav.contracts.Pictures` on floor plans; matplotlib is imported when something is drawn."""

    def episodes(self, evaluation: Evaluation, traces: Sequence[Trace]) -> Figure:
        """Worst, best and random episodes on their floors."""
        from prnav.domains.navigation.pictures.topdown import draw_episodes

        return draw_episodes(evaluation, traces, load_maps(evaluation.directory))

    def pairs(
        self,
        evaluations: tuple[Evaluation, Evaluation],
        traces: tuple[Sequence[Trace], Sequence[Trace]],
        names: tuple[str, str],
    ) -> Figure | None:
        """Two agents in the same episodes, side by side."""
        from prnav.domains.navigation.pictures.topdown import draw_pairs

        return draw_pairs(evaluations, traces, load_maps(evaluations[0].directory), names)

    def figures(self, evaluation: Evaluation, traces: Sequence[Trace]) -> list[tuple[Figure, str]]:
        """Episodes, the house with the most of them, and one episode as the receptors saw it."""
        from prnav.domains.navigation.pictures.sights import draw_sight
        from prnav.domains.navigation.pictures.topdown import draw_episodes, draw_house

        maps = load_maps(evaluation.directory)
        result = [
            (draw_episodes(evaluation, traces, maps), EPISODES),
            (draw_house(evaluation, traces, maps), HOUSE),
        ]
        sights = load_sights(evaluation.directory)
        picks = [index for index in pick_episodes(evaluation.rows).get("random", []) if index in sights]
        for index in (picks or list(sights))[:1]:
            title = f"{evaluation.label}: what the receptors saw"
            result.append((draw_sight(evaluation.rows[index], traces[index], sights[index], maps, title), SIGHT))
        return result

    def breakdown(self, evaluations: Sequence[Evaluation], names: Sequence[str]) -> tuple[Figure, str] | None:
        """How success depends on the distance to the goal and on how far round the way to it leads."""
        from prnav.domains.navigation.pictures.breakdown import draw_breakdown

        figure = draw_breakdown(evaluations, names)
        return None if figure is None else (figure, BREAKDOWN)

    def film(self, evaluation: Evaluation, traces: Sequence[Trace]) -> list[Path]:
        """Films of the worst, the best and a random episode, into ``videos/``.

        Raises:
            PrnavError: the encoder is not installed.
            RecordError: floor plans or readings are missing or broken.
        """
        from prnav.domains.navigation.pictures.film import write_videos

        return write_videos(evaluation, traces)

    def trace(self, world: EpisodeSource, episode: int, trace: Trace) -> NDArray[np.uint8]:
        """An agent's path on its home's floor, (400, 400, 3)."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        from prnav.domains.navigation.pictures.topdown import draw_floor, draw_trajectory

        scene, start, goal = world.scene_index[episode], world.starts[episode], world.goals[episode]
        name = world.world.scene_ids[scene]
        maps = make_maps([(name, world.world.navmeshes[scene], [start[1], goal[1]])])
        floor = floor_of(maps, name, start[1])
        assert floor is not None
        figure = Figure(figsize=(5, 5), dpi=80)
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        draw_floor(axes, floor)
        draw_trajectory(axes, trace, floor, goal)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()
