"""`shoal run --from-snapshot` on files from others: little memory, one plain line, no code of strangers."""

import os
import re
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from tests.runtime.snapshot.adversary import opened, sealed

MODULE = "open('/dev/stdout', 'w').write('CODE OF A STRANGER')\nraise SystemExit(0)\n"


LAUNCHER = """
import resource, subprocess, sys
done = subprocess.run([sys.executable, "-m", "shoal.cli", *sys.argv[1:]], stdout=sys.stderr, timeout=60)
print(done.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def shoal(cwd: Path, *words: object) -> tuple[int, str, float]:
    """Exit status, output, and the largest memory in MB; a small process between, as memory counts from the fork."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONSAFEPATH": "1"}
    command = [sys.executable, "-c", LAUNCHER, *map(str, words)]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=True, env=environment)
    status, kilobytes = done.stdout.split()
    return int(status), done.stderr, int(kilobytes) / 1024


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    root = tmp_path_factory.mktemp("run")
    words = ("--clock", "virtual", "--for", "1.5s", "--snapshot-every", "1s")
    status, output, _ = shoal(root, "run", "lauv-noptilus-1", "-p", "Kinematic", *words)
    assert status == 0, output
    return next(root.glob("log/*/*/*/State-*.msgpack")).read_bytes()


def bomb(state: bytes) -> bytes:
    """Millions of empty lists as the state of a task."""
    content = opened(state)
    content["tasks"]["Daemon"] = msgspec.Raw(b"\xdd\x02\x00\x00\x00" + b"\x90" * (1 << 25))
    return sealed(content)


def hollow(_: bytes) -> bytes:
    return b"\0" * (100 << 20)


@pytest.mark.heavy
@pytest.mark.parametrize("rubbish", [bomb, hollow, lambda _: b"\x91" * 1_000_000, lambda _: b"", lambda s: s[:-9]])
def test_rubbish_is_refused_in_one_line_and_little_memory(tmp_path: Path, state: bytes, rubbish) -> None:
    (tmp_path / "x").write_bytes(rubbish(state))
    status, output, megabytes = shoal(tmp_path, "run", "--from-snapshot", "x")
    assert status == 2
    assert re.fullmatch(r"Error: x: .*(snapshot|values).*\n", output), output
    assert megabytes < 500


@pytest.mark.parametrize(("place", "reason"), [("/dev/zero", "not a file"), (".", "'.'")])
def test_what_is_no_file_is_refused(tmp_path: Path, place: str, reason: str) -> None:
    status, output, megabytes = shoal(tmp_path, "run", "--from-snapshot", place)
    assert status in (1, 2)
    assert reason in output
    assert megabytes < 500


@pytest.mark.heavy
def test_a_snapshot_received_from_others_runs_no_code(tmp_path: Path, state: bytes) -> None:
    content = opened(state)
    content["configuration"] += b"\n[horns.Horn]\nEnabled = Always\n"
    (tmp_path / "State-1.msgpack").write_bytes(sealed(content))
    (tmp_path / "horns.py").write_text(MODULE)
    status, output, _ = shoal(tmp_path, "run", "--from-snapshot", "State-1.msgpack", "--for", "1s")
    assert status == 2
    assert "STRANGER" not in output
    assert "horns" in output


@pytest.mark.heavy
def test_a_task_that_fails_with_a_forged_state_is_named_in_one_line(tmp_path: Path, state: bytes) -> None:
    content = opened(state)
    for attribute in content["tasks"]["Transports.Logging"][2]:
        if attribute[0] == "_announced":
            attribute[1] = "never"
    (tmp_path / "State-1.msgpack").write_bytes(sealed(content))
    status, output, _ = shoal(tmp_path, "run", "--from-snapshot", "State-1.msgpack", "--for", "20s")
    assert status == 1
    assert "Error: Transports.Logging failed with the state of the snapshot" in output
    assert "Traceback" not in output
