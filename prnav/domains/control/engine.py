"""MuJoCo, imported in one place: ``from prnav.domains.control.engine import mujoco``.

Physics needs the batch interface of MuJoCo 4. Without it, importing this module raises one clear error, and nothing of
``prnav`` outside this package imports it before a control task is made.
"""

from __future__ import annotations

from prnav.errors import ControlError

OLDEST = 4
"""First major version of MuJoCo that will do."""
REMEDY = 'pip install "prnav[control]"'

try:
    import mujoco
except ImportError as error:
    raise ControlError(f"continuous control needs MuJoCo, which cannot be imported ({error}); {REMEDY}") from error


def check_version(version: str) -> None:
    """Pass on a MuJoCo version that is new enough.

    Raises:
        ControlError: it is older than 4.0.
    """
    if int(version.split(".")[0]) < OLDEST:
        raise ControlError(f"MuJoCo {version} is too old, continuous control needs {OLDEST}.0 or newer; {REMEDY}")


check_version(mujoco.__version__)
import mujoco.batch  # noqa: E402  the version decides whether it exists


class Quiet:
    """Keep MuJoCo's warnings off the console and out of its log file within; who steps simulations counts them."""

    _silent = mujoco.MjLogConfig.get()
    _silent.logto_console = _silent.logto_file = False

    def __enter__(self) -> None:
        self._before = mujoco.MjLogConfig.get()
        self._silent.set()

    def __exit__(self, *_: object) -> None:
        self._before.set()


__all__ = ["OLDEST", "check_version", "mujoco", "Quiet"]
