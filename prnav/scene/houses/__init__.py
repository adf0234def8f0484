"""Procedural homes: furnished, lit, and the same bytes from the same seed everywhere."""

from prnav.scene.houses.config import SPLIT_SIZES, VERSION, HouseConfig, split_seed
from prnav.scene.houses.house import HouseFacts, count_furniture, describe_house, generate_house, plan_house

__all__ = [
    "SPLIT_SIZES",
    "VERSION",
    "HouseConfig",
    "HouseFacts",
    "count_furniture",
    "describe_house",
    "generate_house",
    "plan_house",
    "split_seed",
]
