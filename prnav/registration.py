"""Names under which ``gymnasium.make`` finds the environments.

``import prnav`` calls :func:`register`; the environments themselves are imported when one is made.
"""

from __future__ import annotations


def register() -> None:
    """Register the environments with Gymnasium."""
    import gymnasium

    for name in ("PointGoalNav", "TargetNav"):
        gymnasium.register(
            id=f"prnav/{name}-v0",
            entry_point=f"prnav.domains.navigation.env:{name}Env",
            vector_entry_point=f"prnav.domains.navigation.env:{name}VectorEnv",
            order_enforce=False,
            disable_env_checker=True,
        )
