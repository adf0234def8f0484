"""MTL files: what an OBJ's materials look like, as far as colour goes.

Read are Kd and map_Kd with its options, and Ke and map_Ke of materials that only glow. Opacity, reflection, bumps and
the like change no colour here.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.scene.side_files import SideFiles, side_key
from prnav.scene.text_files import decode_name, join_continued, plain_bytes

_ONE_WORD = ("-blendu", "-blendv", "-cc", "-clamp", "-texres", "-bm", "-boost", "-imfchan", "-type", "-colorspace")
_UP_TO_THREE = ("-o", "-s", "-t")
_OPTION_BEHIND = re.compile(r"\s-(?:s|o|t|mm|bm|boost|clamp|blendu|blendv|cc|texres|imfchan|type)\s", re.IGNORECASE)
_READ = ("newmtl", "kd", "ke", "map_kd", "map_ke")


@dataclass(frozen=True)
class TextureMap:
    """A picture as a material names it.

    Attributes:
        name: as the file writes it, without options, quotes and comments; ``names`` are other ways to read the line.
        scale: of u and v; a point is looked up at ``scale * uv + offset``.
        offset: of u and v, v up.
        clamp: whether the picture ends at its border instead of repeating.
        base: added to every texel (0..1) after ``gain``.
        gain: factor on every texel.
    """

    names: tuple[str, ...]
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    clamp: bool = False
    base: float = 0.0
    gain: float = 1.0

    @property
    def name(self) -> str:
        """The most likely way to read the line."""
        return self.names[0]


@dataclass
class MtlMaterial:
    """One material of an MTL file."""

    name: str
    library: str  #: the name of its file, as the OBJ gives it
    diffuse: NDArray[np.float64] | None = None  #: Kd, (3,); None where there is none
    emission: NDArray[np.float64] | None = None  #: Ke, (3,)
    diffuse_map: TextureMap | None = None
    emission_map: TextureMap | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def glows(self) -> bool:
        """Whether it has no colour but what it sends out itself."""
        dark = self.diffuse is not None and not self.diffuse.any() and self.diffuse_map is None
        return dark and (self.emission_map is not None or (self.emission is not None and bool(self.emission.any())))

    @property
    def map(self) -> TextureMap | None:
        """The picture that counts."""
        return self.emission_map if self.glows else self.diffuse_map

    def color(self, with_map: bool) -> NDArray[np.float64]:
        """Factor 0..1 on the surface's colour, (3,).

        Args:
            with_map: whether its picture is there; exporters write a black Kd where the picture says it all.
        """
        value = self.emission if self.glows else self.diffuse
        if value is None or (with_map and not value.any()):
            return np.ones(3)
        return np.clip(value, 0.0, 1.0)


def parse_mtl(data: bytes, library: str) -> tuple[list[MtlMaterial], list[str]]:
    """Materials of an MTL file in its order, and what is worth a note.

    Args:
        data: the file's bytes.
        library: its name, as the OBJ gives it.
    """
    materials: list[MtlMaterial] = []
    notes: list[str] = []
    for raw in join_continued(plain_bytes(data)).splitlines():
        line = decode_name(raw).replace("\0", "").strip()
        keyword, _, rest = (*re.split(r"(\s+)", line, maxsplit=1), "", "")[:3]
        keyword = keyword.lower()
        if keyword not in _READ:
            continue
        if keyword == "newmtl":
            materials.append(MtlMaterial(rest.strip(), library))
            continue
        if not materials:
            notes.append(f"{library}: {keyword} stands before any newmtl and is not read")
            continue
        material = materials[-1]
        if keyword in ("kd", "ke"):
            value = _color(rest)
            if value is None:
                notes.append(f"{library}: {line!r:.60} of material {material.name!r} is no colour and is not read")
            elif keyword == "kd":
                material.diffuse = value
            else:
                material.emission = value
            if value is not None and value.max() > 1.0:
                notes.append(f"{library}: {line!r:.60} of material {material.name!r} is above 1 and is cut off there")
        elif keyword == "map_kd":
            material.diffuse_map = _texture_map(rest, notes, library) or material.diffuse_map
        else:
            material.emission_map = _texture_map(rest, notes, library) or material.emission_map
    return materials, notes


def find_material(materials: dict[str, MtlMaterial], name: str) -> MtlMaterial | None:
    """Material that ``usemtl`` names, a comment at the end of the line left aside if that is what it is."""
    for candidate in (name, _before_comment(name), _unquoted(name)):
        if candidate in materials:
            return materials[candidate]
    return None


def library_names(rest: str) -> list[list[str]]:
    """Ways to read what follows ``mtllib``, each a list of file names: names may hold blanks, and there may be many."""
    rest = rest.strip()
    quoted = re.findall(r'"([^"]+)"', rest)
    ways = [quoted] if quoted else []
    for text in dict.fromkeys((rest, _before_comment(rest))):
        ways.append([text])
        parts = [part.strip() for part in re.findall(r".*?\.mtl(?=\s|$)", text, re.IGNORECASE)]
        ways += [parts] if parts else []
        ways.append(text.split())
    return [way for k, way in enumerate(ways) if all(way) and way and way not in ways[:k]]


def obj_side_files(path: Path, data: bytes, side: SideFiles) -> list[str]:
    """Read the materials and images that an OBJ names; the keys of the images."""
    images = []
    for library in _library_keys(_mtllib_lines(data), side):
        content = side.found[library]
        for material in parse_mtl(content, library)[0]:
            texture = material.map
            if texture is not None and side.read(texture.names, library) is not None:
                images.append(side_key(library, texture.name))
    return images


def _mtllib_lines(data: bytes) -> list[str]:
    text = plain_bytes(data)
    if b"mtllib" not in text:
        return []
    lines = [line.strip() for line in join_continued(text).splitlines() if b"mtllib" in line]
    words = [line.split(None, 1) for line in lines]
    return [decode_name(line[1]) for line in words if len(line) == 2 and line[0] == b"mtllib"]


def _library_keys(statements: Sequence[str], side: SideFiles) -> list[str]:
    """Keys of the libraries that are there; a note about each that is not."""
    keys = []
    for rest in statements:
        ways = library_names(rest)
        if not ways:
            continue
        there = [way for way in ways if all(side.read([name], quiet=True) is not None for name in way)]
        # of ways to read a line none of which finds all its files, the one that finds most
        best = (
            there[0] if there else max(ways, key=lambda way: sum(side.read([n], quiet=True) is not None for n in way))
        )
        for name in best:
            if side.read([name]) is not None:
                keys.append(name)
    return list(dict.fromkeys(keys))


def _before_comment(text: str) -> str:
    return re.split(r"\s#", text, maxsplit=1)[0].strip()


def _unquoted(text: str) -> str:
    match = re.match(r'"([^"]+)"', text)
    return match[1].strip() if match else text


def _color(rest: str) -> NDArray[np.float64] | None:
    """Three numbers, or one for grey; None where it is something else."""
    words = _before_comment(rest).split()
    try:
        numbers = np.array([float(word) for word in words[:3]])
    except ValueError:
        return None
    if len(numbers) not in (1, 3) or not np.isfinite(numbers).all() or (numbers < 0).any():
        return None
    return np.broadcast_to(numbers, (3,)).copy()


def _texture_map(rest: str, notes: list[str], library: str) -> TextureMap | None:
    """The picture and its options; None where no name is left."""
    options: dict[str, list[float]] = {}
    clamp = False
    text = rest.strip()
    while match := re.match(r"(-[a-z_]+)\s+", text, re.IGNORECASE):
        option, after = match[1].lower(), text[match.end() :]
        if option in _UP_TO_THREE:
            options[option], text = _take_numbers(after, 3)
        elif option == "-mm":
            options[option], text = _take_numbers(after, 2)
        elif option in _ONE_WORD:
            word, _, text = (*re.split(r"(\s+)", after, maxsplit=1), "", "")[:3]
            clamp = word.lower() == "on" if option == "-clamp" else clamp
        else:
            break  # no option: a name that starts with a minus sign
    names = [name for name in dict.fromkeys((_unquoted(text), text, _before_comment(text))) if name]
    if '"' in text:  # a comment behind a name in quotes
        names = [name for name in names if not name.startswith('"')] or names
    if (behind := _OPTION_BEHIND.search(text)) and behind.start():
        names.append(text[: behind.start()].strip())
        notes.append(f"{library}: options behind the name of {names[-1]!r} are not applied")
    if not names:
        notes.append(f"{library}: a map without a name is not read")
        return None
    scale, offset = options.get("-s", []), options.get("-o", [])
    if any(options.get("-t", [])):
        notes.append(f"{library}: -t (turbulence) of {names[0]!r} is not applied")
    base, gain = (*options.get("-mm", []), *(0.0, 1.0)[len(options.get("-mm", [])) :])
    return TextureMap(
        tuple(names),
        (scale[0] if scale else 1.0, scale[1] if len(scale) > 1 else 1.0),
        (offset[0] if offset else 0.0, offset[1] if len(offset) > 1 else 0.0),
        clamp,
        base,
        gain,
    )


def _take_numbers(text: str, most: int) -> tuple[list[float], str]:
    """Up to ``most`` numbers at the start of a text, and what is left; the last word is never taken for a number."""
    numbers: list[float] = []
    while len(numbers) < most and (
        match := re.match(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s+", text, re.IGNORECASE)
    ):
        numbers.append(float(match[1]))
        text = text[match.end() :]
    return numbers, text
