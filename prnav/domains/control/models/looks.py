"""What the three bodies share in looks: sky, floor texture, materials, headlight and the light above the scene.

Colours are linear RGB(A) in 0..1, as MuJoCo takes them. The suite's materials come in groups: a plain one and variants
of it that a viewer may switch to; only the plain ones are used here, but all are part of the recorded models.
"""

from __future__ import annotations

from prnav.domains.control.engine import mujoco

RGB = tuple[float, float, float]
RGBA = tuple[float, float, float, float]

MATERIALS: dict[str, RGBA] = {
    "self": (0.7, 0.5, 0.3, 1.0),
    "self_default": (0.7, 0.5, 0.3, 1.0),
    "self_highlight": (0.0, 0.5, 0.3, 1.0),
    "effector": (0.7, 0.4, 0.2, 1.0),
    "effector_default": (0.7, 0.4, 0.2, 1.0),
    "effector_highlight": (0.0, 0.5, 0.3, 1.0),
    "decoration": (0.3, 0.5, 0.7, 1.0),
    "eye": (0.0, 0.2, 1.0, 1.0),
    "target": (0.6, 0.3, 0.3, 1.0),
    "target_default": (0.6, 0.3, 0.3, 1.0),
    "target_highlight": (0.6, 0.3, 0.3, 0.4),
    "site": (0.5, 0.5, 0.5, 0.3),
}
"""Materials besides the floor's "grid"."""
SKY_TOP: RGB = (0.4, 0.6, 0.8)
SKY_BOTTOM: RGB = (0.0, 0.0, 0.0)
SKY_SIZE = 800
"""Texels per side of each of the sky's six faces."""
SKY_MARKS: RGB = (1.0, 1.0, 1.0)
"""Colour of the random dots ("stars") in the sky."""
SKY_MARK_SHARE = 0.01
"""Share of the sky's texels that are dots."""
FLOOR_DARK: RGB = (0.1, 0.2, 0.3)
FLOOR_BRIGHT: RGB = (0.2, 0.3, 0.4)
FLOOR_SIZE = 300
"""Texels per side of the floor's checker of 2 x 2 squares."""
FLOOR_REFLECTANCE = 0.2


def add_looks(spec: mujoco.MjSpec) -> None:
    """Add the sky, the floor's checker, all materials and the headlight to a model."""
    spec.add_texture(
        name="skybox",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=SKY_TOP,
        rgb2=SKY_BOTTOM,
        width=SKY_SIZE,
        height=SKY_SIZE,
        mark=mujoco.mjtMark.mjMARK_RANDOM,
        markrgb=SKY_MARKS,
        random=SKY_MARK_SHARE,
    )
    spec.add_texture(
        name="grid",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=FLOOR_DARK,
        rgb2=FLOOR_BRIGHT,
        width=FLOOR_SIZE,
        height=FLOOR_SIZE,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        markrgb=FLOOR_BRIGHT,
    )
    grid = spec.add_material(name="grid", texrepeat=(1.0, 1.0), texuniform=True, reflectance=FLOOR_REFLECTANCE)
    grid.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "grid"
    for name, rgba in MATERIALS.items():
        spec.add_material(name=name, rgba=rgba)
    headlight = spec.visual.headlight
    headlight.active = 1
    headlight.ambient = (0.4, 0.4, 0.4)
    headlight.diffuse = (0.8, 0.8, 0.8)
    headlight.specular = (0.1, 0.1, 0.1)
    spec.visual.map.znear = 0.01  # near plane, as a share of the model's extent
    spec.visual.quality.shadowsize = 2048
