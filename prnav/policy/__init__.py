"""Policies: from observations and a recurrent state to actions and values.

A policy knows spaces and tensors, never environments.
"""

from prnav.policy.actor_critic import (
    PolicyStep,
    RecurrentPolicy,
    build_policy,
    entropies,
    log_probabilities,
    sample_actions,
)
from prnav.policy.config import PolicyConfig
from prnav.policy.recurrence import RecurrentCore, Segments, segment

__all__ = [
    "PolicyConfig",
    "PolicyStep",
    "RecurrentCore",
    "RecurrentPolicy",
    "Segments",
    "build_policy",
    "entropies",
    "log_probabilities",
    "sample_actions",
    "segment",
]
