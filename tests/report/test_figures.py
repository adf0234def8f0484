import numpy as np
import pytest

from prnav.evaluate.maps import load_maps
from prnav.evaluate.records import load_evaluation, load_trajectories
from prnav.report.curves import draw_curves, series, smooth
from prnav.report.designs import REACH, Sight, draw_design, frusta
from prnav.report.style import save_png
from prnav.report.topdown import draw_episodes, draw_house, pick_episodes
from prnav.sensors import load_design


def pixels(figure):
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)


def test_picks_are_extreme_and_distinct():
    rows = [{"spl": s, "soft_spl": s, "distance_to_goal": d} for s, d in [(0, 3), (1, 0.1), (0, 9), (0.5, 0.2)] * 3]
    picks = pick_episodes(rows, each=3)
    assert {rows[i]["spl"] for i in picks["best"]} == {1}
    assert {rows[i]["distance_to_goal"] for i in picks["worst"]} == {9}
    chosen = [i for group in picks.values() for i in group]
    assert len(chosen) == len(set(chosen)) == 9


@pytest.mark.parametrize("count", [1, 2, 4])
def test_few_episodes_are_picked_once_each(count):
    picks = pick_episodes([{"spl": i / 10} for i in range(count)])
    chosen = [i for group in picks.values() for i in group]
    assert len(chosen) == len(set(chosen)) >= 1


def test_collisions_are_red_and_pictures_repeat(run, tmp_path):
    evaluation = load_evaluation(run / "eval" / "test-greedy")
    trajectories, maps = load_trajectories(evaluation), load_maps(evaluation.directory)
    first = save_png(draw_episodes(evaluation, trajectories, maps), tmp_path / "a.png")
    again = save_png(draw_episodes(evaluation, trajectories, maps), tmp_path / "b.png")
    assert first.read_bytes() == again.read_bytes()
    image = pixels(draw_house(evaluation, trajectories, maps))
    red = (image[..., 0] > 180) & (image[..., 1] < 90) & (image[..., 2] < 90)
    assert red.sum() > 20
    for trajectory in trajectories:
        trajectory.collisions[:] = False
    image = pixels(draw_house(evaluation, trajectories, maps))
    assert not ((image[..., 0] > 180) & (image[..., 1] < 90) & (image[..., 2] < 90)).any()


def test_trajectories_are_drawn_without_a_map(run):
    evaluation = load_evaluation(run / "eval" / "test-greedy")
    image = pixels(draw_episodes(evaluation, load_trajectories(evaluation), []))
    assert (image.sum(axis=-1) < 3 * 128).sum() > 100


def test_series_follow_paths_and_skip_what_is_missing():
    rows = [{"step": 1, "measures": {"spl": 0.5}}, {"step": 2, "measures": {}}, {"step": 3, "measures": {"spl": 1.0}}]
    steps, values = series(rows, "measures.spl")
    assert steps.tolist() == [1, 3]
    assert values.tolist() == [0.5, 1.0]
    assert draw_curves({"run": rows}, {"measures.reward": "Reward"}) is None


def test_smoothing_keeps_constants_and_ignores_holes():
    values = np.full(9, 2.0)
    values[4] = np.nan
    np.testing.assert_allclose(smooth(values, 3), 2.0)


def test_frusta_point_where_sensors_look():
    design = load_design("forward")
    for (apex, corners, axis), pose in zip(frusta(design), design.sensors, strict=True):
        np.testing.assert_allclose(apex, [pose[0], -pose[2], pose[1]])
        rays = corners - apex
        np.testing.assert_allclose(np.linalg.norm(rays, axis=1), REACH)
        assert axis[1] > 0.5  # ahead
        across = np.degrees(
            np.arccos((rays[0] + rays[1]) @ (rays[2] + rays[3]) / np.linalg.norm(rays[0] + rays[1]) ** 2)
        )
        assert across == pytest.approx(70.0, abs=1e-6)


def test_designs_are_drawn_with_and_without_what_they_see():
    design = load_design("fan")
    assert pixels(draw_design(design)).std() > 5
    generator = np.random.default_rng(0)
    sight = Sight(generator.random((4, 8, 8, 3)).astype(np.float32), np.tile(np.float32([0, 1, 0]), (4, 4, 4, 1)))
    image = pixels(draw_design(design, sight, "nowhere"))
    green = (image[..., 1] > 240) & (image[..., 0] < 10) & (image[..., 2] < 10)
    assert green.sum() > 4 * 100 * 100
