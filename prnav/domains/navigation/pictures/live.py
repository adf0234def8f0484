"""What ``render()`` of an environment draws: an agent's way so far beside what it sees."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON, Array, Untyped
from prnav.domains.navigation.maps import HALF_STOREY, make_maps
from prnav.domains.navigation.pictures.frame import Frame, Plan, Words, compose, nearest_plan

if TYPE_CHECKING:
    from prnav.contracts import ObservationSpecs
    from prnav.domains.navigation.env.slots import NavigationSlots
    from prnav.domains.navigation.env.trails import Trails


class LivePictures:
    """Frames of the slots of an environment as they are now; floor plans are drawn once."""

    def __init__(self, slots: NavigationSlots) -> None:
        """Pictures of ``slots``."""
        self.slots = slots
        self._plans: dict[int, list[Plan]] = {}

    def frame(self, slot: int, trail: Trails, observations: Mapping[str, JSON]) -> Frame:
        """A slot as it is now, (H, W, 3) uint8.

        Args:
            slot: which.
            trail: ways of all slots.
            observations: what it was last shown, without a batch axis.
        """
        slots = self.slots
        positions, collisions = trail.of(slot)
        plan = nearest_plan(self._plans_of(int(slots.simulator.scene_index[slot])), float(positions[-1, 1]))
        image = plan.image.copy()
        here = np.abs(positions[:, 1] - plan.floor.height) < HALF_STOREY
        steps = len(collisions)
        for step in np.flatnonzero(here[:-1] & here[1:]).tolist():
            plan.go(positions[step : step + 2], step / steps, bool(collisions[step]), image)
        goal = slots.source.goals[slots.episode[slot]]
        shown = abs(float(goal[1]) - plan.floor.height) < HALF_STOREY
        plan.put(image, positions[-1], float(slots.yaws[slot]), goal if shown else None)
        scene_id, episode_id = slots.source.id(slots.episode[slot])
        left = f"{float(slots.distance[slot]):.1f} m to the goal"
        words = Words(
            title=slots.kind.name,
            caption=f"{scene_id} · {episode_id}\n{left} · collisions: {int(slots.collisions[slot])}",
            step=f"step {int(slots.steps[slot])}",
            collision=bool(steps and collisions[-1]),
        )
        return compose(image, what_is_seen(observations, slots.observation_specs), words)

    def _plans_of(self, scene: int) -> list[Plan]:
        """Plans of the floors of a scene that episodes start or end on."""
        if scene not in self._plans:
            source = self.slots.source
            there = source.scene_index == scene
            heights = np.concatenate([source.starts[there, 1], source.goals[there, 1]])
            world = source.world
            self._plans[scene] = [
                Plan(floor) for floor in make_maps([(world.scene_ids[scene], world.navmeshes[scene], heights)])
            ]
        return self._plans[scene]


def what_is_seen(observations: Mapping[str, JSON], specs: ObservationSpecs) -> NDArray[np.uint8] | None:
    """What an agent's sensors see, (K, B, B, 3) in 0..255: a camera before receptors; None where it is blind."""
    for name in sorted(specs, key=lambda name: specs[name].kind):  # "image" comes before "receptors"
        spec = specs[name]
        if spec.kind == "image":
            return on_host(observations[name])
        if spec.kind == "receptors":
            grid = round(spec.shape[1] ** 0.5)
            patches = np.rint(255.0 * on_host(observations[name])).astype(np.uint8)
            return patches.reshape(spec.shape[0], grid, grid, 3)
    return None


def on_host(values: Untyped) -> Array:
    """An array, or a tensor on any device, as a NumPy array."""
    return values if isinstance(values, np.ndarray) else np.asarray(values.cpu())
