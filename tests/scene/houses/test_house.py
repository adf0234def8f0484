"""Whole homes: the same bytes, nothing broken, one floor to walk on."""

import dataclasses

import numpy as np
import pytest

from prnav.episodes import generate_table
from prnav.errors import SceneError
from prnav.scene import load_scene, scene_ids, ten_training_homes
from prnav.scene.export import save_glb
from prnav.scene.houses import (
    SPLIT_SIZES,
    HouseConfig,
    count_furniture,
    describe_house,
    generate_house,
    plan_house,
    split_seed,
)
from prnav.scene.houses import manifest as manifest_module
from prnav.scene.houses.manifest import (
    HomeHashes,
    check_hashes,
    house_ids,
    load_manifest,
    manifest_text,
    ten_homes,
)

SEEDS = [split_seed("test", 0), split_seed("val", 2), split_seed("train", 7)]


@pytest.fixture(scope="module")
def homes():
    return [generate_house(seed) for seed in SEEDS]


def test_the_same_seed_gives_the_same_home(homes):
    assert generate_house(SEEDS[0]).hash == homes[0].hash
    assert len({home.hash for home in homes}) == len(homes)


def test_every_array_has_the_hash_of_the_manifest(homes):
    hashes = load_manifest()
    for name, home in zip(["prhouses/test/00", "prhouses/val/02", "prhouses/train/07"], homes, strict=True):
        assert set(hashes[name].arrays) == set(home.to_arrays())
        assert HomeHashes.of(home) == hashes[name]
        check_hashes(name, HomeHashes.of(home))


@pytest.mark.slow
def test_every_array_of_every_home_has_the_hash_of_the_manifest():
    assert {name: HomeHashes.of(generate_house(seed)) for name, seed in house_ids().items()} == load_manifest()


def test_a_wrong_hash_is_named(homes):
    colors = homes[1].colors.copy()
    colors[7] ^= 1
    changed = HomeHashes.of(dataclasses.replace(homes[1], colors=colors))
    wanted = r"home prhouses/val/02: its SHA-256 is [0-9a-f]{64}, the manifest says [0-9a-f]{64}; it differs in colors;"
    with pytest.raises(SceneError, match=wanted):
        check_hashes("prhouses/val/02", changed)
    with pytest.raises(SceneError, match="the manifest says None"):
        check_hashes("prhouses/val/99", changed)


def test_targetnav_has_ten_training_homes():
    ids = ten_homes()
    assert ids == ten_training_homes() == sorted(ids) and len(set(ids)) == 10
    assert set(ids) <= set(scene_ids("train"))
    assert ids[0] == "prhouses/train/06" and ids[-1] == "prhouses/train/56"


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


def test_homes_are_furnished_and_textured(homes):
    for home, seed in zip(homes, SEEDS, strict=True):
        assert 5000 < len(home.faces) <= 45000
        assert home.atlas.num_textures > 12
        storeys = plan_house(seed)
        assert home.vertices[:, 1].min() == 0.0
        top = (storeys[-1].level + storeys[-1].height) / 1000
        assert top <= home.vertices[:, 1].max() < top + 0.2
        bare = generate_house(seed, HouseConfig(furniture=False))
        assert len(home.faces) > 1.5 * len(bare.faces)


def test_there_are_more_than_thirty_kinds_of_furniture():
    kinds: dict[str, int] = {}
    for index in range(4):
        for kind, count in count_furniture(split_seed("val", index)).items():
            kinds[kind] = kinds.get(kind, 0) + count
    assert len(kinds) >= 30
    assert {"bed", "sofa", "counter", "toilet", "desk", "wardrobe", "dining_table"} <= set(kinds)


def test_facts_of_a_home_are_those_of_its_plan():
    seed = split_seed("val", 2)
    facts, storeys = describe_house(seed), plan_house(seed)
    assert facts.storeys == len(storeys) == 2
    assert facts.rooms == sum(len(storey.rooms) for storey in storeys) - 2
    assert 100.0 < facts.floor_area < 500.0
    closed = sum(opening.leaf == "closed" for storey in storeys for opening in storey.openings)
    assert len(facts.closed_doors) == closed >= len(facts.shut_off)


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


def test_one_island_holds_the_floor_of_every_storey(homes):
    from prnav.navmesh import NavMesh

    for home, seed in zip(homes, SEEDS, strict=True):
        assert_one_floor(NavMesh.build(home), seed, str(seed))


@pytest.mark.slow
def test_one_island_holds_the_floor_of_every_home():
    from prnav.navmesh import NavMesh

    areas = []
    for name, seed in house_ids().items():
        navmesh = NavMesh.build(generate_house(seed))
        assert_one_floor(navmesh, seed, name)
        assert len(generate_table(navmesh, name, 50, 1)) == 50
        areas.append(navmesh.area)
    assert 40.0 <= min(areas) and max(areas) <= 300.0


def assert_one_floor(navmesh, seed, name):
    """One island holds 90 % of the walkable area, and some of every room that is not shut off."""
    areas = [island.area for island in navmesh.islands]
    assert max(areas) >= 0.9 * sum(areas), name
    points = navmesh.random_points(12000, 0)
    points = points[navmesh.island_of(points) == int(np.argmax(areas))] * 1000.0
    empty = []
    for storey in plan_house(seed):
        here = points[np.abs(points[:, 1] - storey.level) < 500.0]
        for room in storey.rooms:
            x, z, inner = here[:, 0], here[:, 2], room.inner
            if not ((x > inner.x0) & (x < inner.x1) & (z > inner.z0) & (z < inner.z1)).any():
                empty.append(room.kind)
    assert sorted(empty) == sorted(describe_house(seed).shut_off), name


def test_stairs_are_walked_up_and_down_in_steps(homes):
    from prnav.navmesh import NavMesh

    navmesh = NavMesh.build(homes[1])
    level = plan_house(SEEDS[1])[1].level / 1000
    largest = int(np.argmax([island.area for island in navmesh.islands]))
    points = navmesh.random_points(300, 1)
    points = points[navmesh.island_of(points) == largest]
    low = points[np.abs(points[:, 1]) < 0.3][:6]
    high = points[np.abs(points[:, 1] - level) < 0.3][:6]
    assert len(low) == len(high) == 6
    for start, goal in [*zip(low, high, strict=True), *zip(high, low, strict=True)]:
        end, steps = walk(navmesh, start, goal)
        assert np.linalg.norm(end - goal) < 0.1
        assert steps * 0.25 < 1.5 * navmesh.distance(start, goal) + 5.0


def walk(navmesh, position, goal):
    """Follow the shortest path in steps of at most 0.25 m; the end and the number of steps."""
    steps = 0
    while steps < 500:
        ahead = [way for way in navmesh.path(position, goal)[1:] if np.hypot(*(way - position)[[0, 2]]) > 0.02]
        if not ahead:
            break
        offset = ahead[0] - position
        offset *= min(1.0, 0.25 / np.hypot(offset[0], offset[2]))
        position = navmesh.step(position[None], (position + offset)[None])[0][0]
        steps += 1
    return position, steps


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
    large = generate_house(5, HouseConfig(min_area=140, max_area=150, storeys=1))
    tall = generate_house(5, HouseConfig(min_area=140, max_area=150, storeys=2))
    assert np.ptp(small.vertices[:, 0]) * np.ptp(small.vertices[:, 2]) < 80.0
    assert np.ptp(large.vertices[:, 0]) * np.ptp(large.vertices[:, 2]) > 120.0
    assert np.ptp(large.vertices[:, 1]) < 3.0 < 4.5 < np.ptp(tall.vertices[:, 1])
