"""Encoders of pictures, and the shortcuts that the photoreceptors' transformer takes."""

import importlib

import numpy as np
import pytest
import torch
from policy_specs import FOUR, specs

from prnav.domains.navigation.env.spaces import observation_space
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig
from prnav.domains.navigation.sensors import make_sensors
from prnav.errors import ConfigError
from prnav.policy import PolicyConfig, build_policy
from prnav.policy.camera_encoders import PATCH, PICTURES_AT_ONCE, PatchMap, patches, pixels
from prnav.policy.encoders import scale_readings
from prnav.sensors import load_design

SHAPES = {"camera": (1, 32, 32, 3), "design": (1, 7), "gps": (2,), "compass": (1,), "pointgoal": (2,)}
SIZES = {"width": 16, "transformer_heads": 2, "feedforward": 24, "lstm_hidden": 12}


def observations(batch: int) -> dict[str, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    result = {key: torch.rand(batch, *shape, generator=generator) for key, shape in SHAPES.items()}
    result["camera"] = torch.randint(0, 256, result["camera"].shape, generator=generator, dtype=torch.uint8)
    return result


def test_a_camera_token_is_a_flat_patch_its_design_and_its_place():
    encoder = build_policy(PolicyConfig(encoder="camera", **SIZES), specs(SHAPES), FOUR).encoder
    seen = observations(3)
    tokens = encoder.tokens(seen)
    assert tokens.shape == (3, 1 + 1 + 1 + 4, 16)
    for patch, (row, column) in enumerate([(0, 0), (0, PATCH), (PATCH, 0), (PATCH, PATCH)]):
        flat = pixels(seen["camera"])[1, 0, row : row + PATCH, column : column + PATCH].flatten()
        expected = encoder.patch_token(torch.cat([flat, seen["design"][1, 0], encoder.positions[patch]]))
        torch.testing.assert_close(tokens[1, 3 + patch], expected, atol=1e-5, rtol=0)


def test_the_map_of_patches_is_a_linear_layer_of_them_forward_and_backward():
    generator = torch.Generator().manual_seed(2)
    pictures = torch.randint(0, 256, (PICTURES_AT_ONCE + 3, 32, 48, 3), generator=generator, dtype=torch.uint8)
    weight = torch.randn(8, PATCH * PATCH * 3, generator=generator, requires_grad=True)
    above = torch.randn(len(pictures), 6, 8, generator=generator)
    by_hand = pixels(pictures).unfold(1, PATCH, PATCH).unfold(2, PATCH, PATCH).permute(0, 1, 2, 4, 5, 3).flatten(3)
    torch.testing.assert_close(patches(pictures), by_hand.flatten(1, 2), atol=1e-6, rtol=0)
    plain = torch.nn.functional.linear(by_hand.flatten(1, 2), weight)
    (expected,) = torch.autograd.grad((plain * above).sum(), weight)
    mapped = PatchMap.apply(pictures, weight)
    (found,) = torch.autograd.grad((mapped * above).sum(), weight)
    torch.testing.assert_close(mapped, plain, atol=1e-4, rtol=1e-5)
    torch.testing.assert_close(found, expected, atol=1e-4, rtol=1e-5)
    nothing = PatchMap.apply(pictures[:0], weight)
    assert nothing.shape == (0, 6, 8)


def test_a_receptor_token_is_a_reading_its_design_and_its_place():
    shapes = {"photoreceptors": (2, 4, 3), "design": (2, 7), "gps": (2,), "compass": (1,)}
    encoder = build_policy(PolicyConfig(**SIZES), specs(shapes), FOUR).encoder
    seen = {key: torch.rand(3, *shape) for key, shape in shapes.items()}
    tokens = encoder.tokens(seen)
    for sensor in range(2):
        for place in range(4):
            reading = scale_readings(seen["photoreceptors"])[2, sensor, place]
            joined = torch.cat([reading, seen["design"][2, sensor], encoder.positions[place]])
            found = tokens[2, 2 + 4 * sensor + place]
            torch.testing.assert_close(found, encoder.receptor_token(joined), atol=1e-5, rtol=0)


def test_the_last_layer_is_asked_for_the_readout_alone():
    encoder = build_policy(PolicyConfig(encoder="camera", **SIZES), specs(SHAPES), FOUR).encoder
    tokens = encoder.tokens(observations(3))
    for block in encoder.blocks:
        tokens = block(tokens)
    torch.testing.assert_close(encoder(observations(3)), encoder.norm(tokens[:, 0]), atol=1e-5, rtol=0)


@pytest.mark.parametrize("encoder", ["camera", "resnet50"])
def test_what_a_camera_sees_and_its_design_change_the_encoding(encoder):
    if encoder == "resnet50":
        try:
            importlib.import_module("torchvision.models")
        except (ImportError, RuntimeError) as error:
            pytest.skip(f"torchvision of this torch is not installed ({error}); pip install torchvision runs this")
    policy = build_policy(PolicyConfig(encoder=encoder, **SIZES), specs(SHAPES), FOUR)
    seen = observations(2)
    with torch.no_grad():
        before = policy.encoder(seen)
        assert before.shape == (2, 16) and before.isfinite().all()
        other = policy.encoder({**seen, "camera": 255 - seen["camera"]})
        turned = policy.encoder({**seen, "design": seen["design"] + 1.0})
    assert (before != other).any() and (before != turned).any()
    if encoder == "resnet50":
        kinds = {type(layer).__name__ for layer in policy.encoder.backbone.modules()}
        assert "GroupNorm" in kinds and "BatchNorm2d" not in kinds
        assert sum(parameter.numel() for parameter in policy.encoder.backbone.parameters()) > 2e7


def test_what_is_missing_is_said():
    without = {key: shape for key, shape in SHAPES.items() if key != "camera"}
    with pytest.raises(
        ConfigError, match="needs one observation of pictures and one of their design; .* set env.camera_size"
    ):
        build_policy(PolicyConfig(encoder="camera", **SIZES), specs(without), FOUR)
    odd = {**SHAPES, "camera": (1, 40, 40, 3)}
    with pytest.raises(ConfigError, match="multiples of 16; they have 40 x 40 pixels: change env.camera_size"):
        build_policy(PolicyConfig(encoder="camera", **SIZES), specs(odd), FOUR)


def test_a_torchvision_that_cannot_be_used_is_one_line(monkeypatch):
    working = importlib.import_module

    def broken(name: str) -> object:
        if name.startswith("torchvision"):
            raise RuntimeError("operator torchvision::nms does not exist")
        return working(name)

    monkeypatch.setattr("prnav.policy.camera_encoders.importlib.import_module", broken)
    with pytest.raises(ConfigError, match="needs torchvision .operator torchvision::nms does not exist.*install"):
        build_policy(PolicyConfig(encoder="resnet50", **SIZES), specs(SHAPES), FOUR)


def test_the_environment_gives_pictures_of_bytes():
    design = load_design("forward")

    def space_of(config):
        return observation_space(make_sensors(config.sensor_names, config, design))

    space = space_of(PointGoalEnvConfig(camera_size=32))
    assert space["camera"].shape == (2, 32, 32, 3) and space["camera"].dtype == np.uint8
    assert "photoreceptors" not in space.spaces
    assert "camera" not in space_of(PointGoalEnvConfig(camera_size=32, vision=False)).spaces


def test_bfloat16_encodes_nearly_the_same():
    policy = build_policy(PolicyConfig(encoder="camera", **SIZES), specs(SHAPES), FOUR)
    seen = observations(2)
    with torch.no_grad():
        exact = policy._encode(seen)
        policy.encoder_type = torch.bfloat16
        rough = policy._encode(seen)
    assert rough.dtype == torch.float32 and not torch.equal(rough, exact)
    assert (rough - exact).abs().max() < 0.1
