"""Memories: what a policy keeps from step to step, one module per kind."""

from __future__ import annotations

from prnav.policy.memory.lstm import LSTMMemory, Segments, segment
from prnav.policy.memory.memory import Cut, Cutter, Inputs, Memory, MemoryState, Rows
from prnav.policy.memory.none import NoMemory
from prnav.policy.memory.stack import StackMemory, Windows

__all__ = [
    "Cut",
    "Cutter",
    "Inputs",
    "LSTMMemory",
    "Memory",
    "NoMemory",
    "Rows",
    "Segments",
    "StackMemory",
    "MemoryState",
    "Windows",
    "segment",
]
