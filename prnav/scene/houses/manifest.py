"""The list of built-in homes that travels with the package, with the hash each must have."""

from __future__ import annotations

import json
from typing import Any

from prnav.errors import SceneError
from prnav.resources import resource
from prnav.scene.houses.config import SPLIT_SIZES, VERSION, split_seed

MANIFEST = resource("scenes", "prhouses-v0.json")
"""Where the manifest is."""


def house_ids() -> dict[str, int]:
    """Seeds of all built-in homes by id."""
    return {
        f"prhouses/{split}/{index:02d}": split_seed(split, index)
        for split, size in SPLIT_SIZES.items()
        for index in range(size)
    }


def load_manifest() -> dict[str, str]:
    """SHA-256 (:attr:`SceneMesh.hash`) of each built-in home by id.

    Raises:
        SceneError: the manifest is missing, broken, or belongs to another version of the generator.
    """
    try:
        content = json.loads(MANIFEST.read_text(encoding="utf-8"))
        version, homes = content["version"], {home["id"]: home["sha256"] for home in content["homes"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SceneError(f"manifest {MANIFEST}: cannot be read ({error}); reinstall prnav") from error
    if version != VERSION:
        raise SceneError(
            f"manifest {MANIFEST}: made by version {version} of the generator, this one is {VERSION}; reinstall prnav"
        )
    return homes


def manifest_text(hashes: dict[str, str]) -> str:
    """The manifest for these hashes by id, as JSON text."""
    seeds = house_ids()
    homes: list[dict[str, Any]] = [{"id": name, "seed": seeds[name], "sha256": hashes[name]} for name in seeds]
    lines = ",\n".join("  " + json.dumps(home) for home in homes)
    return f'{{\n "name": "prhouses-v0",\n "version": {VERSION},\n "homes": [\n{lines}\n ]\n}}\n'


def check_hash(name: str, value: str) -> None:
    """Hold a home's hash to the manifest.

    Raises:
        SceneError: it differs.
    """
    expected = load_manifest().get(name)
    if value != expected:
        raise SceneError(
            f"home {name}: its SHA-256 is {value}, the manifest says {expected}; delete the cache, and if that does "
            "not help report it with your NumPy version"
        )
