"""What receptors saw along the episodes that are shown, kept beside the records so that no scene is needed later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.contracts.records import Evaluation, Trace, pick_episodes
from prnav.errors import RecordError
from prnav.files import atomic_path
from prnav.stored_arrays import BROKEN, Like, read_arrays

if TYPE_CHECKING:
    from prnav.domains.navigation.env.slots import NavigationSlots

SIGHTS = "sights.npz"

_CHUNK = 256  # steps rendered at once


def record_sights(evaluation: Evaluation, traces: Sequence[Trace], slots: NavigationSlots) -> None:
    """Write ``sights.npz``: readings along the episodes of :func:`prnav.contracts.records.pick_episodes`, in 8 bits.

    An agent without light leaves no such file.
    """
    path = evaluation.directory / SIGHTS
    if slots.light is None:
        path.unlink(missing_ok=True)
        return
    index = {episode: row for row, episode in enumerate(slots.source.ids)}
    picked = [row for rows in pick_episodes(evaluation.rows).values() for row in rows]
    arrays: dict[str, NDArray[np.generic]] = {"rows": np.array(picked, np.int64), "grid": np.array(slots.config.grid)}
    for row in picked:
        record, track = evaluation.rows[row], traces[row]
        episode = index[record["scene_id"], record["episode_id"]]
        parts = []
        for begin in range(0, len(track["positions"]), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            steps = np.arange(begin, begin + len(track["positions"][part]))
            seen = slots.readings_along(episode, track["positions"][part], track["yaws"][part], steps)
            parts.append(np.round(255.0 * seen).astype(np.uint8))
        arrays[f"readings_{row}"] = np.concatenate(parts)
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def load_sights(directory: str | Path) -> Mapping[int, NDArray[np.uint8]]:
    """Readings by row of the records, each (T + 1, K, B, B, 3) in 0..255; empty where none were kept.

    Raises:
        RecordError: the file is broken.
    """
    path = Path(directory) / SIGHTS
    if not path.exists():
        return {}
    try:
        stored = read_arrays(path)
        Like("iu", 1).check("rows", stored["rows"])
        Like("iu", 0).check("grid", stored["grid"])
        grid, sights = int(stored["grid"]), {}
        for row in stored["rows"].tolist():
            seen = stored[f"readings_{row}"]
            if seen.dtype != np.uint8 or seen.ndim < 3:
                raise ValueError(f"'readings_{row}' are of type {seen.dtype}, {seen.ndim} dimensions")
            sights[int(row)] = seen.reshape(*seen.shape[:2], grid, grid, 3)
        return sights
    except BROKEN as error:
        raise RecordError(f"{path}: cannot be read ({error}); evaluate again with prnav-eval") from error
