"""A flood of packets on the loopback interface: the vehicle stays on time, and its memory stays bounded."""

import os
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

import imc
from tests.outside import slowness
from tests.tasks.transports.imc_station import CONSOLE, Station, afloat

OWN = 0x001A
SECONDS = 4.0
SENDER = """
import socket, sys, time
port, seconds, rate = int(sys.argv[1]), float(sys.argv[2]), 100_000
packets = [bytes.fromhex(text) for text in sys.stdin.read().split()]
flood = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
flood.connect(("127.0.0.1", port))
began, sent = time.monotonic(), 0
while (now := time.monotonic() - began) < seconds:
    for _ in range(min(500, int(now * rate) - sent)):
        try:
            flood.send(packets[sent % len(packets)])
        except OSError:
            pass
        sent += 1
print(sent / seconds)
"""
STATE = imc.EstimatedState(lat=0.72, timestamp=1e9)
FLOODS = {
    "strangers": [imc.encode(STATE.replace(src=0x5000 + i)) for i in range(500)],
    "a peer": [imc.encode(STATE.replace(src=CONSOLE, x=float(i))) for i in range(500)],
    "the own id": [imc.encode(STATE.replace(src=OWN))],
    "rubbish": [b"\x54\xfe" + bytes([i]) * (30 + i) for i in range(100)],
    "announces": [
        imc.encode(
            imc.Announce(src=i, timestamp=float(i), sys_name=f"x{i}", services=f"imc+udp://10.0.{i >> 8}.{i & 255}:1/")
        )
        for i in range(1, 2000)
    ],
}


def resident():
    """Memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.fixture(scope="module")
def vessel(tmp_path_factory):
    with afloat(tmp_path_factory.mktemp("flood")) as vehicle:
        yield vehicle


@pytest.mark.heavy
@pytest.mark.alone
@pytest.mark.parametrize("flood", FLOODS)
def test_a_flood_delays_nobody_and_fills_no_memory(vessel, flood):
    console = Station(vessel).join()
    steps = []
    vessel.vehicle.kernel.post(vessel.vehicle.observe, imc.SimulatedState, lambda _: steps.append(time.monotonic()))
    packets = " ".join(packet.hex() for packet in FLOODS[flood])
    port = vessel.discovery.port if flood == "announces" else vessel.udp.port
    time.sleep(1.0)
    before, began, busy = resident(), time.monotonic(), time.process_time()
    command = [sys.executable, "-c", SENDER, str(port), str(SECONDS)]
    sender = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    rate = float(sender.communicate(packets)[0])
    during = [b - a for a, b in pairwise(steps) if a > began]
    quiet = [b - a for a, b in pairwise(steps) if a < began]
    steady, usual = (len(gaps) / sum(gaps) for gaps in (during, quiet))
    grown = (resident() - before) / 1e6
    print(
        f"{flood}: {rate:.0f} packets/s; {steady:.1f} steps/s, before {usual:.1f}; longest gap {max(during):.3f} s",
        end="",
    )
    share = (time.process_time() - busy) / (time.monotonic() - began)
    print(f", before {max(quiet):.3f} s; {100 * share:.0f} % of a core; {grown:.1f} MB more")
    assert steady > 0.7 * usual
    assert sorted(during)[int(0.99 * len(during))] < 0.1, "the machine may be busy for longer, but seldom"
    assert max(during) < max(0.5 * slowness(), 3.0 * max(quiet))
    assert grown < 30.0
    assert len(vessel.udp.peers) <= 64
    assert vessel.vehicle.task("Transports.UDP").entity.state == imc.EntityState.State.NORMAL
    if flood != "a peer":
        console.send(imc.Heartbeat())
    else:
        time.sleep(1.0)
    console.during(0.1)
    assert console.get(imc.EulerAngles, patience=5.0)
    assert not [text for text in vessel.log if "Traceback" in text or "restarting" in text]
