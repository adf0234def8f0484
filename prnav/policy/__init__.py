"""Policies: from observations and what is remembered to distributions over actions, and values.

A policy is an encoder, a memory (:mod:`prnav.policy.memory`) and an action head (:mod:`prnav.policy.actions`). It knows
specs and tensors, never environments.
"""

from prnav.policy.actions import ActionDistribution, ActionHead, Categorical, Gaussian, action_head
from prnav.policy.actor_critic import Policy, PolicyStep, build_policy
from prnav.policy.config import ENCODERS, MEMORIES, PolicyConfig
from prnav.policy.memory import Cut, Cutter, Memory, MemoryState

__all__ = [
    "ENCODERS",
    "MEMORIES",
    "ActionDistribution",
    "ActionHead",
    "Categorical",
    "Cut",
    "Cutter",
    "Gaussian",
    "Memory",
    "Policy",
    "PolicyConfig",
    "PolicyStep",
    "MemoryState",
    "action_head",
    "build_policy",
]
