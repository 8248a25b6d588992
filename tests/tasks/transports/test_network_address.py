"""Who on a network reaches a vehicle: nobody by default, and those whom [General] Network Address lets in."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCENE = Path(__file__).with_name("imc_namespaces.py")
ROOT = Path(__file__).parents[3]
HERE = [["10.99.0.1", 6002]]


def scene(namespace, folder, address):
    command = [*namespace, sys.executable, str(SCENE), str(folder), address, "12"]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), (folder / "out.txt").read_text()


@pytest.mark.heavy
@pytest.mark.parametrize("address", ["0.0.0.0", "10.99.0.1"])
def test_an_opened_vehicle_is_found_by_every_way_and_says_so(namespace, tmp_path, address):
    found, log = scene(namespace, tmp_path, address)
    assert found["multicast"] == found["broadcast"] == found["unicast"] == HERE
    assert found["states"] >= 3
    assert f"listens at {address}:6002 without passwords: anyone who reaches it can command the vehicle" in log


@pytest.mark.heavy
def test_by_default_nothing_leaves_the_computer_and_nobody_is_received(namespace, tmp_path):
    found, log = scene(namespace, tmp_path, "127.0.0.1")
    assert found == {"multicast": [], "broadcast": [], "unicast": [], "states": 0}
    assert "console" not in log
