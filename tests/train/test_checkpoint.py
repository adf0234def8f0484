"""Checkpoints: what goes in comes out, and what is broken is said to be."""

import numpy as np
import pytest
import torch

from prnav.errors import CheckpointError
from prnav.train.checkpoint import (
    checkpoint_path,
    list_checkpoints,
    load_checkpoint,
    load_latest,
    load_policy_weights,
    prune_checkpoints,
    save_checkpoint,
)


def test_a_tree_comes_back_as_it_was(tmp_path):
    generator = np.random.Generator(np.random.PCG64(7))
    tree = {
        "weights": {"a.b": torch.randn(3, 2), "scalar": torch.tensor(2.5)},
        "arrays": [np.arange(4), np.zeros((0, 3), bool), np.array([1.0]), np.uint64(2**63)],
        "plain": {"none": None, "text": "é", "flag": True, "float": 0.1, "list": [1, [2]]},
        "generator": generator.bit_generator.state,
    }
    save_checkpoint(tmp_path / "x.safetensors", tree)
    back = load_checkpoint(tmp_path / "x.safetensors")
    assert (back["weights"]["a.b"] == tree["weights"]["a.b"].numpy()).all()
    assert back["weights"]["scalar"].shape == () and back["weights"]["scalar"] == 2.5
    for before, after in zip(tree["arrays"][:3], back["arrays"], strict=False):
        assert before.dtype == after.dtype and before.shape == after.shape and (before == after).all()
    assert back["arrays"][3] == 2**63 and back["plain"] == tree["plain"]
    assert back["generator"] == generator.bit_generator.state  # 128-bit integers included


def test_what_cannot_be_stored_is_refused(tmp_path):
    with pytest.raises(TypeError, match="cannot hold /a/b, which is a object"):
        save_checkpoint(tmp_path / "x.safetensors", {"a": {"b": object()}})
    assert not list(tmp_path.iterdir())


def test_a_broken_file_is_one_clear_error(tmp_path):
    path = checkpoint_path(tmp_path, 5)
    save_checkpoint(path, {"a": torch.zeros(100)})
    path.write_bytes(path.read_bytes()[:-50])
    with pytest.raises(CheckpointError, match=r"step-000000000005\.safetensors: cannot be read"):
        load_checkpoint(path)
    with pytest.raises(CheckpointError, match="missing.safetensors: cannot be read"):
        load_checkpoint(tmp_path / "missing.safetensors")


def test_another_format_names_both(tmp_path, monkeypatch):
    path = tmp_path / "x.safetensors"
    monkeypatch.setattr("prnav.train.checkpoint.FORMAT", 99)
    save_checkpoint(path, {})
    monkeypatch.undo()
    with pytest.raises(CheckpointError, match="format '99', this version reads 1; use the version of prnav"):
        load_checkpoint(path)


def test_the_newest_readable_one_is_used(tmp_path):
    for step in (9, 10, 200):
        save_checkpoint(checkpoint_path(tmp_path, step), {"step": step})
    (tmp_path / ".step-000000000300.safetensors.tmp").write_text("half written")
    assert [path.name for path in list_checkpoints(tmp_path)][-1] == "step-000000000200.safetensors"
    warnings: list[str] = []
    assert load_latest(tmp_path, lambda tree: tree["step"], warnings.append) == 200 and not warnings
    checkpoint_path(tmp_path, 200).write_bytes(b"rubbish")
    assert load_latest(tmp_path, lambda tree: tree["step"], warnings.append) == 10
    assert "step-000000000200.safetensors: cannot be read" in warnings[0] and "falling back" in warnings[0]
    prune_checkpoints(tmp_path, 1)
    with pytest.raises(CheckpointError, match="step-000000000200"):
        load_latest(tmp_path, lambda tree: tree["step"], warnings.append)


def test_no_checkpoint_names_the_run(tmp_path):
    with pytest.raises(CheckpointError, match="no checkpoint in checkpoints/; start it anew with another --run"):
        load_latest(tmp_path / "checkpoints", lambda tree: tree, print)


def test_weights_of_another_policy_are_refused():
    layer = torch.nn.Linear(3, 2)
    weights = {name: value.numpy() for name, value in torch.nn.Linear(4, 2).state_dict().items()}
    with pytest.raises(CheckpointError, match="do not fit the configured policy.*size mismatch for weight"):
        load_policy_weights(layer, weights, "x")
