"""How far a rollout goes: to its end, or, for a worker that others wait for, to where its members have come.

DD-PPO (Wijmans et al. 2020, section 4) cuts the rollouts of stragglers short once most workers are done, so that no one
waits for the slowest home. All members (groups of environments) of a worker end at the same step.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock

SHORTEST = 0.25
"""Share of a rollout that is always collected (as in DD-PPO's published code)."""


class RolloutProgress:
    """Steps that each of a worker's members has begun, and the step at which all of them end."""

    def __init__(self, steps: int, members: int = 1, waited_for: Callable[[], bool] | None = None) -> None:
        """Progress at step 0.

        Args:
            steps: T, where a rollout ends at the latest.
            members: How many collect at the same time.
            waited_for: Whether other workers wait by now; None where no one ever does.
        """
        self.limit = steps
        """Step at which the rollout ends."""
        self._begun = [0] * members
        self._shortest = max(1, int(SHORTEST * steps))
        self._waited_for = waited_for
        self._lock = Lock()

    def may_step(self, member: int) -> bool:
        """Whether ``member`` takes another step; if so, it counts as begun."""
        with self._lock:
            if self._waited_for is not None and self._begun[member] >= self._shortest and self._waited_for():
                self.limit = min(self.limit, max(*self._begun, self._shortest))
                self._waited_for = None
            if self._begun[member] >= self.limit:
                return False
            self._begun[member] += 1
            return True
