"""imcpy as its users install it: its own actor in one process, a shipped vehicle in another."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from imc.discovery import Services
from tests.repeats import repeat

ROOT = Path(__file__).parents[3]
ACTOR = Path(__file__).with_name("imcpy_actor.py")
ALONE = ["sh", "-c", 'ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"', "sh"]
VEHICLE = [sys.executable, "-m", "shoal.cli", "run", "lauv-noptilus-1", "-p", "Simulation", "--for", "60s"]


@pytest.mark.heavy
@pytest.mark.parametrize("first", ["vehicle", repeat("actor")])
def test_the_actor_of_imcpy_finds_the_vehicle_gets_its_state_and_starts_a_plan(namespace, tmp_path, first):
    both = {"vehicle": VEHICLE, "actor": [sys.executable, str(ACTOR), "lauv-noptilus-1", "by-imcpy"]}
    order = sorted(both, key=lambda name: name != first)
    script = "import subprocess, sys, time, json; a, b = json.loads(sys.argv[1]); first = subprocess.Popen(a); "
    script += "time.sleep(2); second = subprocess.Popen(b); actor = (first, second)[json.loads(sys.argv[2])]; "
    script += "actor.wait(); [p.terminate() for p in (first, second)]; [p.wait() for p in (first, second)]"
    commands = json.dumps([both[name] for name in order])
    command = [*namespace, *ALONE, sys.executable, "-c", script, commands, str(order.index("actor"))]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=120)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    assert lines, done.stdout + done.stderr
    found, _ = json.JSONDecoder().raw_decode(lines[-1])  # the vehicle writes to the same pipe
    assert found["connected"] == [0x1A, "lauv-noptilus-1"]
    assert Services.parse(found["services"]).endpoints("imc+udp")
    assert found["states"] >= 3
    assert found["answer"][0], found["answer"]
    assert found["executing"] == "by-imcpy"
    assert "Traceback" not in done.stderr
