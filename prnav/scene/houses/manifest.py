"""The list of built-in homes that travels with the package, with the hashes that their arrays must have."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from prnav.aliases import JSONObject
from prnav.cache import hash_arrays
from prnav.errors import SceneError
from prnav.resources import resource
from prnav.scene.houses.config import SPLIT_SIZES, VERSION, split_seed
from prnav.scene.houses.house import describe_house
from prnav.scene.houses.rng import Rng
from prnav.scene.mesh import SceneMesh

NAME = "prhouses-v1"
MANIFEST = resource("scenes", f"{NAME}.json")
"""Where the manifest is."""
TARGETNAV_SEED = 10
TARGETNAV_HOMES = 10
"""TargetNav trains in this many of the training homes, drawn with this seed."""


@dataclass(frozen=True)
class HomeHashes:
    """SHA-256 of a home: of all arrays together (:attr:`SceneMesh.hash`), and of each by name."""

    sha256: str
    arrays: Mapping[str, str]

    @classmethod
    def of(cls, mesh: SceneMesh) -> HomeHashes:
        """The hashes of a mesh."""
        arrays = mesh.to_arrays()
        return cls(mesh.hash, {name: hash_arrays({name: arrays[name]}) for name in sorted(arrays)})


def house_ids() -> dict[str, int]:
    """Seeds of all built-in homes by id."""
    return {
        f"prhouses/{split}/{index:02d}": split_seed(split, index)
        for split, size in SPLIT_SIZES.items()
        for index in range(size)
    }


def ten_homes() -> list[str]:
    """Ids of the training homes that TargetNav trains in, in order."""
    homes = [name for name in house_ids() if name.startswith("prhouses/train/")]
    return sorted(Rng(TARGETNAV_SEED).shuffled(homes)[:TARGETNAV_HOMES])


def load_manifest() -> dict[str, HomeHashes]:
    """Hashes of each built-in home by id.

    Raises:
        SceneError: the manifest is missing, broken, or belongs to another version of the generator.
    """
    try:
        content = json.loads(MANIFEST.read_text(encoding="utf-8"))
        version = content["version"]
        homes = {home["id"]: HomeHashes(home["sha256"], dict(home["arrays"])) for home in content["homes"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SceneError(f"manifest {MANIFEST}: cannot be read ({error}); reinstall prnav") from error
    if version != VERSION:
        raise SceneError(
            f"manifest {MANIFEST}: made by version {version} of the generator, this one is {VERSION}; reinstall prnav"
        )
    return homes


def manifest_text(hashes: Mapping[str, HomeHashes]) -> str:
    """The manifest for these hashes by id, with what the homes' plans say, as JSON text."""
    homes: list[JSONObject] = []
    for name, seed in house_ids().items():
        facts = describe_house(seed)
        homes.append(
            {
                "id": name,
                "seed": seed,
                "storeys": facts.storeys,
                "rooms": facts.rooms,
                "floor_area": facts.floor_area,
                "closed_doors": ["-".join(kinds) for kinds in facts.closed_doors],
                "shut_off": list(facts.shut_off),
                "sha256": hashes[name].sha256,
                "arrays": dict(hashes[name].arrays),
            }
        )
    lines = ",\n".join("  " + json.dumps(home) for home in homes)
    return (
        f'{{\n "name": "{NAME}",\n "version": {VERSION},\n "targetnav": {json.dumps(ten_homes())},\n'
        f' "homes": [\n{lines}\n ]\n}}\n'
    )


def check_hashes(name: str, found: HomeHashes) -> None:
    """Hold a home's hashes to the manifest.

    Raises:
        SceneError: they differ.
    """
    expected = load_manifest().get(name)
    if expected is None or found != expected:
        wanted = {} if expected is None else expected.arrays
        wrong = [array for array, value in found.arrays.items() if wanted.get(array) != value]
        raise SceneError(
            f"home {name}: its SHA-256 is {found.sha256}, the manifest says {expected and expected.sha256}; it differs "
            f"in {', '.join(wrong) or 'the whole'}; delete the cache, and if that does not help report it with your "
            "NumPy version"
        )
