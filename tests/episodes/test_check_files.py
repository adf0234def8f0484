"""``prnav-scenes check`` on good and broken files: each broken one is named with a reason, and nothing else."""

import gzip
import io
import json
import os
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
from PIL import Image

from prnav.cli.scenes import main
from prnav.episodes.check_files import CheckLimits, check_tasks, find_tasks, kind_of
from prnav.errors import SceneError
from prnav.navmesh import NavMesh
from prnav.scene.export import save_glb


def glb(document, binary=b""):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def triangle(points=((0, 0, 0), (0, 0, 1), (1, 0, 0)), count=3, **more):
    """A GLB of one triangle, whose accessor promises ``count`` vertices."""
    binary = np.array(points, np.float32).tobytes()
    return glb(
        {
            "asset": {"version": "2.0"},
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, **more.pop("primitive", {})}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
            "buffers": [{"byteLength": len(binary)}],
            **more,
        },
        binary,
    )


def textured(image_uri):
    """A GLB whose texture is in another file."""
    return triangle(
        primitive={"material": 0},
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        textures=[{"source": 0}],
        images=[{"uri": image_uri}],
    )


def png_header(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(b"\0" * 100_000))
        + chunk(b"IEND", b"")
    )


def episodes(scene_id="a.glb", position=(0, 0, 0)):
    episode = {
        "episode_id": "0",
        "scene_id": scene_id,
        "start_position": list(position),
        "start_rotation": [0, 0, 0, 1],
        "info": {"geodesic_distance": 1.0},
        "goals": [{"position": [1, 0, 0], "radius": None}],
    }
    return gzip.compress(json.dumps({"episodes": [episode]}).encode())


@pytest.fixture(scope="module")
def zoo(tmp_path_factory, slabs):
    """A folder of good files, and of every kind of broken ones: (folder, name to a part of the reason)."""
    tmp_path = tmp_path_factory.mktemp("check")
    folder = tmp_path / "zoo"
    (folder / "deep").mkdir(parents=True)
    (tmp_path / "secret.png").write_bytes(b"secret")
    floor = slabs((0, 5, 0, 4, 0))
    save_glb(floor, folder / "a.glb")
    navmesh = NavMesh.build(floor)
    navmesh.save(folder / "a.navmesh")
    (folder / "good.json.gz").write_bytes(episodes())
    (folder / "plain.json").write_text('{"episodes": []}')
    (folder / "unrelated.json").write_text("{broken")
    (folder / "notes.txt").write_text("no file of ours")
    picture = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)).save(picture, "PNG")
    huge_ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
    huge_ply += b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" + bytes(
        10_000
    )
    whole = (folder / "a.glb").read_bytes()
    bad = {
        "claims.glb": (triangle(count=4_000_000_000), "promises 4000000000 elements, 48000000000 bytes"),
        "claims.ply": (huge_ply, "promises at least 48000000001 bytes"),
        "bomb.json.gz": (gzip.compress(bytes(200 << 20), 9), "unpack to more than"),
        "passwd.json.gz": (episodes("../../etc/passwd"), "leaves its data root"),
        "zero.glb": (b"", r"empty (0 bytes)"),
        "zero.navmesh": (b"", "too few for a header"),
        "zero.json.gz": (b"", "not valid JSON"),
        "nan.glb": (triangle([(0, 0, 0), (np.nan, 0, 1), (1, 0, 0)]), "1 of 3 vertices"),
        "inf.obj": (b"v 0 0 0\nv inf 0 0\nv 0 0 1\nf 1 2 3\n", "not finite"),
        "deep/picture.glb": (textured("big.png"), "images[0] is too big to decode (Image size (900000000 pixels)"),
        "deep/cut-picture.glb": (textured("cut.png"), "not an image that can be read"),
        "cut.glb": (whole[:-100], "cut off"),
        "cut.navmesh": ((folder / "a.navmesh").read_bytes()[:-100], "truncated"),
        "nan.json.gz": (episodes(position=(0, float("nan"), 0)), "'start_position' is"),
        "pointer.glb": (b"version https://git-lfs.github.com/spec/v1\n", "Git LFS pointer"),
        "x.stage_config.json": (b"{", "not valid JSON"),
    }
    for name, (data, _) in bad.items():
        (folder / name).write_bytes(data)
    (folder / "outside.glb").write_bytes(textured("../secret.png"))
    os.mkfifo(folder / "pipe.glb")
    (folder / "gone.glb").symlink_to(folder / "nowhere.glb")
    (folder / "deep" / "big.png").write_bytes(png_header(30_000, 30_000))
    (folder / "deep" / "cut.png").write_bytes(picture.getvalue()[:4000])
    reasons = {name: reason for name, (_, reason) in bad.items()}
    return folder, reasons | {"pipe.glb": "no regular file", "gone.glb": "no such file"}


