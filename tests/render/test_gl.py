"""The rasteriser engines; what needs GL runs in processes of its own, one platform each."""

import json
import subprocess
import sys

import numpy as np
import pytest

from prnav.errors import RenderError
from prnav.render import Renderer, gl

COMPARE = """
import json, sys
sys.path.insert(0, sys.argv[2])
import numpy as np
from conftest import make_scene
from prnav.render import Renderer
rooms = [make_scene(0, 0), make_scene(1, 30, ceiling=True)]
rng = np.random.default_rng(0)
n, k = 6, 2
designs = np.zeros((n, k, 7))
designs[..., 1] = 1.2
designs[..., 3:6] = rng.uniform(-0.6, 0.6, (n, k, 3))
designs[..., 6] = np.radians(rng.uniform(40, 110, (n, k)))
poses = rng.integers(0, 2, n), rng.uniform(-0.5, 0.5, (n, 3)) * [1, 0, 1], rng.uniform(-3, 3, n), designs
balls = np.concatenate([poses[1] + rng.uniform(-1, 1, (n, 3)) + [0, 1.2, 0], np.full((n, 1), 0.3)], axis=1)
balls[0, 3] = 0.0
drawn = Renderer(rooms, engine=sys.argv[1], background=(0.2, 0.4, 0.6))
cast = Renderer(rooms, rays_per_receptor=1024, background=(0.2, 0.4, 0.6))
depth = [r.depth(*poses, size=64) for r in (drawn, cast)]
same = np.isfinite(depth[0]) & np.isfinite(depth[1])
print(json.dumps({
    "engine": drawn.engine,
    "mean": float(np.abs(drawn.read(*poses) - cast.read(*poses)).mean() * 255),
    "sphere": float(np.abs(drawn.read(*poses, spheres=balls) - cast.read(*poses, spheres=balls)).mean() * 255),
    "misses": float((np.isinf(depth[0]) == np.isinf(depth[1])).mean()),
    "depth": float(np.median(np.abs(depth[0] - depth[1])[same])),
}))
"""


@pytest.mark.gl
@pytest.mark.parametrize("platform", ["egl", "osmesa"])
def test_rasteriser_draws_what_rays_see(platform, request):
    here = str(request.path.parent)
    done = subprocess.run([sys.executable, "-c", COMPARE, platform, here], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    result = json.loads(done.stdout.splitlines()[-1])
    assert result["engine"] == platform
    assert result["mean"] <= 2.0
    assert result["sphere"] <= 2.0
    assert result["misses"] > 0.99
    assert result["depth"] < 0.03  # [m]; a driver takes any of a pixel's samples, 4 m away half a pixel is 3 cm


@pytest.mark.gl
def test_one_platform_per_process():
    code = "from prnav.render import gl; gl.load_pyrender('egl'); gl.load_pyrender('osmesa')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "OpenGL runs on platform 'egl' in this process already; use one rasteriser per process" in done.stderr


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setitem(gl._LIBRARIES, "osmesa", ("libNoSuchMesa.so.8", "libosmesa6"))
    with pytest.raises(RenderError, match="needs the library libNoSuchMesa.so.8; .* apt-get install libosmesa6"):
        gl.load_pyrender("osmesa")


@pytest.mark.parametrize(
    ("versions", "text"),
    [
        ({}, r"needs the package pyrender; pip install \"prnav\[gl\]\""),
        ({"pyrender": "0.1.45"}, "needs the package PyOpenGL"),
        ({"pyrender": "0.1.45", "PyOpenGL": "3.1.0"}, "needs PyOpenGL 3.1.10 or newer, found 3.1.0"),
    ],
)
def test_missing_packages_are_named(monkeypatch, room, versions, text):
    def version(name):
        if name not in versions:
            raise gl.importlib.metadata.PackageNotFoundError(name)
        return versions[name]

    monkeypatch.setattr(gl.importlib.metadata, "version", version)
    monkeypatch.setattr(gl.ctypes, "CDLL", lambda name: None)
    with pytest.raises(RenderError, match=text):
        Renderer([room], engine="egl")


def test_pose_is_a_rigid_frame():
    from prnav.render.rays import sensor_views

    views = sensor_views([[1, 2, 3]], [0.4], [[[0.1, 1.0, 0.0, 0.3, -0.2, 0.9, 1.9]]])
    pose = gl._pose(views, 0, float(np.linalg.norm(views.right[0])))
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) > 0
    np.testing.assert_allclose(pose[:3, 2], -views.forward[0])
