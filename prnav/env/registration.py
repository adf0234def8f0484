"""Names under which ``gymnasium.make`` finds the environments.

``import prnav`` calls :func:`register`; the environments themselves are imported when one is made.
"""

from __future__ import annotations


def register() -> None:
    """Register the environments with Gymnasium."""
    import gymnasium

    gymnasium.register(
        id="prnav/PointGoalNav-v0",
        entry_point="prnav.env:PointGoalNavEnv",
        vector_entry_point="prnav.env:PointGoalNavVectorEnv",
        order_enforce=False,
        disable_env_checker=True,
    )
