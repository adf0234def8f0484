"""The generator's own arithmetic: random integers, frames and the walkability of a floor."""

import numpy as np
import pytest

from prnav.scene.houses.builder import Builder, Material
from prnav.scene.houses.occupancy import AGENT_RADIUS, CELL, MAX_POCKET, WALK_RADIUS, Doorway, Occupancy
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES, Frame, Rect
from prnav.scene.houses.textures import TEXTURE_KINDS, draw_texture


def test_random_bits_are_splitmix64():
    # the published reference sequence for seed 1234567
    rng = Rng(1234567)
    assert [rng.bits() for _ in range(3)] == [6457827717110365317, 3203168211198807973, 9817491932198370423]


def test_random_integers_cover_their_range_and_nothing_else():
    rng = Rng(5)
    assert {rng.between(3, 9, 2) for _ in range(200)} == {3, 5, 7, 9}
    assert {rng.below(4) for _ in range(200)} == {0, 1, 2, 3}
    assert sorted(rng.shuffled(range(20))) == list(range(20))
    assert {rng.weighted((("a", 1), ("b", 0), ("c", 3))) for _ in range(100)} == {"a", "c"}


def test_forks_do_not_disturb_each_other():
    one, two = Rng(9), Rng(9)
    one.fork("walls").bits()
    assert one.bits() == two.bits()
    assert Rng(9).fork("a").bits() != Rng(9).fork("b").bits()


@pytest.mark.parametrize("side", SIDES)
def test_a_sides_frame_points_into_the_rectangle(side):
    rect = Rect(-1000, 500, 3000, 2500)
    frame = rect.frame(side)
    x, _, z = frame.point(rect.length(side) // 2, 0, 100)
    assert rect.contains(x, z)
    assert not rect.contains(*frame.point(rect.length(side) // 2, 0, -100)[::2])
    end = frame.point(rect.length(side), 0, 0)
    low, high = sorted((frame.x, end[0])) if side % 2 == 0 else sorted((frame.z, end[2]))
    assert rect.along(side, low, high) == (0, rect.length(side))


def test_frames_compose_and_keep_handedness():
    outer, inner = Frame(10, 20, 30, 1), Frame(3, 4, 5, 2)
    composed = outer.at(inner.x, inner.y, inner.z, inner.turns)
    point = (7, -8, 9)
    assert composed.point(*point) == outer.point(*inner.point(*point))
    x, y, z = (np.subtract(composed.point(*axis), composed[:3]) for axis in np.eye(3, dtype=int).tolist())
    assert np.linalg.det(np.stack([x, y, z])) == pytest.approx(1.0)


def test_boxes_and_cylinders_face_outwards():
    builder = Builder()
    pen = builder.pen(-1, Frame(100, 0, 200, 3))
    pen.box(0, 10, 0, 400, 500, 300, Material("", (255, 255, 255)))
    pen.at(2000, 0, 0).cylinder(0, 0, 10, 500, 300, Material("", (255, 255, 255)), sides=12, top_radius=100)
    geometry = builder.finish()
    corners = geometry.positions[geometry.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(cross, axis=1).min() > 0.0
    box = corners[:, :, 2].max(axis=1) > -300
    for solid in (box, ~box):
        inside = corners[solid].reshape(-1, 3).mean(axis=0)
        assert (np.einsum("fi,fi->f", cross[solid], corners[solid].mean(axis=1) - inside) > 0.0).all()
        # closed: the vector area of the surface is zero
        assert np.abs(cross[solid].sum(axis=0)).max() < 1e-6 * np.abs(cross[solid]).sum()


def reference_walkable(floor, doors, taken):
    """Brute force for Occupancy.is_walkable on boolean arrays (columns, rows)."""

    def free(radius):
        blocked = np.pad(taken, radius, constant_values=True)
        result = np.ones_like(taken)
        for dx in range(2 * radius + 1):
            for dz in range(2 * radius + 1):
                result &= ~blocked[dx : dx + taken.shape[0], dz : dz + taken.shape[1]]
        return result

    def fill(start, room):
        seen, stack = np.zeros_like(room), [start]
        while stack:
            x, z = stack.pop()
            if 0 <= x < room.shape[0] and 0 <= z < room.shape[1] and room[x, z] and not seen[x, z]:
                seen[x, z] = True
                stack += [(x + 1, z), (x - 1, z), (x, z + 1), (x, z - 1)]
        return seen

    wide = fill(doors[0], free(WALK_RADIUS))
    narrow = free(AGENT_RADIUS)
    cut_off = narrow & ~fill(doors[0], narrow)
    return all(wide[door] for door in doors) and cut_off.sum() <= MAX_POCKET


def test_walkability_agrees_with_brute_force():
    rng = Rng(3)
    inner = Rect(-1000, -500, 1500, 1400)
    doors = [(6, 6), (40, 30)]
    landings = [(inner.x0 + x * CELL + 10, inner.z0 + z * CELL + 10) for x, z in doors]
    nowhere = Rect(inner.x0, inner.z0, inner.x0, inner.z0)
    answers = []
    for _ in range(120):
        floor = Occupancy(inner, [Doorway(landing, nowhere) for landing in landings])
        taken = np.zeros((floor.columns, floor.rows), dtype=bool)
        for _ in range(rng.between(1, 5)):
            x, z = rng.below(45), rng.below(34)
            w, d = rng.between(1, 16), rng.between(1, 16)
            taken[x : x + w, z : z + d] = True
            corner = inner.x0 + x * CELL, inner.z0 + z * CELL
            floor.take(Rect(*corner, corner[0] + w * CELL, corner[1] + d * CELL))
        answers.append(floor.is_walkable(floor.taken))
        assert answers[-1] == reference_walkable(floor, doors, taken)
    assert 10 < sum(answers) < 110


@pytest.mark.parametrize("kind", TEXTURE_KINDS)
def test_textures_are_small_lively_and_repeatable(kind):
    image = draw_texture(f"{kind}:1", 7)
    assert image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 3
    assert max(image.shape[:2]) <= 128
    assert image.std() > 0.5
    assert np.array_equal(image, draw_texture(f"{kind}:1", 7))
    varies = kind not in ("screen", "mirror")
    assert np.array_equal(image, draw_texture(f"{kind}:1", 8)) != varies
