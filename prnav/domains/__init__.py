"""Families of tasks: each implements the contracts, and knows no trainer."""
