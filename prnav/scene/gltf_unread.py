"""What of a glTF file is not read: one list, which ``docs/data.md`` shows and a test holds it to."""

from __future__ import annotations

from prnav.aliases import JSONObject
from prnav.scene import decoders
from prnav.scene.gltf import READ, GltfFile

SHADING = "KHR_materials_"
"""Start of the names of extensions that change shading alone; what they mean for colour is read where they say so."""

COLOUR_EXTENSIONS = ("KHR_materials_pbrSpecularGlossiness", "KHR_materials_emissive_strength", "KHR_materials_unlit")
"""Those of them that are read."""

NOT_READ = {
    "points, lines": "left out, with a note",
    "skins": "left as they are stored, with a note",
    "morph targets": "left at rest, with a note where weights are set",
    "animations": "left at rest, with a note",
    "cameras": "left aside",
    "alpha": "every surface is opaque; neither alphaMode nor the alpha of colours and textures counts",
    "normal, occlusion, metallic-roughness textures": "left aside: a reading knows no lights",
    "emission beside a base colour": "left aside: only materials whose base colour is black or not given show it",
    "other COLOR_n and TEXCOORD_n": "COLOR_0 and the set that the colour's texture names are read",
    "KHR_lights_punctual": "left aside",
    "KHR_materials_*": "left aside, but for pbrSpecularGlossiness, emissive_strength and unlit",
    "KHR_xmp_json_ld": "left aside",
    "EXT_mesh_gpu_instancing": "refused by name",
    "other extensions": "refused by name where the file requires them, else left aside with a note",
}
"""Part of the format, and what becomes of it."""


def unread_notes(file: GltfFile) -> list[str]:
    """A sentence on each thing that a file has and that is left out."""
    notes = []
    used = file.document.get("extensionsUsed", [])
    for name in dict.fromkeys(map(str, used)) if isinstance(used, list) else ():
        if name not in READ and not name.startswith(SHADING) and name not in decoders.LIBRARIES:
            notes.append(f"its glTF extension {name!r:.60} is not read")
    kinds = [primitive.get("mode", 4) for primitive in _primitives(file)]
    if count := sum(kind in (0, 1, 2, 3) for kind in kinds):
        notes.append(f"{count} {'primitive' if count == 1 else 'primitives'} of points or lines left out")
    if count := len(file.items("animations")):
        notes.append(f"{count} {'animation' if count == 1 else 'animations'} left at rest")
    if count := len(file.items("skins")):
        notes.append(f"{count} {'skin' if count == 1 else 'skins'} not applied, its vertices stay as they are stored")
    owners = [*file.items("meshes"), *file.items("nodes")]
    if any(isinstance(owner.get("weights"), list) and any(owner["weights"]) for owner in owners):
        notes.append("morph targets left at rest, though weights are set")
    return notes


def _primitives(file: GltfFile) -> list[JSONObject]:
    lists = [mesh.get("primitives", []) for mesh in file.items("meshes")]
    return [item for one in lists if isinstance(one, list) for item in one if isinstance(item, dict)]
