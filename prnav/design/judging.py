"""Playing a list of episodes with a policy at a design, measures out: what searches and comparisons score by.

Smaller than an evaluation with records (``prnav-eval``): nothing is kept but the measures. E episodes, K sensors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.contracts import Designable, EpisodeSlots
from prnav.errors import ConfigError
from prnav.play import Outcomes, play
from prnav.play.policy_agent import PolicyAgent
from prnav.policy import Policy

Measures = dict[str, NDArray[np.float64]]


def play_design(policy: Policy, slots: EpisodeSlots, theta: ArrayLike, seed: int = 0) -> Measures:
    """Measures of each episode of ``slots`` played once by sampled actions, each (E,) float64.

    The random numbers of an episode belong to it and the seed, whatever else is played.

    Args:
        policy: what acts.
        slots: over the episodes.
        theta: the design that all play with, normalised (K, 7).
        seed: of the actions.

    Raises:
        ConfigError: the task's designs cannot be set.
    """
    if not isinstance(slots, Designable):
        raise ConfigError("this task has no sensors whose design can be set; take one that has receptors")
    design = np.asarray(theta, np.float64)
    slots.set_designs(np.arange(slots.num_slots), np.broadcast_to(design, (slots.num_slots, *design.shape)))
    outcomes = Outcomes()
    agent = PolicyAgent(policy, "specialist", "sampled", slots.num_slots)
    play(agent, slots, range(len(slots.episode_ids)), seed, [outcomes])
    return outcomes.measures()
