"""Families of tasks: each supplies worlds, bodies and rewards behind the contracts that all share."""
