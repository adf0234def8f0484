"""Pictures of navigation: floor plans with trajectories, what receptors saw, films."""
