"""Whole homes: the same bytes, nothing broken, one floor to walk on."""

import dataclasses

import numpy as np
import pytest

from prnav.errors import SceneError
from prnav.scene import load_scene
from prnav.scene.export import save_glb
from prnav.scene.houses import SPLIT_SIZES, HouseConfig, generate_house, split_seed
from prnav.scene.houses import manifest as manifest_module
from prnav.scene.houses.manifest import check_hash, house_ids, load_manifest, manifest_text

SEEDS = [split_seed("test", 0), split_seed("val", 2), split_seed("train", 7)]


@pytest.fixture(scope="module")
def homes():
    return [generate_house(seed) for seed in SEEDS]


def test_the_same_seed_gives_the_same_home(homes):
    assert generate_house(SEEDS[0]).hash == homes[0].hash
    assert len({home.hash for home in homes}) == len(homes)


def test_homes_have_the_hashes_of_the_manifest(homes):
    hashes = load_manifest()
    for name, home in zip(["prhouses/test/00", "prhouses/val/02", "prhouses/train/07"], homes, strict=True):
        assert home.hash == hashes[name]
        check_hash(name, home.hash)


@pytest.mark.slow
def test_all_homes_have_the_hashes_of_the_manifest():
    assert {name: generate_house(seed).hash for name, seed in house_ids().items()} == load_manifest()


def test_a_wrong_hash_is_named():
    with pytest.raises(SceneError, match=r"home prhouses/val/00: its SHA-256 is abc, the manifest says [0-9a-f]{64}"):
        check_hash("prhouses/val/00", "abc")


def test_the_manifest_lists_every_home_once():
    hashes = load_manifest()
    assert list(hashes) == list(house_ids())
    assert len(set(house_ids().values())) == len(hashes) == 61 + 8 + 18
    assert manifest_text(hashes) == manifest_module.MANIFEST.read_text(encoding="utf-8")


def test_a_broken_or_old_manifest_is_refused(monkeypatch, tmp_path):
    path = tmp_path / "homes.json"
    monkeypatch.setattr(manifest_module, "MANIFEST", path)
    with pytest.raises(SceneError, match="homes.json: cannot be read"):
        load_manifest()
    path.write_text('{"version": -1, "homes": []}')
    with pytest.raises(SceneError, match="made by version -1 of the generator"):
        load_manifest()


def test_splits_refuse_what_they_do_not_have():
    assert SPLIT_SIZES == {"train": 61, "val": 8, "test": 18}
    with pytest.raises(SceneError, match="split 'dev' is not known; valid: train, val, test"):
        split_seed("dev", 0)
    with pytest.raises(SceneError, match="home 18 of split 'test' does not exist; valid: 0 to 17"):
        split_seed("test", 18)


def test_homes_are_small_furnished_and_textured(homes):
    for home, seed in zip(homes, SEEDS, strict=True):
        assert 3000 < len(home.faces) <= 25000
        assert home.atlas.num_textures > 12
        assert home.vertices[:, 1].min() == 0.0 and home.vertices[:, 1].max() < 3.0
        bare = generate_house(seed, HouseConfig(furniture=False))
        assert len(home.faces) > 1.5 * len(bare.faces)


def test_no_triangle_is_degenerate(homes):
    for home in homes:
        corners = home.vertices[home.faces].astype(np.float64)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        assert area.min() > 1e-7


def test_light_makes_gradients_on_every_large_surface(homes):
    for home in homes:
        level = home.colors.astype(np.float64).mean(axis=1)
        floor = (home.vertices[home.faces][:, :, 1] == 0.0).all(axis=1)
        shades = level[home.faces[floor]]
        assert shades.std() > 8.0
        assert (np.ptp(shades, axis=1) > 1.0).mean() > 0.8


def test_one_island_holds_the_floor(homes):
    from prnav.navmesh import NavMesh

    for home in homes:
        areas = [island.area for island in NavMesh.build(home).islands]
        assert max(areas) >= 0.9 * sum(areas)
        assert max(areas) > 15.0


@pytest.mark.slow
def test_one_island_holds_the_floor_of_every_home():
    from prnav.navmesh import NavMesh

    for name, seed in house_ids().items():
        areas = [island.area for island in NavMesh.build(generate_house(seed)).islands]
        assert max(areas) >= 0.9 * sum(areas), name


def test_an_exported_home_reads_back_the_same(homes, tmp_path, monkeypatch):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path / "cache"))
    home = homes[1]
    save_glb(home, tmp_path / "home.glb")
    back = load_scene(tmp_path / "home.glb")

    order = np.argsort(home.face_texture, kind="stable")  # the file has one primitive per texture
    for field, tolerance in (("vertices", 0.0), ("uvs", 1e-5), ("colors", 0.0)):
        before, after = getattr(home, field)[home.faces[order]], getattr(back, field)[back.faces]
        if field == "uvs":  # plain white needs none
            before, after = before[back.face_texture > 0], after[back.face_texture > 0]
        assert np.allclose(before, after, rtol=0.0, atol=tolerance), field
    for before, after in zip(home.face_texture[order][::50], back.face_texture[::50], strict=True):
        assert np.array_equal(home.atlas.image(before), back.atlas.image(after))


def test_other_programs_read_an_exported_home(homes, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    save_glb(homes[1], tmp_path / "home.glb")
    loaded = trimesh.load(tmp_path / "home.glb", force="scene")
    assert sum(len(part.faces) for part in loaded.geometry.values()) == len(homes[1].faces)
    assert np.allclose(loaded.bounds, homes[1].bounds, atol=1e-5)


def test_config_fields_are_part_of_the_home():
    small = generate_house(5, HouseConfig(min_area=42, max_area=45))
    large = generate_house(5, dataclasses.replace(HouseConfig(), min_area=140, max_area=150))
    assert np.ptp(small.vertices[:, 0]) * np.ptp(small.vertices[:, 2]) < 80.0
    assert np.ptp(large.vertices[:, 0]) * np.ptp(large.vertices[:, 2]) > 120.0
