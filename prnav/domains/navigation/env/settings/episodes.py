"""Which episodes an environment plays."""

from __future__ import annotations

from dataclasses import dataclass

from prnav.domains.navigation.env.settings.checks import check_at_least, check_filled


@dataclass(frozen=True)
class EpisodeSettings:
    """Episodes: generated ones in built-in homes, or files."""

    episodes_per_scene: int = 200
    """Episodes generated per scene of the train split."""
    episode_seed: int = 0
    """Seed of the generated episodes."""
    episodes: str | None = None
    """Path of Habitat PointNav episodes (file or folder); None takes the built-in ones of the split."""
    episode_split: str | None = None
    """Split to take from a folder of episodes that has several."""

    def check(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: a value is unknown or out of range.
        """
        check_at_least(1, episodes_per_scene=self.episodes_per_scene)
        check_at_least(0, episode_seed=self.episode_seed)
        check_filled(episodes=self.episodes, episode_split=self.episode_split)
