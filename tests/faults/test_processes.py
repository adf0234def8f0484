"""Commands as processes: interrupted, killed, with pipes that close and disks that are full; nothing is left behind."""

import contextlib
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

FULL = Path("/dev/full")
BEGIN = "import prnav_commands; prnav_commands.{}()"
NAMES = {"eval": "evaluate"}


def words(module, arguments):
    """A command line that begins as the installed command does."""
    return [sys.executable, "-c", BEGIN.format(NAMES.get(module, module)), *arguments]


def start(module, arguments, **options):
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "start_new_session": True, **options}
    return subprocess.Popen(words(module, arguments), **options)


def left(group):
    """Processes of a session that still live."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            state, _, _, session = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
            if int(session) == group and state != "Z":
                found.append((folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()[:80])
    return found


def gone(group, seconds=5.0):
    """What still lives of a session when it has had some time to end."""
    end = time.monotonic() + seconds
    while (found := left(group)) and time.monotonic() < end:
        time.sleep(0.05)
    return found


def parts(folder):
    return [str(path) for path in folder.rglob("*") if ".tmp" in path.name]


def long_commands(place, out):
    """Commands that take some seconds, two of them with workers."""
    scene, other = str(place.scene), str(place.folder / "other.glb")
    if not Path(other).exists():
        shutil.copy(scene, other)
    several = ["--split", "s", "--per-scene", "200000", "--out", out, "--workers", "2"]
    asked = ["--agent", "random", "--episodes-file", str(place.episodes), "--scene", scene, "--out", out]
    return {
        "train": ("train", ["pointgoal", "--config", str(place.config), "--run", out, "total_steps=100000000"]),
        "generate": ("episodes", ["generate", "--scene", scene, "--scene", other, *several]),
        "eval": ("eval", [*asked, "--workers", "2"]),
        "report": ("report", [str(place.run), "--out", out]),
    }


def interrupt(place, tmp_path, name, seconds):
    """A command that is interrupted as by Ctrl-C, which all processes of the terminal get."""
    module, arguments = long_commands(place, str(tmp_path / "out"))[name]
    process = start(module, arguments)
    time.sleep(seconds)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    lines = err.decode().splitlines()
    assert process.returncode in (0, 130), (process.returncode, lines)
    assert not any("Traceback" in line for line in lines), lines
    if process.returncode == 130:
        assert sum("interrupted" in line for line in lines) == 1, lines
    assert not gone(process.pid)
    assert name == "train" or not parts(tmp_path)


@pytest.mark.parametrize("name", ["train", "generate"])
@pytest.mark.parametrize("seconds", [0.3, 2.5])
def test_an_interrupt_ends_all(place, tmp_path, name, seconds):
    interrupt(place, tmp_path, name, seconds)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["train", "generate", "eval", "report"])
@pytest.mark.parametrize("seconds", [0.2, 0.5, 1.0, 2.0, 3.0, 6.0])
def test_an_interrupt_at_any_time_ends_all(place, tmp_path, name, seconds):
    interrupt(place, tmp_path, name, seconds)


def test_workers_end_with_a_killed_parent(place, tmp_path):
    module, arguments = long_commands(place, str(tmp_path / "out"))["generate"]
    process = start(module, arguments, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    end = time.monotonic() + 60
    while len(left(process.pid)) < 4 and time.monotonic() < end:  # itself, two workers, the tracker of resources
        time.sleep(0.05)
    time.sleep(1.0)
    process.kill()
    process.wait()
    assert not gone(process.pid, 5.0)


def test_two_generators_do_not_share_a_folder(place, tmp_path):
    module, arguments = long_commands(place, str(tmp_path / "out"))["generate"]
    first = start(module, arguments)
    end = time.monotonic() + 60
    while not (tmp_path / "out" / "s" / ".lock").exists() and time.monotonic() < end:
        time.sleep(0.05)
    time.sleep(0.3)
    second = start(module, arguments)
    _, err = second.communicate(timeout=60)
    os.killpg(first.pid, signal.SIGINT)
    first.communicate(timeout=60)
    assert second.returncode == 2 and b"another process draws episodes here" in err


def run(module, arguments, **options):
    done = subprocess.run(words(module, arguments), capture_output=True, text=True, timeout=120, **options)
    return done.returncode, done.stdout, done.stderr


def test_a_reader_that_goes_away_is_no_error():
    command = f"{sys.executable} -c '{BEGIN.format('scenes')}' list | head -1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[1:] == ["0"] and not done.stderr


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
@pytest.mark.parametrize(("module", "arguments"), [("scenes", ["list"]), ("train", ["--help"]), ("design", ["list"])])
@pytest.mark.parametrize("buffered", [True, False])
def test_a_full_output_is_one_line(module, arguments, buffered):
    environment = {**os.environ, "PYTHONUNBUFFERED": "" if buffered else "1"}
    with open(FULL, "w") as full:
        done = subprocess.run(
            words(module, arguments), stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, env=environment
        )
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1 and "room on the disk" in done.stderr


@pytest.mark.parametrize(
    "changes",
    [{"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}, {"HOME": None}, {"PRNAV_CACHE": "/proc/self/no"}],
    ids=["ascii", "no home", "no cache"],
)
def test_bare_environments(place, tmp_path, changes):
    environment = {name: value for name, value in {**os.environ, **changes}.items() if value is not None}
    asked = ["--agent", "random", "--episodes-file", str(place.episodes), "--scene", str(place.scene)]
    words = [*asked, "--workers", "1", "--episodes", "2", "--out", str(tmp_path / "o\N{SNOWMAN}")]
    status, out, err = run("eval", words, env=environment)
    assert status == 0 and "success" in out.lower() and "Traceback" not in err, err


def test_a_closed_output_is_no_fault(place):
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -c '{BEGIN.format('scenes')}' list >&-"], stderr=subprocess.PIPE, timeout=60
    )
    assert done.returncode in (0, 2) and b"Traceback" not in done.stderr


def limited(place, arguments, kilobytes, module="train"):
    """A command whose files may have so many kilobytes: as on a disk that fills up."""
    script = (
        f"import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({kilobytes * 1024}, {kilobytes * 1024})); "
        + BEGIN.format(NAMES.get(module, module))
    )
    done = subprocess.run([sys.executable, "-c", script, *arguments], capture_output=True, text=True, timeout=120)
    return done.returncode, done.stderr.splitlines()


@pytest.mark.parametrize("name", ["eval", "generate", "report", "show", "export"])
def test_a_disk_that_is_full_is_one_line(place, tmp_path, name):
    if name == "export":
        module, arguments = "scenes", ["export", str(place.scene), "--out", str(tmp_path / "out.glb")]
    else:
        module, arguments = place.commands(str(tmp_path / "out"))[name]
    status, lines = limited(place, arguments, 0, module)
    assert status == 2 and len(lines) == 1 and "too large" in lines[0], lines
    assert not parts(tmp_path)


def test_training_goes_on_where_the_disk_takes_no_metrics(place, tmp_path):
    """The first checkpoint is larger than the metrics may be: start on an empty disk, resume on a full one."""
    from prnav.cli.train import main as train

    run = tmp_path / "run"
    words = ["pointgoal", "--config", str(place.config), "--run", str(run)]
    assert train([*words, "--steps", "64"]) == 0
    size = (run / "metrics.jsonl").stat().st_size
    status, lines = limited(place, [*words, "--resume", "--steps", "256"], size // 1024 + 1)
    assert any("cannot be written" in line for line in lines), lines
    assert not any("Traceback" in line for line in lines), lines
    assert status == 2 and "checkpoint" in lines[-1]  # the last checkpoint of all is what a run is for
    assert train([*words, "--resume", "--steps", "256"]) == 0


def digest(folder, leave=("tb", ".lock", ".claim")):
    """Content of all files that are kept, but for the times in metrics."""
    kept = {}
    for path in sorted(folder.rglob("*")):
        relative = path.relative_to(folder)
        if path.is_file() and not any(part in leave for part in relative.parts):
            data = path.read_bytes()
            if path.name == "metrics.jsonl":
                data = b"\n".join(line.split(b'"times"')[0] for line in data.splitlines())
            if path.suffix == ".safetensors":
                continue  # seconds stand in them; the weights are compared by their evaluation
            kept[str(relative)] = hashlib.sha256(data).hexdigest()
    return kept


def weights(run):
    from prnav.evaluate.learned import load_run

    return load_run(run, lambda text: None).facts["weights"]


def test_a_run_that_was_killed_before_its_first_checkpoint_begins_again(place, tmp_path):
    from prnav.cli.train import main as train

    run = tmp_path / "run"
    words = ["pointgoal", "--config", str(place.config), "--run", str(run)]
    assert train([*words, "--steps", "64"]) == 0
    want = weights(run)
    for resume in ([], ["--resume"]):
        shutil.rmtree(run / "checkpoints")
        (run / "metrics.jsonl").unlink()
        (run / ".config.toml.abc.tmp.toml").write_text("half")
        assert train([*words, *resume, "--steps", "64"]) == 0
        assert weights(run) == want and not parts(run)


def kill_until_done(module, arguments, again, delays):
    """Start a command over and over, killed after each delay, then to its end."""
    for delay in delays:
        process = start(module, arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(delay)
        process.kill()
        process.wait()
        assert not gone(process.pid, 8.0)
        arguments = again
    status, _, err = run(module, again)
    assert status == 0, err


@pytest.mark.slow
def test_kills_at_any_moment_of_training_change_nothing(place, tmp_path):
    words = ["pointgoal", "--config", str(place.config), "total_steps=4096", "checkpoint_steps=256"]
    whole, killed = (str(tmp_path / name) for name in ("whole", "killed"))
    assert run("train", [*words, "--run", whole, "name=x"])[0] == 0
    again = [*words, "--run", killed, "--resume", "name=x"]
    kill_until_done("train", again, again, [1.0 + 0.25 * i for i in range(30)])
    assert weights(Path(whole)) == weights(Path(killed))
    assert digest(Path(whole)) == digest(Path(killed)) and not parts(Path(killed))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["generate", "eval", "report"])
def test_kills_at_any_moment_of_other_commands_change_nothing(place, tmp_path, name):
    def asked(out):
        module, arguments = long_commands(place, out)[name]
        return module, ["20000" if word == "200000" else word for word in arguments]

    whole, killed = tmp_path / "whole", tmp_path / "killed"
    module, arguments = asked(str(whole))
    assert run(module, arguments)[0] == 0
    module, arguments = asked(str(killed))
    kill_until_done(module, arguments, arguments, [0.5 + 0.2 * i for i in range(15)])
    if name == "report":
        assert whole.read_bytes() == killed.read_bytes()
    else:
        assert digest(whole) == digest(killed)
    assert not parts(tmp_path)


def test_the_same_command_writes_the_same_page(place, tmp_path):
    from prnav.cli.report import main as report

    assert report([str(place.run), "--out", str(tmp_path / "one.html")]) == 0
    assert run("report", [str(place.run), "--out", str(tmp_path / "two.html")])[0] == 0
    assert (tmp_path / "one.html").read_bytes() == (tmp_path / "two.html").read_bytes()
