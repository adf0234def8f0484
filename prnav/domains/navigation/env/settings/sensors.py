"""What agents sense, and how light becomes readings."""

from __future__ import annotations

from dataclasses import dataclass, field

from prnav.domains.navigation.env.settings.checks import check_at_least, check_choice, check_filled
from prnav.domains.navigation.sensors import SENSORS
from prnav.errors import RenderError
from prnav.render import ENGINES
from prnav.render.rays import rays_per_side
from prnav.render.sampling import ACCEPTANCES
from prnav.sensors import Readout, library_designs

DEVICES = ("cpu", "cuda", "auto")


@dataclass(frozen=True)
class ReadoutSettings(Readout):
    """Table [env.readout]: how sensors differ from ideal ones; a list has one value for all, or one for each."""

    acceptance: str = "uniform"
    """How much a receptor's rays count across its patch: "uniform", "cosine" or "gaussian"."""
    seed: int = 0
    """Of the noise; with the episode and the step it says what the noise is."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice(ACCEPTANCES, acceptance=self.acceptance)
        check_at_least(0, seed=self.seed)


@dataclass(frozen=True)
class SensorSettings:
    """Sensors: which there are, their design, and what renders for them."""

    sensors: tuple[str, ...] | None = None
    """Names among :data:`prnav.domains.navigation.sensors.SENSORS`; those of the task where None."""
    design: str = "forward"
    """Sensor design: name of a built-in one, or path of a design file."""
    grid: int = 4
    """B: each sensor splits its view into B x B photoreceptors."""
    rays_per_receptor: int = 4
    """A square number."""
    camera_size: int = 0
    """Pixels per side of the picture that each sensor gives instead of photoreceptors; 0 is none (128 in the paper)."""
    vision: bool = True
    """False leaves out what needs light (a blind agent needs none, and this saves its cost)."""
    engine: str = "auto"
    """Renderer: "auto", or one of :data:`prnav.render.ENGINES`."""
    device: str = "cpu"
    """Where the renderer runs: "cpu", "cuda", or "auto", which is a GPU where one is found. With "cuda" readings stay
    there for the policy."""
    readout: ReadoutSettings = field(default_factory=ReadoutSettings)
    """What sensors that are not ideal do to light."""

    def check(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: a value is unknown or out of range, or does not go with another.
        """
        check_at_least(1, grid=self.grid)
        check_choice(("auto", *ENGINES), engine=self.engine)
        check_choice(DEVICES, device=self.device)
        check_filled(design=self.design)
        if isinstance(self.camera_size, bool) or not isinstance(self.camera_size, int) or self.camera_size < 0:
            raise ValueError(f"camera_size is {self.camera_size!r}; it must be 0 (photoreceptors) or more")
        try:
            rays_per_side(self.rays_per_receptor)
        except RenderError as error:
            raise ValueError(str(error)) from error
        if not self.design.endswith(".toml") and self.design not in library_designs():
            raise ValueError(
                f"design is {self.design!r}; valid: {', '.join(map(repr, library_designs()))}, or the path of a .toml "
                f"file"
            )
        if self.device == "cuda" and self.engine not in ("auto", "warp"):
            raise ValueError(f"engine is {self.engine!r} and device 'cuda'; there it must be 'auto' or 'warp'")
        if self.sensors is not None:
            self._check_sensors(self.sensors)

    def _check_sensors(self, names: tuple[str, ...]) -> None:
        if not names:
            raise ValueError(f"sensors is empty; list at least one of {', '.join(map(repr, SENSORS))}")
        for index, name in enumerate(names):
            check_choice(SENSORS, **{f"sensors[{index}]": name})
            if name in names[:index]:
                raise ValueError(f"sensors names {name!r} twice")
        if "camera" in names and not self.camera_size:
            raise ValueError("sensors names 'camera' and camera_size is 0; give the pixels of a side, such as 128")
        if self.camera_size and "camera" not in names:
            raise ValueError(
                f"camera_size is {self.camera_size} and sensors does not name 'camera'; it must, or the size must be 0"
            )
