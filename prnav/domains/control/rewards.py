"""Rewards of the six tasks as functions of physical quantities, on any number of states at once.

They are those of the DeepMind Control Suite (Tassa et al. 2018, section 4.3 and table 2): all lie in 0..1, so that an
episode of 1,000 steps returns 1,000 at most.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

STAND_HEIGHT = 1.2
"""Height of the torso's centre from which the walker counts as standing [m]."""
SPIN_VELOCITY = 15.0
"""Angular velocity, downwards on the finger's side, from which the spinner counts as spinning [rad/s]."""
_AT_MARGIN = {"gaussian": 0.1, "linear": 0.5}


def tolerance(
    values: ArrayLike,
    lower: float,
    upper: float,
    margin: float = 0.0,
    shape: Literal["gaussian", "linear"] = "gaussian",
) -> NDArray[np.float64]:
    """How well values lie within bounds: 1 inside, less with the distance from them outside.

    Args:
        values: any shape.
        lower: bound, or -inf.
        upper: bound, or inf.
        margin: distance from the bounds at which the result is 0.1 ("gaussian") or 0.5 ("linear"); 0 makes it 0
            everywhere outside.
        shape: "gaussian", exp(-x^2 / 2) scaled; or "linear", a straight slope down to 0.

    Returns:
        Numbers in 0..1, of the values' shape.
    """
    values = np.asarray(values, np.float64)
    inside = (values >= lower) & (values <= upper)
    if margin == 0.0:
        return inside.astype(np.float64)
    outside = np.where(values < lower, lower - values, values - upper)
    distance = np.where(inside, 0.0, outside) / margin
    at_margin = _AT_MARGIN[shape]
    if shape == "linear":
        return np.maximum(1.0 - distance * (1.0 - at_margin), 0.0)
    scale = np.sqrt(-2.0 * np.log(at_margin))
    return np.exp(-0.5 * (distance * scale) ** 2)


def reach_reward(distance: ArrayLike, reach: float) -> NDArray[np.float64]:
    """Reacher: 1 where the fingertip touches the target, else 0.

    Args:
        distance: between their centres in the plane [m].
        reach: sum of their radii [m].
    """
    return tolerance(distance, 0.0, reach)


def stand_reward(height: ArrayLike, upright: ArrayLike) -> NDArray[np.float64]:
    """Walker's "stand": a torso that is high (three quarters) and upright (one quarter).

    Args:
        height: of the torso's centre [m].
        upright: cosine of the torso's tilt, -1..1.
    """
    standing = tolerance(height, STAND_HEIGHT, np.inf, margin=STAND_HEIGHT / 2)
    return (3.0 * standing + (1.0 + np.asarray(upright, np.float64)) / 2.0) / 4.0


def move_reward(height: ArrayLike, upright: ArrayLike, velocity: ArrayLike, speed: float) -> NDArray[np.float64]:
    """Walker's "walk" and "run": the reward for standing, times a sixth and five sixths of moving fast enough.

    Args:
        height: of the torso's centre [m].
        upright: cosine of the torso's tilt, -1..1.
        velocity: of the whole body's centre of mass along x [m/s].
        speed: from which the full reward is given [m/s].
    """
    moving = tolerance(velocity, speed, np.inf, margin=speed / 2, shape="linear")
    return stand_reward(height, upright) * (5.0 * moving + 1.0) / 6.0


def spin_reward(hinge_velocity: ArrayLike) -> NDArray[np.float64]:
    """Finger's "spin": 1 where the spinner turns fast enough the right way [rad/s], else 0."""
    return (np.asarray(hinge_velocity, np.float64) <= -SPIN_VELOCITY).astype(np.float64)


def turn_reward(distance: ArrayLike) -> NDArray[np.float64]:
    """Finger's "turn": 1 where the spinner's tip is within the target, else 0.

    Args:
        distance: of the tip from the target's surface [m], negative inside.
    """
    return (np.asarray(distance, np.float64) <= 0.0).astype(np.float64)
