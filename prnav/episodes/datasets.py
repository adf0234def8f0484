"""Where Habitat keeps the PointNav episodes of a data set: ``datasets/pointnav/{set}/{version}/{split}/``."""

from __future__ import annotations

from pathlib import Path

from prnav.episodes.files import SUFFIXES
from prnav.errors import EpisodeError
from prnav.scene.datasets import LAYOUTS, data_folder


def find_episodes(name: str, root: str | Path, split: str) -> Path:
    """Split file of a data set's episodes, in its lowest version, as Habitat's own configs take it.

    Args:
        name: the data set, one of :data:`prnav.scene.DATA_SETS`.
        root: the data root.
        split: the split.

    Raises:
        EpisodeError: there are no such episodes; says which splits there are.
    """
    base = data_folder(root) / "datasets" / "pointnav"
    splits: list[str] = []
    for folder in _versions(base, name):
        for suffix in SUFFIXES:
            if (file := folder / split / f"{split}{suffix}").is_file():
                return file
        splits += [inner.name for inner in sorted(folder.iterdir()) if inner.is_dir()]
    there = f"splits there: {', '.join(dict.fromkeys(splits))}" if splits else "there are none at all"
    wanted = base / LAYOUTS[name].episodes[0] / "v1" / split / f"{split}.json.gz"
    raise EpisodeError(
        f"data set {name}: no episodes of split {split!r} at {wanted} ({there}); fetch them, name others with "
        f"--episodes-file, or draw some: prnav-episodes generate --data {name} --data-root {root}"
    )


def episode_files_below(root: str | Path) -> list[Path]:
    """All episode files under a folder, in order of their paths."""
    return sorted(path for suffix in SUFFIXES for path in Path(root).rglob(f"*{suffix}") if path.is_file())


def _versions(base: Path, name: str) -> list[Path]:
    """Folders of a data set's versions, lowest first."""
    folders = [base / alias for alias in LAYOUTS[name].episodes]
    found = [path for folder in folders if folder.is_dir() for path in folder.iterdir() if path.is_dir()]
    return sorted(found, key=lambda path: (len(path.name), path.name))
