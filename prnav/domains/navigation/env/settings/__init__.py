"""Settings of navigation environments by subject; a TOML file has them all side by side in its table [env].

Each class has a ``check`` of its own, which raises ``ValueError`` naming the key, its value and what is valid.
"""

from prnav.domains.navigation.env.settings.episodes import EpisodeSettings
from prnav.domains.navigation.env.settings.navmesh import FloorSettings
from prnav.domains.navigation.env.settings.rules import RuleSettings
from prnav.domains.navigation.env.settings.scenes import SceneSettings
from prnav.domains.navigation.env.settings.sensors import ReadoutSettings, SensorSettings

__all__ = ["EpisodeSettings", "FloorSettings", "ReadoutSettings", "RuleSettings", "SceneSettings", "SensorSettings"]