@pytest.fixture(scope="module")
def checked(zoo, tmp_path_factory):
    """One pass over the zoo in a process of its own: what it printed, its report, and the most memory used [MB]."""
    script = (
        "import resource, sys; from prnav.cli.scenes import main; status = main(['check', *sys.argv[1:]]);"
        "print(max(resource.getrusage(k).ru_maxrss for k in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)), status)"
    )
    path = tmp_path_factory.mktemp("report") / "report.json"
    command = [sys.executable, "-c", script, str(zoo[0]), "--json", str(path)]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    *_, kilobytes, status = out.split()
    assert status == "1"
    return out, json.loads(path.read_text()), int(kilobytes) / 1024


def test_every_broken_file_is_named_with_its_reason_and_no_other(zoo, checked):
    (folder, bad), (out, report, _) = zoo, checked
    found = {entry["path"]: entry for entry in report["files"]}
    assert {path for path, entry in found.items() if entry["status"] == "broken"} == set(bad)
    good = {"a.glb", "a.navmesh", "good.json.gz", "plain.json", "outside.glb"}
    assert "note    outside.glb: '../secret.png' lies outside the mesh's folder and is not read" in out
    assert found["outside.glb"]["warnings"][0].startswith("'../secret.png' lies outside")
    assert {path for path, entry in found.items() if entry["status"] == "good"} == good
    for name, reason in bad.items():
        assert reason in found[name]["problem"], found[name]
        assert f"broken  {name}: " in out
        assert str(folder / name) not in found[name]["problem"]
    assert report["summary"]["episodes"] == [2, 4] and "episodes       6 tried, 4 broken" in out
    assert "unexpected" not in out


def test_the_pass_needs_little_memory(checked):
    """Neither the pass nor its reader: the zoo promises 100 GB."""
    assert checked[2] < 2500  # MB; compiling the kernels and loading the decoders alone takes up to 1,400


def test_all_good_is_status_zero_and_absent_scenes_are_said(tmp_path, slabs, capsys):
    save_glb(slabs((0, 5, 0, 4, 0)), tmp_path / "a.glb")
    (tmp_path / "e.json.gz").write_bytes(episodes("gibson/Pablo.glb"))
    assert main(["check", str(tmp_path)]) == 0
    assert (
        "note    e.json.gz: 1 episode in 1 scene; its scenes are not here: gibson/Pablo.glb" in capsys.readouterr().out
    )


def test_nothing_to_check_is_a_usage_error(tmp_path, capsys):
    assert main(["check", str(tmp_path)]) == 2
    assert main(["check", str(tmp_path / "no")]) == 2
    err = capsys.readouterr().err
    assert "nothing to check" in err and "no such folder" in err
    (tmp_path / "a.glb").write_bytes(b"x")
    with pytest.raises(SystemExit):
        main(["check", str(tmp_path), "--memory", "0"])
    assert main(["check", str(tmp_path), "--data", "mp3d"]) == 2


def test_a_file_that_takes_too_long_or_kills_its_reader_is_reported(tmp_path, slabs):
    save_glb(slabs((0, 5, 0, 4, 0)), tmp_path / "a.glb")
    tasks = find_tasks(tmp_path)
    (slow,) = check_tasks(tasks, tmp_path, limits=CheckLimits(seconds=0.001))
    assert "not read within 0.001 s" in slow.problem and "--timeout" in slow.problem
    reports = check_tasks(tasks * 3, tmp_path, limits=CheckLimits(workers=2))
    assert [report.problem for report in reports] == [None] * 3
    with pytest.raises(SceneError, match="limits of 0 s.*at least 1 worker"):
        CheckLimits(seconds=0)


def test_kinds_of_files(tmp_path):
    (tmp_path / "tiles.bin").write_bytes(b"TASM" + bytes(60) + b"VAND")
    (tmp_path / "buffer.bin").write_bytes(bytes(100))
    assert kind_of(tmp_path / "tiles.bin") == "navmesh" and kind_of(tmp_path / "buffer.bin") is None
    assert kind_of(tmp_path / "gone.json") is None and kind_of(tmp_path / "A.GLB") == "scene"


def test_real_files(real_data, tmp_path):
    names = ("navmesh", "episodes", "scenes/dream_apartment")
    broken = {}
    for name in names:
        path = tmp_path / f"{name.replace('/', '_')}.json"
        assert main(["check", str(real_data / name), "--json", str(path)]) in (0, 1)
        files = json.loads(path.read_text())["files"]
        broken |= {entry["path"]: entry["problem"] for entry in files if entry["status"] == "broken"}
        if name == "episodes":
            assert sum("its scenes are not here" in " ".join(entry["notes"]) for entry in files) == 4
    assert "0x4d534154" in broken.pop("wrong_magic_tile_set.bin")
    assert all("EXT_meshopt_compression" in problem for problem in broken.values())
