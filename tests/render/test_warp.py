"""What the GPU engine adds: readings that stay on the device, and the same light as the CPU engine's."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest

from prnav.errors import RenderError
from prnav.render import Renderer, gpu
from prnav.scene import load_scene

if importlib.util.find_spec("warp") is None:
    pytest.skip('the package warp-lang is missing; pip install "prnav[gpu]" to run these', allow_module_level=True)


@pytest.mark.parametrize("pattern", ["grid", "lattice"])
def test_same_rays_same_light_in_a_house(pattern):
    home = load_scene("prhouses/test/00")
    rng = np.random.default_rng(3)
    low, high = home.bounds
    feet = rng.uniform(low, high, (40, 3)) * [1, 0, 1]
    designs = np.zeros((40, 2, 7))
    designs[..., 1] = 1.25
    designs[..., 3:6] = rng.uniform(-0.5, 0.5, (40, 2, 3))
    designs[..., 6] = np.radians(rng.uniform(30, 120, (40, 2)))
    request = np.zeros(40, int), feet, rng.uniform(-3, 3, 40), designs
    ours, theirs = (Renderer([home], engine=engine, pattern=pattern).read(*request) for engine in ("warp", "embree"))
    assert ours.std() > 0.1
    assert np.abs(ours - theirs).mean() * 255 <= 0.2


def test_readings_are_shared_with_torch_and_not_copied(caster, rooms, batch):
    torch = pytest.importorskip("torch")
    renderer = caster(rooms)
    there = renderer.read_on_device(*batch)
    tensor = torch.from_dlpack(there)
    assert tensor.shape == (12, 3, 16, 3)
    assert tensor.device.type == ("cuda" if "cuda" in str(getattr(there, "device", "cpu")) else "cpu")
    address = there.ptr if hasattr(there, "ptr") else there.ctypes.data
    assert tensor.data_ptr() == address
    readings = renderer.read(*batch)
    np.testing.assert_array_equal(tensor.cpu().numpy().reshape(readings.shape), readings)
    picture = torch.from_dlpack(renderer.image_on_device(*batch, size=8)).cpu().numpy()
    np.testing.assert_array_equal(picture.reshape(12, 3, 8, 8, 3), renderer.image(*batch, size=8))


def test_an_earlier_reading_is_not_written_again(caster, rooms, batch):
    torch = pytest.importorskip("torch")
    renderer = caster(rooms)
    first = torch.from_dlpack(renderer.read_on_device(*batch))
    kept = first.clone()
    turned = (batch[0], batch[1], batch[2] + 1.0, batch[3])
    later = [torch.from_dlpack(renderer.read_on_device(*turned)) for _ in range(6)]
    assert torch.equal(first, kept)
    assert all(torch.equal(reading, later[0]) for reading in later) and not torch.equal(later[0], first)


def test_what_is_missing_is_named(room, monkeypatch):
    if not gpu.load_warp("cpu")[0].is_cuda_available():
        with pytest.raises(RenderError, match="device 'cuda' is not on this machine; Warp found: cpu"):
            Renderer([room], device="cuda")
    with pytest.raises(RenderError, match="device 'cuda:99' is not on this machine"):
        Renderer([room], device="cuda:99")
    monkeypatch.setattr(gpu.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RenderError, match=r'needs the package warp-lang; pip install "prnav\[gpu\]"'):
        Renderer([room], engine="warp")


def test_nothing_is_printed(tmp_path):
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from conftest import make_scene; import numpy as np; from prnav.render import Renderer\n"
        "r = Renderer([make_scene(0)], engine='warp')\n"
        "r.read(np.zeros(1, int), np.zeros((1, 3)), np.zeros(1), np.array([[[0, 1.2, 0, 0, 0, 0, 1.0]]]))"
    )
    folder = str(__file__).rsplit("/", 1)[0]
    done = subprocess.run([sys.executable, "-c", code, folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""


@pytest.mark.slow
def test_kernels_compile_for_cuda_without_a_device(tmp_path):
    warp, _ = gpu.load_warp("cpu")
    from prnav.render import warp_kernels

    warp.compile_aot_module(warp_kernels, arch=90, module_dir=tmp_path, use_ptx=True)
    code = next(tmp_path.glob("*.ptx")).read_text()
    assert "read_patches" in code and "trace_pixels" in code
