"""Validation: how the policy does on episodes that it does not learn from, while it learns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.contracts import EpisodeSlots, Played, Trace
from prnav.play import Observer, Outcomes, TraceRecorder, play
from prnav.play.policy_agent import PolicyAgent
from prnav.policy import Policy

SCORES = ("spl", "success", "return", "reward")
"""Measures by which policies are ranked: the first one that the task has."""


@dataclass(frozen=True, eq=False)
class Validation:
    """The episodes that a run is validated on."""

    slots: EpisodeSlots
    picture: Callable[[Trace], NDArray[np.uint8]] | None = None
    """Draws the first episode (H, W, 3) for TensorBoard."""


def validate(policy: Policy, validation: Validation, seed: int) -> tuple[dict[str, float], NDArray[np.uint8] | None]:
    """Mean measures over all episodes, acting as in training: by sampling, with each episode's own noise.

    Args:
        policy: What is asked.
        validation: Its episodes.
        seed: Of the noise.

    Returns:
        Mean measures, and a picture of the first episode where there is one.
    """
    slots, outcomes, first = validation.slots, Outcomes(), list[Trace]()

    def keep(played: Played) -> None:
        if played.index == 0:
            first.append(played.trace)

    observers: list[Observer] = [outcomes]
    if validation.picture is not None:
        observers.append(TraceRecorder(keep))
    agent = PolicyAgent(policy, "validated", "sampled", slots.num_slots)
    play(agent, slots, range(len(slots.episode_ids)), seed, observers)
    means = {name: float(values.mean()) for name, values in outcomes.measures().items()}
    return means, validation.picture(first[0]) if validation.picture is not None and first else None


def score(measures: Mapping[str, float]) -> float:
    """The number by which policies are ranked; more is better."""
    return next((measures[name] for name in SCORES if name in measures), float("-inf"))
