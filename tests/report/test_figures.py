import numpy as np
import pytest

from prnav.contracts.records import pick_episodes, pick_pairs
from prnav.domains.navigation.maps import load_maps
from prnav.domains.navigation.pictures.breakdown import bin_edges, draw_breakdown, means_by_bin
from prnav.domains.navigation.pictures.frame import sensors_side_by_side
from prnav.domains.navigation.pictures.sights import draw_sight
from prnav.domains.navigation.pictures.topdown import draw_episodes, draw_house, draw_pairs
from prnav.evaluate.records import load_evaluation, load_traces
from prnav.report.curves import draw_curves, series, smooth
from prnav.report.designs import REACH, Sight, draw_design, frusta
from prnav.sensors import load_design
from prnav.style import save_png


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
    trajectories, maps = load_traces(evaluation), load_maps(evaluation.directory)
    first = save_png(draw_episodes(evaluation, trajectories, maps), tmp_path / "a.png")
    again = save_png(draw_episodes(evaluation, trajectories, maps), tmp_path / "b.png")
    assert first.read_bytes() == again.read_bytes()
    image = pixels(draw_house(evaluation, trajectories, maps))
    red = (image[..., 0] > 180) & (image[..., 1] < 90) & (image[..., 2] < 90)
    assert red.sum() > 20
    for trajectory in trajectories:
        trajectory["collisions"][:] = False
    image = pixels(draw_house(evaluation, trajectories, maps))
    assert not ((image[..., 0] > 180) & (image[..., 1] < 90) & (image[..., 2] < 90)).any()


def test_trajectories_are_drawn_without_a_map(run):
    evaluation = load_evaluation(run / "eval" / "test-greedy")
    image = pixels(draw_episodes(evaluation, load_traces(evaluation), []))
    assert (image.sum(axis=-1) < 3 * 128).sum() > 100


def test_series_follow_paths_and_skip_what_is_missing():
    rows = [{"step": 1, "measures": {"spl": 0.5}}, {"step": 2, "measures": {}}, {"step": 3, "measures": {"spl": 1.0}}]
    steps, values = series(rows, "measures.spl")
    assert steps.tolist() == [1, 3]
    assert values.tolist() == [0.5, 1.0]
    assert draw_curves({"run": [rows]}, {"measures.reward": "Reward"}) is None


def test_curves_of_several_seeds_are_one_line_in_a_band():
    seeds = [[{"step": t, "spl": level} for t in range(30)] for level in (0.2, 0.4)]
    figure = draw_curves({"eye": seeds, "blind": [seeds[0]]}, {"spl": "SPL"})
    axes = figure.axes[0]
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(lines["eye (2 seeds)"], 0.3)
    np.testing.assert_allclose(lines["blind"], 0.2)
    (band,) = axes.collections
    assert band.get_paths()[0].vertices[:, 1].min() == 0.2 and band.get_paths()[0].vertices[:, 1].max() == 0.4


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


def test_pairs_are_where_two_differ_most():
    one = [{"spl": value} for value in (0.1, 0.9, 0.5, 0.4)]
    two = [{"spl": value} for value in (0.8, 0.2, 0.5, 0.4)]
    picks = pick_pairs(one, two)
    assert (picks["first"], picks["second"]) == (1, 0)
    assert picks["random"] in (2, 3)
    assert pick_pairs(one[:1], two[:1]) == {"random": 0}


def test_an_episode_is_drawn_on_every_floor_it_touches(run, make_evaluation, tmp_path):
    evaluation = make_evaluation(tmp_path / "two", "climber", floors=(0.0, 3.0))
    trajectories, maps = load_traces(evaluation), load_maps(evaluation.directory)
    flat = draw_episodes(evaluation, trajectories, maps)
    count = sum(bool(axes.get_title(loc="left")) for axes in flat.axes)
    trajectories[0]["positions"][5:, 1] = 3.0
    for row in evaluation.rows:
        row["spl"] = 1.0
    evaluation.rows[0]["spl"] = 0.0  # the worst is always shown
    figure = draw_episodes(evaluation, trajectories, maps)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert sum(bool(title) for title in titles) == count + 1
    assert any("floor at 3.0 m" in title for title in titles)


def test_two_evaluations_stand_side_by_side(run, make_evaluation, tmp_path):
    other = make_evaluation(tmp_path / "other", "random", "sampled")
    one = load_evaluation(run / "eval" / "test-greedy")
    tracks = load_traces(one), load_traces(other)
    figure = draw_pairs((one, other), tracks, load_maps(one.directory), ("left", "right"))
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title.split("\n")[0] for title in titles] == ["left", "right"] * (len(titles) // 2)


def test_groups_of_episodes_have_the_means_of_their_members():
    generator = np.random.default_rng(0)
    values, results = generator.uniform(0, 10, 50), generator.integers(0, 2, 50).astype(float)
    edges = bin_edges(values)
    groups = means_by_bin(values, results, edges)
    assert len(groups) == 5
    order = np.argsort(values)
    for k, (middle, interval) in enumerate(groups):
        members = order[10 * k : 10 * k + 10]
        assert middle == pytest.approx(np.median(values[members]))
        assert interval.mean == pytest.approx(results[members].mean())
        assert interval.low <= interval.mean <= interval.high
    assert len(means_by_bin(np.ones(4), np.ones(4), bin_edges(np.ones(4)))) == 1


def test_success_is_broken_down_where_rows_tell(run, make_evaluation, tmp_path):
    told = make_evaluation(tmp_path / "told", "random", starts=True)
    figure = draw_breakdown([told], ["random"])
    assert [axes.get_xlabel() for axes in figure.axes] == [
        "shortest path to the goal [m]",
        "shortest path over straight line",
    ]
    assert draw_breakdown([load_evaluation(run / "eval" / "test-greedy")], ["run"]) is None


def test_what_receptors_saw_is_shown_as_it_was(run):
    evaluation = load_evaluation(run / "eval" / "test-greedy")
    track = load_traces(evaluation)[0]
    readings = np.zeros((len(track["positions"]), 2, 2, 2, 3), np.uint8)
    readings[..., 1] = 255
    picture = sensors_side_by_side(readings[0])
    assert picture.shape == (2, 5, 3)
    assert (picture[:, 2] == 255).all() and (np.delete(picture, 2, axis=1) == [0, 255, 0]).all()
    image = pixels(draw_sight(evaluation.rows[0], track, readings, load_maps(evaluation.directory), "seen"))
    green = (image[..., 1] > 240) & (image[..., 0] < 10) & (image[..., 2] < 10)
    assert green.sum() > 50_000
