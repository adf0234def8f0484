"""What stands between light and a policy in a real sensor: exposure, read-out noise and quantisation.

All of it is off by default and a pure function of the readings, the settings and who reads what when: noise depends on
an agent's seed, its step, and the place in its readings, never on the batch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import DesignError
from prnav.splitmix import GOLDEN, mix_array, unit_interval

MAX_BITS = 16
"""Most bits a reading can be quantised to."""


@dataclass(frozen=True)
class Readout:
    """Read-out of K sensors, each setting one number for all of them or one for each.

    A reading x becomes ``clip(exposure x + noise n, 0, 1)``, n drawn from a standard normal distribution, and is then
    rounded to the nearest of ``2^bits`` levels from 0 to 1.
    """

    exposure: tuple[float, ...] = (1.0,)
    """Factor on the light; what exceeds 1 is clipped."""
    noise: tuple[float, ...] = (0.0,)
    """Standard deviation of the noise of each reading and colour, as a share of full scale."""
    bits: tuple[int, ...] = (0,)
    """Bits of a reading, 0 for no quantisation."""

    def __post_init__(self) -> None:
        for name, least, most, unit in (
            ("exposure", 0.0, math.inf, "number"),
            ("noise", 0.0, math.inf, "number"),
            ("bits", 0, MAX_BITS, "whole number"),
        ):
            values = getattr(self, name)
            if not values:
                raise ValueError(f"{name} is empty; give one {unit} for all sensors, or one for each")
            for value in values:
                whole = unit == "number" or isinstance(value, int)
                if not (whole and math.isfinite(value) and least <= value <= most):
                    bound = f" and at most {most}" if math.isfinite(most) else ""
                    raise ValueError(f"{name} is {value!r}; it must be a {unit} of at least {least:g}{bound}")

    @property
    def is_ideal(self) -> bool:
        """Whether readings stay as they are."""
        return set(self.exposure) == {1.0} and set(self.noise) == {0.0} and set(self.bits) == {0}

    @property
    def is_noisy(self) -> bool:
        """Whether chance has a part."""
        return any(value > 0.0 for value in self.noise)

    def per_sensor(self, sensors: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Exposure, noise and bits of each of K sensors, (K,).

        Raises:
            DesignError: a setting has neither one value nor K.
        """
        for name in ("exposure", "noise", "bits"):
            count = len(getattr(self, name))
            if count not in (1, sensors):
                raise DesignError(f"{name} has {count} values; the design has {sensors} sensors: give 1 or {sensors}")
        exposure = np.broadcast_to(np.array(self.exposure, np.float64), sensors)
        noise = np.broadcast_to(np.array(self.noise, np.float64), sensors)
        return exposure, noise, np.broadcast_to(np.array(self.bits, np.int64), sensors)


def read_out(
    light: NDArray[np.float32],
    readout: Readout,
    seeds: ArrayLike | None = None,
    steps: ArrayLike | None = None,
) -> NDArray[np.float32]:
    """Readings of sensors that see ``light``.

    Args:
        light: ideal readings, 0 to 1, shape (N, K, ...).
        readout: settings.
        seeds: one of each agent's episode, whole numbers, shape (N,); needed where there is noise.
        steps: each agent's step in its episode, shape (N,); needed where there is noise.

    Raises:
        DesignError: settings do not fit the K sensors, or there is noise but no whole seeds and steps of that shape.
    """
    agents, sensors = light.shape[:2]
    per_sensor = readout.per_sensor(sensors)
    if readout.is_ideal:
        return light
    shape = (1, sensors, *[1] * (light.ndim - 2))
    exposure, noise, bits = (values.reshape(shape) for values in per_sensor)
    signal = light.astype(np.float64) * exposure
    if readout.is_noisy:
        if seeds is None or steps is None or np.shape(seeds) != (agents,) or np.shape(steps) != (agents,):
            raise DesignError(f"noise needs seeds and steps of shape ({agents},), one of each agent")
        for name, values in (("seeds", seeds), ("steps", steps)):
            if np.asarray(values).dtype.kind not in "iu" and agents:
                raise DesignError(f"{name} of noise are {np.asarray(values).dtype}; they must be 64-bit whole numbers")
        signal += noise * standard_normal(seeds, steps, light.shape[1:])
    signal = np.clip(signal, 0.0, 1.0)
    levels = np.maximum(2.0**bits - 1.0, 1.0)
    return np.where(bits > 0, np.rint(signal * levels) / levels, signal).astype(np.float32)


def standard_normal(seeds: ArrayLike, steps: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Standard normal numbers (N, *shape), each a function of its agent's seed, its step and its place in ``shape``.

    A counter-based generator: the three are hashed with the finaliser of SplitMix64 (Steele, Lea, Flood 2014), and the
    upper 53 bits go through the inverse of the normal distribution function.
    """
    from scipy.special import ndtri  # takes a while to import

    count = math.prod(shape)
    agent = mix_array(np.asarray(seeds).astype(np.uint64) + np.uint64(GOLDEN))
    agent = mix_array(agent ^ mix_array(np.asarray(steps).astype(np.uint64) ^ np.uint64(GOLDEN)))
    place = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(GOLDEN)
    bits = mix_array(agent[:, None] + place)
    uniform = unit_interval(bits) + 2.0**-54
    normal: NDArray[np.float64] = ndtri(uniform).reshape(-1, *shape)
    return normal
