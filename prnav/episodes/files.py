"""Episode files in Habitat's two layouts: all in ``{split}.json.gz``, or scene by scene in ``content/*.json.gz``.

A file is recognised by its content (gzip or plain JSON), not by its name. Reading is bounded: a small file that
unpacks to gigabytes is refused before it fills the memory.
"""

from __future__ import annotations

import gzip
import io
import itertools
import json
import os
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from prnav.aliases import JSONObject
from prnav.episodes.episode import Episode, EpisodeDataset, episode_from_record, episode_to_record
from prnav.errors import EpisodeError
from prnav.files import atomic_path, write_bytes

MAX_BYTES = 4 << 30  #: largest unpacked file that is read
MAX_RATIO = 100  #: a file that unpacks to more than this multiple is refused ...
RATIO_FREE_BYTES = 32 << 20  #: ... from this size on; episode files pack 3 to 20 times

HEADER_BYTES = 64 << 10  #: in which the keys before ``episodes`` must end where only they are read

SUFFIXES = (".json.gz", ".json")


def load_episodes(path: str | Path, split: str | None = None) -> EpisodeDataset:
    """Episodes of a file or of a folder in Habitat's layout.

    Args:
        path: a ``.json.gz`` or ``.json`` file; or a folder with ``{split}.json.gz`` or ``{split}/{split}.json.gz``.
            Files in a folder ``content`` beside the split file belong to it and follow its own episodes in name order.
        split: which split of a folder; may be left out where the folder holds one.

    Raises:
        EpisodeError: nothing there, not JSON, damaged, or an episode that is not one; names file, episode and key.
    """
    header: JSONObject = {}
    episodes: list[Episode] = []
    for file in episode_files(path, split):
        file_header, file_episodes = read_episode_file(file)
        header = {**file_header, **header}
        episodes.extend(file_episodes)
    if not episodes:
        raise EpisodeError(f"{path}: holds no episodes; generate some with prnav-episodes generate")
    return EpisodeDataset(tuple(episodes), header)


def episode_files(path: str | Path, split: str | None = None) -> list[Path]:
    """The files a data set consists of: the split file, then its ``content`` files in name order.

    Raises:
        EpisodeError: there is no such split file, or several and no ``split`` that chooses.
    """
    main = _split_file(Path(path), split)
    content = main.parent / "content"
    if content.is_dir():
        return [main, *sorted(file for file in content.iterdir() if file.name.endswith(SUFFIXES))]
    return [main]


def episode_splits(path: str | Path) -> list[str]:
    """Names of the splits in a folder of episodes, none for a file or where there is nothing."""
    folder = Path(path)
    if not folder.is_dir():
        return []
    names = [_stem(file.name) for file in sorted(folder.glob("*.json*")) if file.name.endswith((".json.gz", ".json"))]
    names += sorted(inner.name for inner in folder.iterdir() if (inner / f"{inner.name}.json.gz").is_file())
    return list(dict.fromkeys(names))


def _split_file(path: Path, split: str | None) -> Path:
    if path.is_file():
        return path
    if not path.is_dir():
        raise EpisodeError(f"{path}: no such file or folder; give an episode file (.json.gz) or a folder with one")
    if split is not None:
        for folder in (path, path / split):
            for suffix in SUFFIXES:
                if (folder / (split + suffix)).is_file():
                    return folder / (split + suffix)
    found = sorted(file for file in path.iterdir() if file.is_file() and file.name.endswith(SUFFIXES))
    if split is None and len(found) == 1:
        return found[0]
    splits = [_stem(file.name) for file in found]
    splits += sorted(folder.name for folder in path.iterdir() if (folder / f"{folder.name}.json.gz").is_file())
    if split is None and len(splits) == 1:
        return path / splits[0] / f"{splits[0]}.json.gz"
    wanted = "several splits" if split is None else f"no split {split!r}"
    if not splits:
        raise EpisodeError(f"{path}: no episode file (.json.gz) in this folder")
    raise EpisodeError(f"{path}: {wanted} here; valid: {', '.join(splits)}")


def read_episode_file(path: Path) -> tuple[JSONObject, list[Episode]]:
    """Top-level keys other than ``episodes``, and the episodes, of one file (``content`` files not included).

    Raises:
        EpisodeError: the file is not readable, damaged, too large, or not an episode file.
    """
    try:
        values = json.loads(_read_bounded(path))
    except (ValueError, RecursionError) as error:  # JSON, UTF-8 and digit limits are all ValueError
        raise EpisodeError(f"{path}: not valid JSON ({error}); the file is damaged or not an episode file") from error
    if not isinstance(values, dict) or not isinstance(values.get("episodes"), list):
        raise EpisodeError(f"{path}: no list 'episodes' at the top level; this is not a Habitat PointNav file")
    records = values.pop("episodes")
    return values, [episode_from_record(record, str(path), index) for index, record in enumerate(records)]


