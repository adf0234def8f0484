"""Every kind of file that the program writes, mutated: our errors alone come out, in bounded memory."""

import contextlib
import resource
import sys

import mutations
import numpy as np
import pytest

from prnav.errors import PrnavError

RUN = {
    "checkpoint": "checkpoints/step-000000000256.safetensors",
    "metrics": "metrics.jsonl",
    "facts": "run.json",
    "config": "config.toml",
}
EVALUATION = {
    "header": "evaluation.json",
    "records": "records.jsonl",
    "traces": "trajectories.npz",
    "maps": "maps.npz",
    "sights": "sights.npz",
    "submission": "submission.json",
}
CHANGES = {
    "checkpoint": [mutations.mutate_checkpoint, mutations.mutate_text],
    "metrics": [mutations.mutate_json_lines, mutations.mutate_text],
    "facts": [mutations.mutate_json, mutations.mutate_text],
    "config": [mutations.mutate_text],
    "header": [mutations.mutate_json, mutations.mutate_text],
    "records": [mutations.mutate_json_lines, mutations.mutate_text],
    "traces": [mutations.mutate_npz, mutations.mutate_text],
    "maps": [mutations.mutate_npz, mutations.mutate_text],
    "sights": [mutations.mutate_npz, mutations.mutate_text],
    "submission": [mutations.mutate_json, mutations.mutate_text],
    "design": [mutations.mutate_text],
    "episodes": [mutations.mutate_text],
    "navmesh": [mutations.mutate_text],
    "cache": [mutations.mutate_npz, mutations.mutate_text],
}


@pytest.fixture
def readers(copied, place, tmp_path, monkeypatch):
    """Per kind of file: the file, and all that reads it."""
    from prnav.cache import cached_arrays
    from prnav.domains.navigation.maps import load_maps
    from prnav.domains.navigation.sights import load_sights
    from prnav.episodes import load_episodes
    from prnav.evaluate.learned import load_run
    from prnav.evaluate.records import load_evaluation, load_traces
    from prnav.evaluate.submission import verify_submission
    from prnav.navmesh import NavMesh
    from prnav.report.page import make_page, read_run
    from prnav.sensors import load_design, save_design
    from prnav.train import RunFolder
    from prnav.train.checkpoint import load_checkpoint

    (evaluation,) = (copied / "eval").iterdir()
    trainer = small_trainer(place, tmp_path)
    folder = RunFolder(copied)
    save_design(load_design("ring"), tmp_path / "ring.toml")
    NavMesh.build(room()).save(tmp_path / "room.navmesh")
    (tmp_path / "s.json.gz").write_bytes(place.episodes.read_bytes())
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path / "cache"))
    made = {"a": np.arange(12.0).reshape(3, 4), "b": np.zeros(5, np.int32)}
    cached_arrays("kind", "key", lambda: made)
    (entry,) = (tmp_path / "cache").rglob("*.npz")

    def resume(path):
        trainer.load_state_dict(load_checkpoint(path), str(path))
        load_run(copied, lambda text: None)

    def page():
        make_page([read_run(copied)])

    def traces():
        found = load_evaluation(evaluation)
        load_traces(found)
        load_maps(evaluation)
        load_sights(evaluation)

    files = {name: copied / relative for name, relative in RUN.items()}
    files |= {name: evaluation / relative for name, relative in EVALUATION.items()}
    files |= {
        "design": tmp_path / "ring.toml",
        "episodes": tmp_path / "s.json.gz",
        "navmesh": tmp_path / "room.navmesh",
    }
    files |= {"cache": entry}
    uses = {
        "checkpoint": [lambda: resume(files["checkpoint"])],
        "metrics": [lambda: folder.cut_metrics(128), lambda: read_run(copied)],
        "facts": [lambda: load_run(copied, lambda text: None), lambda: read_run(copied)],
        "config": [folder.load_config, lambda: load_run(copied, lambda text: None)],
        "header": [traces],
        "records": [traces],
        "traces": [traces],
        "maps": [traces],
        "sights": [traces],
        "submission": [lambda: verify_submission(files["submission"])],
        "design": [lambda: load_design(files["design"])],
        "episodes": [lambda: load_episodes(files["episodes"])],
        "navmesh": [lambda: NavMesh.load(files["navmesh"]).distance([1, 0, 1], [2, 0, 2])],
        "cache": [lambda: cached_arrays("kind", "key", lambda: made)],
    }
    return files, uses, page


