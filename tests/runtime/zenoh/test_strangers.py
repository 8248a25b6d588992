"""What another host on the network can do to a vehicle on a zenoh bus: nothing."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import imc

SCENE = Path(__file__).parent / "namespaces.py"
REPOSITORY = Path(__file__).parents[3]


def played(namespace: list[str], *arguments: str) -> Any:
    """What a scene in the namespace prints."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(REPOSITORY), *sys.path])}
    done = subprocess.run(
        [*namespace, sys.executable, str(SCENE), *arguments],
        capture_output=True, text=True, timeout=100, cwd=REPOSITORY, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.heavy
def test_an_attacker_on_the_network_reaches_nothing_hears_nothing_and_is_not_obeyed(
    namespace: list[str], tmp_path: Path
) -> None:
    seen = played(namespace, str(tmp_path))
    assert seen["local"] > 2, "the vehicle listens to this computer"
    assert seen["reachable"] == [], "a socket that is not on the loopback address"
    assert seen["open"] == []
    assert seen["connected"] == [], "the vehicle connected to another host"
    assert seen["heard"] == 0
    assert seen["received"] == "imc/lauv-noptilus-1/EstimatedState/Navigation", "a plain program of this computer"
    messages = [m for file in tmp_path.rglob("Data.lsf*") for m in imc.Log(file.parent)]
    assert any(isinstance(message, imc.EstimatedState) for message in messages)
    assert not any(isinstance(message, imc.Abort) for message in messages)
    assert not any(message.src == 0x4001 for message in messages)


@pytest.mark.heavy
@pytest.mark.parametrize("how", ["twins", "scouts"])
def test_a_second_copy_on_another_computer_is_refused_and_both_addresses_named(
    namespace: list[str], tmp_path: Path, how: str
) -> None:
    seen = played(namespace, how, str(tmp_path))
    assert seen["status"] == 2
    assert seen["runs"], "the first one goes on"
    told = seen["told"].splitlines()[-1]
    assert f"lauv-noptilus-1 already runs on this network: on {socket.gethostname()} (10.99.0.1), process " in told
    assert f"process {seen['process']}, since " in told
    assert f"this is {socket.gethostname()} (10.99.0.2)" in told
