"""A search in one module: one free coordinate after the other is nudged both ways."""

import numpy as np

from prnav.design.methods import SearchMethod
from prnav.sensors import moved_design, with_free_values

STEP = 0.1


def nudge(search, initial, number):
    """The best of the initial design and all designs that are one nudge away."""
    free = int(initial.free.sum())
    tries = [np.zeros(free), *(sign * STEP * row for row in np.eye(free) for sign in (-1.0, 1.0))]
    scores = [search.score(initial, with_free_values(values, initial), number) for values in tries]
    best = int(np.argmax(scores))
    search.say("search", len(tries), len(tries), f"best {scores[best]:.4f}")
    found = moved_design(initial, with_free_values(tries[best], initial), "nudged", "Found by nudges.")
    steps = len(tries) * search.config.cost_steps
    facts = {"initial": scores[0], "found": scores[best], "trials": len(tries), "steps": steps, "scores": scores}
    return found, facts


NUDGE = SearchMethod(nudge)
