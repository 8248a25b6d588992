"""What a program that sends far too much costs a vehicle on a zenoh bus."""

import subprocess
import sys
from pathlib import Path

import pytest

from runtime.zenoh.config import LARGEST_MESSAGE
from tests.runtime.zenoh.processes import Network
from tests.runtime.zenoh.vehicles import NAME, Vehicle, wait_until

HUGE = 400 << 20  # bytes
ASKS = f"""
import sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{{sys.argv[1]}}"]')
config.insert_json5("scouting/multicast/enabled", "false")
session = zenoh.open(config)
for reply in session.get("imc/{NAME}/@q/PlanDB", payload=bytes({HUGE}), timeout=3.0):
    assert reply.err
assert [reply for reply in session.get("imc/{NAME}/@q/EstimatedState", timeout=20.0) if reply.ok]
session.close()
"""


def memory(process: Vehicle) -> int:
    """The most that a process has had in memory (bytes)."""
    status = Path(f"/proc/{process.popen.pid}/status").read_text()
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM"))) << 10


@pytest.mark.heavy
def test_a_huge_query_is_dropped_while_it_arrives_and_the_next_one_is_answered(
    network: Network, tmp_path: Path
) -> None:
    vehicle = Vehicle(network, tmp_path)
    wait_until(vehicle.swims, vehicle)
    before = memory(vehicle)
    asked = subprocess.run(
        [sys.executable, "-c", ASKS, str(network.local_port)], capture_output=True, text=True, timeout=90, check=False
    )
    assert asked.returncode == 0, asked.stderr
    assert memory(vehicle) - before < 2 * LARGEST_MESSAGE < HUGE
    assert not vehicle.ended()
