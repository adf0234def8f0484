"""Memories: what a policy keeps from step to step, one module per kind."""

from __future__ import annotations

from collections.abc import Mapping

from prnav.policy.memory.lstm import LSTMMemory, Segments, segment
from prnav.policy.memory.memory import Cut, Cutter, Inputs, Memory, Rows, State
from prnav.policy.memory.none import NoMemory
from prnav.policy.memory.stack import StackMemory, Windows

MEMORIES: Mapping[str, type[LSTMMemory] | type[StackMemory] | type[NoMemory]] = {
    "lstm": LSTMMemory,
    "stack": StackMemory,
    "none": NoMemory,
}
"""By the name that a config gives them."""

__all__ = [
    "MEMORIES",
    "Cut",
    "Cutter",
    "Inputs",
    "LSTMMemory",
    "Memory",
    "NoMemory",
    "Rows",
    "Segments",
    "StackMemory",
    "State",
    "Windows",
    "segment",
]
