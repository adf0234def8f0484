import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from prnav.errors import DesignError
from prnav.sensors import Body

coordinate = st.floats(-3, 3, allow_subnormal=False)
points = st.tuples(coordinate, coordinate, coordinate)


def surface_samples(body, count=4000):
    """Points spread over the side and the top."""
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 2 * np.pi, count)
    side = np.stack([body.radius * np.cos(turn), rng.uniform(0, body.height, count), body.radius * np.sin(turn)], -1)
    reach = body.radius * np.sqrt(rng.random(count))
    top = np.stack([reach * np.cos(turn), np.full(count, body.height), reach * np.sin(turn)], -1)
    return np.concatenate([side, top])


@given(points)
def test_projection_lands_on_the_surface_and_stays(point):
    body = Body()
    on = body.project(np.array(point))
    reach = np.hypot(on[0], on[2])
    side = abs(reach - body.radius) < 1e-9 and -1e-12 <= on[1] <= body.height
    top = on[1] == body.height and reach <= body.radius + 1e-9
    assert side or top
    np.testing.assert_array_equal(body.project(on), on)


@given(points)
def test_projection_is_the_closest_point(point):
    body = Body(radius=0.4, height=1.0)
    samples = surface_samples(body)
    best = np.linalg.norm(samples - np.array(point), axis=1).min()
    assert body.distance(np.array(point)) <= best + 1e-9


@given(points, points)
def test_projection_from_outside_never_spreads_points(a, b):
    body = Body()
    a, b = np.array(a) + [4, 0, 0], np.array(b) + [4, 0, 0]  # beside the body: onto a convex solid from one side
    assert np.linalg.norm(body.project(a) - body.project(b)) <= np.linalg.norm(a - b) + 1e-9


def test_named_places():
    body = Body(0.1, 1.5)
    for point, expected in [
        ((0, 1.0, 0), (0, 1.0, -0.1)),  # from the axis: ahead
        ((0.05, 1.0, 0), (0.1, 1.0, 0)),
        ((0.01, 1.48, 0), (0.01, 1.5, 0)),  # the top is nearer
        ((0, 3, 0), (0, 1.5, 0)),
        ((1, 3, 0), (0.1, 1.5, 0)),  # the rim
        ((0, -1, 0.5), (0, 0, 0.1)),
        ((0, -1, 0), (0, 0, -0.1)),
    ]:
        np.testing.assert_allclose(body.project(point), expected, atol=1e-12)


def test_contains_is_strict():
    assert Body().contains([[0, 1, 0], [0.1, 1, 0], [0, 1.5, 0], [0, 0, 0], [1, 1, 1]]).tolist() == [
        True,
        False,
        False,
        False,
        False,
    ]


@pytest.mark.parametrize(("radius", "height", "text"), [(0, 1, "radius is 0"), (0.1, float("nan"), "height is nan")])
def test_a_body_has_a_size(radius, height, text):
    with pytest.raises(DesignError, match=f"body: {text}; it must be a positive number of metres"):
        Body(radius, height)