def _read_bounded(path: Path) -> bytes:
    """Unpacked bytes of a gzip or plain file."""
    try:
        with open(path, "rb") as file:
            size = os.fstat(file.fileno()).st_size  # read(n) sets n bytes aside, however few there are
            packed = file.read(min(size, MAX_BYTES) + 1)
    except OSError as error:
        raise EpisodeError(f"{path}: cannot be read ({error.strerror or error})") from error
    if not packed.startswith(b"\x1f\x8b"):
        if len(packed) > MAX_BYTES:
            raise EpisodeError(
                f"{path}: larger than {MAX_BYTES >> 30} GiB; split it into content/ files, one per scene"
            )
        return packed
    parts: list[bytes] = []
    total = 0
    allowed = min(MAX_BYTES, max(RATIO_FREE_BYTES, MAX_RATIO * len(packed)))
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(packed)) as unpacked:
            while part := unpacked.read(1 << 20):
                parts.append(part)
                total += len(part)
                if total > allowed:
                    raise EpisodeError(
                        f"{path}: {len(packed)} bytes unpack to more than {allowed}; this is no episode file, or one "
                        "to split into content/ files, one per scene"
                    )
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise EpisodeError(f"{path}: damaged gzip ({error}); copy or generate the file again") from error
    return b"".join(parts)


def save_episodes(dataset: EpisodeDataset, path: str | Path, content: bool = False) -> list[Path]:
    """Write a data set; the same data set gives the same bytes, and no file is ever half written.

    Args:
        dataset: what to write.
        path: the split file; ``.json.gz`` is packed, ``.json`` is not.
        content: write the episodes scene by scene to ``content/`` beside it, and an empty list to the split file.

    Returns:
        The files written.
    """
    path = Path(path)
    if not path.name.endswith(SUFFIXES):
        raise EpisodeError(f"{path}: episode files end in {' or '.join(SUFFIXES)}")
    if not content:
        write_bytes(path, _encode(dataset.header, dataset.episodes, path.name))
        return [path]
    written = []
    for scene_id, name in content_names(dataset.scene_ids).items():
        file = path.parent / "content" / f"{name}.json.gz"
        write_bytes(file, _encode({}, (e for e in dataset.episodes if e.scene_id == scene_id), file.name))
        written.append(file)
    write_bytes(path, _encode(dataset.header, (), path.name))  # last: a data set is there when its split file is
    return [*written, path]


def write_episode_stream(path: str | Path, header: JSONObject, records: Iterable[str]) -> None:
    """Write a ``.json.gz`` file from the JSON texts of its episodes, one after another; it is never half written.

    Packed less tightly than :func:`save_episodes` does, at a fraction of the time.
    """
    opening = json.dumps({**header, "episodes": []})[:-2]
    with atomic_path(path) as temporary, open(temporary, "wb") as raw:
        with gzip.GzipFile(filename="", mode="wb", fileobj=raw, mtime=0, compresslevel=6) as file:
            file.write(opening.encode())
            separator = ""
            records = iter(records)
            while piece := list(itertools.islice(records, 1000)):
                file.write((separator + ", ".join(piece)).encode())
                separator = ", "
            file.write(b"]}")


def read_header(path: Path) -> JSONObject | None:
    """Top-level keys before ``episodes`` of a ``.json.gz`` file, without reading on; None where there is no such file.

    A file that is damaged in its first :data:`HEADER_BYTES` bytes, or that has no ``episodes`` there, counts as none.
    """
    try:
        with gzip.open(path) as file:
            text = file.read(HEADER_BYTES).decode()
        values = json.loads(text[: text.index('"episodes": [')] + '"episodes": []}')
    except (OSError, EOFError, zlib.error, ValueError, RecursionError):
        return None
    return {key: value for key, value in values.items() if key != "episodes"} if isinstance(values, dict) else None


def content_names(scene_ids: Iterable[str]) -> dict[str, str]:
    """File name under ``content/`` per scene: the scene file's stem, or the whole id where two stems are alike."""
    ids = list(scene_ids)
    stems = [_stem(scene_id.rsplit("/", 1)[-1]) for scene_id in ids]
    return {
        scene_id: stem if stems.count(stem) == 1 else "_".join(part for part in scene_id.split("/") if part.strip("."))
        for scene_id, stem in zip(ids, stems, strict=True)
    }


def _stem(name: str) -> str:
    return name.split(".", 1)[0] or name.strip(".")


def _encode(header: JSONObject, episodes: Iterable[Episode], name: str) -> bytes:
    text = json.dumps({**header, "episodes": list(_records(episodes))})
    if not name.endswith(".gz"):
        return text.encode()
    buffer = io.BytesIO()
    with gzip.GzipFile(filename="", mode="wb", fileobj=buffer, mtime=0, compresslevel=9) as file:
        file.write(text.encode())
    return buffer.getvalue()


def _records(episodes: Iterable[Episode]) -> Iterator[JSONObject]:
    return (episode_to_record(episode) for episode in episodes)
