"""Vehicles on one computer that reach each other over zenoh and over UDP: each message comes once."""

import signal
import time
from collections import Counter
from pathlib import Path

import pytest

import imc
from tests.runtime.zenoh.processes import PATIENCE, Network
from tests.runtime.zenoh.vehicles import Vehicle, wait_until

NAMES = ("first", "second")


def test_two_vehicles_hear_each_other_once_though_both_networks_reach(network: Network, tmp_path: Path) -> None:
    vehicles = [Vehicle(network, tmp_path / name, "-V", name) for name in NAMES]
    for vehicle in vehicles:
        wait_until(vehicle.swims, vehicle)
    time.sleep(4.0)  # a contact over UDP is made within a second
    for vehicle in vehicles:
        vehicle.popen.send_signal(signal.SIGTERM)
    for vehicle in vehicles:
        assert vehicle.popen.wait(PATIENCE) == 0, vehicle.errors
        times = Counter(
            (m.src, m.src_ent, m.timestamp) for m in vehicle.messages() if isinstance(m, imc.EstimatedState)
        )
        assert len({source for source, _, _ in times}) >= 2, "it heard the other one"
        assert max(times.values()) == 1, "a message came over both networks"
        texts = [m.text for m in vehicle.messages() if isinstance(m, imc.LogBookEntry)]
        assert not [text for text in texts if "in the name of this vehicle" in text]


@pytest.mark.heavy
def test_vehicles_that_end_together_end_at_once(network: Network, tmp_path: Path) -> None:
    """Each sees the other one go while it leaves; zenoh must not wait there for the interpreter."""
    for round_number in range(10):
        vehicles = [Vehicle(network, tmp_path / f"{round_number}-{name}", "-V", name) for name in NAMES]
        for vehicle in vehicles:
            wait_until(vehicle.swims, vehicle)
        for vehicle in vehicles:
            vehicle.popen.send_signal(signal.SIGTERM)
        for vehicle in vehicles:
            assert vehicle.popen.wait(PATIENCE) == 0, vehicle.errors