def room():
    from data_trees import room as small

    return small()


def small_trainer(place, tmp_path):
    """A trainer of the small config, to load checkpoints into."""
    from prnav.cli._common import Screen
    from prnav.cli.train import load_environments
    from prnav.train import RunFolder, Trainer
    from prnav.train.config import load_train_config

    config = load_train_config(str(place.config))
    groups, _ = load_environments(config, Screen(stderr=True, quiet=True))
    return Trainer(config, groups, RunFolder(tmp_path / "other"))


def attack(files, uses, page, kind, count, draw_every, seed=0):
    """How many of so many mutations were refused."""
    path, rng = files[kind], np.random.default_rng(seed)
    original, refused = path.read_bytes(), 0
    for number in range(count):
        changes = CHANGES[kind]
        with contextlib.suppress(ValueError, OverflowError):  # the mutation itself is none
            changes[number % len(changes)](path, rng)
        for use in [*uses[kind], *([page] if draw_every and number % draw_every == 0 else [])]:
            try:
                use()
            except PrnavError as error:
                assert "\n" not in str(error) and len(str(error)) < 2000
                refused += 1
            except BaseException:
                path.with_name(f"culprit-{path.name}").write_bytes(path.read_bytes())
                raise
        path.write_bytes(original)
    return refused


@pytest.mark.parametrize("kind", CHANGES)
def test_mutated_files_are_refused_or_read(readers, kind):
    files, uses, page = readers
    if not files[kind].exists():
        pytest.skip(f"this run has no {files[kind].name}")
    if kind == "cache":
        attack(files, uses, page, kind, 40, 0)
    else:
        assert attack(files, uses, page, kind, 40, 0) > 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", CHANGES)
def test_a_thousand_mutations(readers, kind):
    files, uses, page = readers
    if not files[kind].exists():
        pytest.skip(f"this run has no {files[kind].name}")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    drawn = 250 if kind in ("header", "records", "traces", "maps", "sights", "metrics", "facts") else 0
    refused = attack(files, uses, page, kind, 1000, drawn, seed=1)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    sys.stdout.write(f"{kind}: 1000 mutations, {refused} refusals, {grown:.0f} MB more\n")
    assert grown < 500


def test_an_archive_of_zeros_is_refused_before_it_is_unpacked(copied):
    from prnav.evaluate.records import load_evaluation, load_traces

    (evaluation,) = (copied / "eval").iterdir()
    with np.load(evaluation / "trajectories.npz") as stored:
        arrays = {name: stored[name] for name in stored.files}
    arrays["positions"] = np.zeros((20_000_000, 3), np.float32)
    np.savez_compressed(evaluation / "trajectories.npz", **arrays)
    del arrays
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(PrnavError, match="it unpacks to .* bytes, which its .* bytes cannot mean"):
        load_traces(load_evaluation(evaluation))
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024 < 50


def test_weights_of_another_type_are_refused(copied):
    from safetensors import safe_open
    from safetensors.numpy import save_file

    from prnav.evaluate.learned import load_run

    path = copied / RUN["checkpoint"]
    with safe_open(path, framework="numpy") as file:
        metadata, arrays = dict(file.metadata()), {name: file.get_tensor(name) for name in file.keys()}
    name = next(name for name in arrays if name.startswith("/policy/"))
    save_file({**arrays, name: arrays[name].astype(np.float64)}, path, metadata=metadata)
    with pytest.raises(PrnavError, match="are of type torch.float64, not"):
        load_run(copied, lambda text: None)
