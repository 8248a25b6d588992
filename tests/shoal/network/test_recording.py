"""Logs of vehicles that a console receives, in folders of their own."""

import asyncio
from pathlib import Path

import pytest

import imc
from shoal.network import Network, NetworkRecorder, UDPLink
from tests.shoal.network.station import OWN, Station, discovery_ports, living


@pytest.mark.heavy
def test_a_vehicle_whose_folders_are_all_taken_gets_a_further_one(tmp_path: Path) -> None:
    """Others may choose names that are alike as names of folders: that ends no recording."""
    taken = ["sub_1", f"sub_1-{OWN:04X}", f"sub_1-{OWN:04X}-2"]
    for name in taken:
        (tmp_path / name).mkdir()

    async def run() -> NetworkRecorder:
        station = Station(discovery_ports(), name="sub:1")
        beat = station.packet(imc.Heartbeat())
        async with living(station, also=[beat]), Network([UDPLink(ports=station.ports)]) as network:
            recorder = NetworkRecorder(network, tmp_path, lambda _: True, report=lambda *_: recorder.stop.set())
            await recorder.run(20.0)
            return recorder

    recorder = asyncio.run(run())
    assert [recording.folder.name for recording in recorder.recordings.values()] == [f"sub_1-{OWN:04X}-3"]
    assert [len(list((tmp_path / name).iterdir())) for name in taken] == [0, 0, 0]
