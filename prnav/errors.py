"""The errors a user can cause, and how they read.

Every message is one line that says which file or key, what was found there, and what would be valid or what to do
next. The commands print the message alone and exit with status 2; programs catch :class:`PrnavError`.
"""

from __future__ import annotations


class PrnavError(Exception):
    """Base of all errors that a user's input or machine can cause."""


class ConfigError(PrnavError):
    """A configuration has an unknown key, a wrong type or a value out of range."""


class SceneError(PrnavError):
    """A mesh file is missing, broken, or holds what cannot be used."""


class SceneNote(UserWarning):
    """Something of a scene's files was not found or left out; the scene is loaded all the same."""


class NavMeshError(PrnavError):
    """A navmesh file is broken, or a mesh has no floor to walk on."""


class EpisodeError(PrnavError):
    """An episode file is broken, or an episode does not fit its scene."""


class RenderError(PrnavError):
    """A rendering engine is missing or was asked for something it cannot do."""


class DesignError(PrnavError):
    """A sensor design is not finite, out of range, or has the wrong number of sensors."""


class ControlError(PrnavError):
    """A control task is unknown, its physics engine is missing or too old, or a state does not fit its body."""


class EnvError(PrnavError, ValueError):
    """An environment is asked for what it cannot do: an action that is none, an episode that is not there."""


class CheckpointError(PrnavError):
    """A checkpoint is missing, broken, or belongs to another configuration."""


class RecordError(PrnavError):
    """An evaluation record or run directory is missing or broken."""


class WorkerError(PrnavError):
    """A worker of a run on several processes was lost, or does not agree with the others."""
