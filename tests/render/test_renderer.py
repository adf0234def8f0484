import subprocess
import sys

import numpy as np
import pytest

from prnav.errors import RenderError
from prnav.render import Renderer


def test_background_is_what_a_miss_reads(caster, room):
    up = np.array([[[0, 1.2, -0.1, 0, np.pi / 2, 0, 0.3]]])
    pose = (np.array([0]), np.array([[0.0, 5.0, 0.0]]), np.zeros(1), up)
    renderer = caster([room], background=(0.25, 0.5, 1.0))
    np.testing.assert_allclose(renderer.read(*pose), np.broadcast_to([0.25, 0.5, 1.0], (1, 1, 4, 4, 3)), atol=1e-6)
    assert np.isinf(renderer.depth(*pose, size=4)).all()


def test_no_agents_give_empty_readings(caster, room):
    empty = (np.zeros(0, int), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2, 7)))
    assert caster([room]).read(*empty, grid=8).shape == (0, 2, 8, 8, 3)
    assert caster([room]).image(*empty, size=16).shape == (0, 2, 16, 16, 3)
    assert caster([room]).depth(*empty, size=16).shape == (0, 2, 16, 16)


def test_scenes_are_prepared_when_first_seen(caster, room):
    class Counting(list):
        used = 0

        def __getitem__(self, index):
            self.used += 1
            return super().__getitem__(index)

    scenes = Counting([room, room, room])
    renderer = caster(scenes)
    assert scenes.used == 0
    design = np.array([[[0, 1.2, -0.1, 0, 0, 0, 1.0]]])
    for _ in range(2):
        renderer.read(np.array([1]), np.zeros((1, 3)), np.zeros(1), design)
    assert scenes.used == 1


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"device": "tpu"}, 'device \'tpu\' is not known; valid: "cpu", "cuda", "cuda:N"'),
        ({"device": "cuda:x"}, "device 'cuda:x' is not known"),
        ({"device": "cuda", "engine": "embree"}, "'embree' does not run on device 'cuda'; use engine \"warp\""),
        ({"engine": "optix"}, "engine 'optix' is not known; valid: auto, embree, warp, reference, egl, osmesa"),
        ({"memory_gb": 0.0}, "memory_gb is 0.0; it must be a positive number of gigabytes"),
        ({"rays_per_receptor": 5}, "rays_per_receptor is 5; it must be a square"),
        ({"background": (0, 0, 255)}, "it must be red, green, blue from 0 to 1"),
        ({"pattern": "poisson"}, "pattern 'poisson' is not known; valid: grid, lattice"),
    ],
)
def test_options_are_checked(room, options, text):
    with pytest.raises(RenderError, match=text):
        Renderer([room], **options)


def test_requests_are_checked(room):
    renderer = Renderer([room])
    poses = (np.zeros((1, 3)), np.zeros(1), np.array([[[0, 1.2, -0.1, 0, 0, 0, 1.0]]]))
    with pytest.raises(RenderError, match="there are no scenes"):
        Renderer([])
    with pytest.raises(RenderError, match="scene id 1 does not exist; valid: 0 to 0"):
        renderer.read(np.array([1]), *poses)
    with pytest.raises(RenderError, match="they must be 1 whole numbers"):
        renderer.read(np.array([0.0]), *poses)
    with pytest.raises(RenderError, match="grid is 0; it must be a whole number of at least 1"):
        renderer.read(np.array([0]), *poses, grid=0)
    with pytest.raises(RenderError, match="size is 2.5; it must be a whole number"):
        renderer.image(np.array([0]), *poses, size=2.5)


def test_importing_the_room_compiles_and_loads_nothing():
    heavy = ("numba", "embreex", "torch", "OpenGL", "warp")
    code = f"import sys, prnav.render, prnav.sensors; print([m for m in {heavy} if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
