"""What another host on the network can do to a vehicle on a zenoh bus: nothing."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import imc

SCENE = Path(__file__).parent / "namespaces.py"
REPOSITORY = Path(__file__).parents[3]
NEW_NAMESPACE = ["unshare", "-n"] if os.name == "posix" and os.geteuid() == 0 else ["unshare", "-rn"]


@pytest.fixture
def namespace() -> list[str]:
    """The command that runs another one in a network namespace of its own, in which it may create cables."""
    try:
        probe = [*NEW_NAMESPACE, "sh", "-c", "ip link add cable0 type veth peer name cable1 && unshare -n true"]
        done = subprocess.run(probe, capture_output=True, text=True)
        trouble = done.stderr
    except OSError as error:
        done, trouble = None, str(error)
    if done is None or done.returncode:
        words = f"no network namespaces on this machine: {trouble.strip()}"
        if os.environ.get("CI"):
            pytest.fail(words)
        pytest.skip(words)
    return NEW_NAMESPACE


def test_an_attacker_on_the_network_reaches_nothing_hears_nothing_and_is_not_obeyed(
    namespace: list[str], tmp_path: Path
) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(REPOSITORY), *sys.path])}
    done = subprocess.run(
        [*namespace, sys.executable, str(SCENE), str(tmp_path)],
        capture_output=True, text=True, timeout=100, cwd=REPOSITORY, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert seen["local"] > 2, "the vehicle listens to this computer"
    assert seen["reachable"] == [], "a socket that is not on the loopback address"
    assert seen["open"] == []
    assert seen["connected"] == [], "the vehicle connected to another host"
    assert seen["heard"] == 0
    assert seen["received"] == "imc/lauv-noptilus-1/EstimatedState/Navigation", "a plain program of this computer"
    messages = [m for file in tmp_path.rglob("Data.lsf*") for m in imc.Log(file.parent)]
    assert any(isinstance(message, imc.EstimatedState) for message in messages)
    assert not any(isinstance(message, imc.Abort) for message in messages)
