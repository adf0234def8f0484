import numpy as np
import pytest

from prnav import cache, files
from prnav.errors import EpisodeError


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.txt"
    files.write_text(path, "old")
    with pytest.raises(RuntimeError), files.atomic_path(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("relative", ["../x", "/etc/passwd", "a/../../x", "a\0b"])
def test_a_path_in_a_data_file_cannot_leave_its_root(tmp_path, relative):
    with pytest.raises(EpisodeError, match="data root|zero byte"):
        files.resolve_inside(tmp_path, relative, EpisodeError)


def test_a_link_cannot_leave_the_root_either(tmp_path):
    (tmp_path / "root").mkdir()
    (tmp_path / "root" / "link").symlink_to(tmp_path)
    with pytest.raises(EpisodeError, match="leaves its data root"):
        files.resolve_inside(tmp_path / "root", "link/secret", EpisodeError)


def test_cache_computes_once_and_mends_a_broken_entry(tmp_path, monkeypatch):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path))
    calls = []

    def compute():
        calls.append(1)
        return {"a": np.arange(3)}

    for _ in range(2):
        np.testing.assert_array_equal(cache.cached_arrays("kind", "key", compute)["a"], [0, 1, 2])
    assert len(calls) == 1
    (tmp_path / "kind" / "key.npz").write_bytes(b"PK\x03\x04 broken")
    np.testing.assert_array_equal(cache.cached_arrays("kind", "key", compute)["a"], [0, 1, 2])
    assert len(calls) == 2


def test_cache_never_loads_a_pickle(tmp_path, monkeypatch):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path))
    (tmp_path / "kind").mkdir()
    np.savez(tmp_path / "kind" / "key.npz", a=np.array([{"x": 1}], dtype=object))
    assert cache.cached_arrays("kind", "key", lambda: {"a": np.ones(1)})["a"].dtype == float


def test_an_unwritable_cache_costs_nothing_but_time(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path / "file"))
    assert cache.cached_arrays("kind", "key", lambda: {"a": np.ones(2)})["a"].sum() == 2


def test_hash_depends_on_names_types_shapes_and_values():
    base = {"a": np.zeros((2, 3), np.float32)}
    hashes = {
        cache.hash_arrays(base),
        cache.hash_arrays({"b": base["a"]}),
        cache.hash_arrays({"a": base["a"].astype(np.int32)}),
        cache.hash_arrays({"a": base["a"].reshape(3, 2)}),
        cache.hash_arrays({"a": base["a"] + 1}),
    }
    assert len(hashes) == 5
    assert cache.hash_arrays({"a": base["a"].astype(">f4")}) == cache.hash_arrays(base)
