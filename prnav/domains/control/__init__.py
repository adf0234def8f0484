"""Continuous control: bodies, physics, light and tasks of the DeepMind Control Suite, seen through photoreceptors."""
