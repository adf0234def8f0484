"""Embree's functions, called directly: packets, threads, and what is said when it isn't there."""

import importlib.util
import threading

import numpy as np
import pytest

from prnav.errors import RenderError
from prnav.render import Renderer, cpu, embree
from prnav.render.rays import sensor_views


def test_packets_hit_what_single_rays_hit(room, batch, monkeypatch):
    views = sensor_views(*batch[1:])
    engine = Renderer([room])._engine
    found = {}
    for dense in (0, 10**9):  # packets for all, single rays for all
        monkeypatch.setattr(cpu, "DENSE", dense)
        found[dense] = engine.trace(0, views, 19)  # 361 pixels: the last packet is not full
    (triangles, depths), (others, other_depths) = found.values()
    assert (triangles == others).mean() >= 0.9999
    np.testing.assert_array_equal(np.isinf(depths), np.isinf(other_depths))
    hit = np.isfinite(depths) & (triangles == others)
    np.testing.assert_allclose(depths[hit], other_depths[hit], rtol=1e-5)


def test_pictures_are_made_of_the_same_light_as_receptors(room, batch, monkeypatch):
    scenes = np.zeros(12, int)
    renderer = Renderer([room], rays_per_receptor=16)
    monkeypatch.setattr(cpu, "DENSE", 0)
    packets = renderer.read(scenes, *batch[1:])
    monkeypatch.setattr(cpu, "DENSE", 10**9)
    assert np.abs(packets - renderer.read(scenes, *batch[1:])).mean() * 255 < 0.01


def test_threads_read_at_once_what_one_reads(rooms, batch):
    renderer = Renderer(rooms, memory_gb=1e-9)  # each request prepares what the other has just let go of
    expected, results = renderer.read(*batch), {}
    threads = [
        threading.Thread(target=lambda i=i: results.update({i: [renderer.read(*batch) for _ in range(5)]}))
        for i in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for reading in sum(results.values(), []):
        np.testing.assert_array_equal(reading, expected)


def test_a_scene_too_large_for_embree_is_one_error(room, monkeypatch):
    library = embree._library()
    monkeypatch.setattr(library, "rtcGetDeviceError", lambda device: 4)
    with pytest.raises(RenderError, match="scene room-0: Embree could not prepare its 70 triangles"):
        Renderer([room]).read(np.array([0]), np.zeros((1, 3)), np.zeros(1), np.array([[[0, 1.2, -0.1, 0, 0, 0, 1.0]]]))


def test_a_missing_embree_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RenderError, match=r"needs the package embreex; pip install --force-reinstall 'embreex>=4.4'"):
        embree._library.__wrapped__()


def test_a_package_without_embree_4_names_what_was_tried(monkeypatch, tmp_path):
    (tmp_path / "embreex").mkdir()
    (tmp_path / "embreex" / "rtcore_scene.so").write_bytes(b"no library")
    spec = importlib.util.spec_from_file_location("embreex", tmp_path / "embreex" / "__init__.py")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: spec)
    with pytest.raises(RenderError, match=r"found no Embree 4 in the package embreex \(rtcore_scene.so: "):
        embree._library.__wrapped__()
