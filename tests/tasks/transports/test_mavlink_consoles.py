"""[General] Consoles holds for ground stations: pymavlink's own stations at a shipped vehicle, and its log book."""

import time

import pytest
from pymavlink import mavutil

from tests.outside import free_port
from tests.shoal.network.running import running

ARM, DENIED, PERMISSION_DENIED = 400, 2, 3


class PymavlinkStation:
    """A station of pymavlink at a UDP port."""

    def __init__(self, port: int, system: int) -> None:
        self.link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=system, source_component=190)

    def get(self, name: str, seconds: float = 20.0, again=lambda: None):
        """The next message of a name, sending something until it comes."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.link.mav.heartbeat_send(6, 8, 0, 0, 0)
            again()
            if (found := self.link.recv_match(type=name, blocking=True, timeout=0.5)) is not None:
                return found
        raise AssertionError(f"no {name}")

    def command(self, number: int, *params: float) -> int:
        rest = [0.0] * (7 - len(params))
        send = self.link.mav.command_long_send
        return self.get("COMMAND_ACK", again=lambda: send(26, 1, number, 0, *params, *rest)).result


@pytest.fixture
def station(monkeypatch):
    monkeypatch.setenv("MAVLINK20", "1")
    mavutil.set_dialect("ardupilotmega")
    made = []

    def make(port: int, system: int) -> PymavlinkStation:
        made.append(PymavlinkStation(port, system))
        return made[-1]

    yield make
    for each in made:
        each.link.close()


@pytest.mark.heavy
def test_a_ground_station_that_is_not_listed_sees_everything_and_commands_nothing(tmp_path, station):
    port = free_port()
    settings = [
        *("--set", "Transports.MAVLink:Enabled=Always"),
        *("--set", f"Transports.MAVLink:Links=udpin://127.0.0.1:{port}?flavor=ardupilot"),
        *("--set", "General:Consoles=0x4101, mavlink:250@127.0.0.1, mavlink:251@10.0.0.5"),
    ]
    with running(tmp_path, *settings) as vehicle:
        listed, elsewhere, stranger = (station(port, system) for system in (250, 251, 255))
        for each in (elsewhere, stranger):
            assert each.get("HEARTBEAT").type == mavutil.mavlink.MAV_TYPE_SUBMARINE
            assert each.command(ARM, 1.0) == DENIED
            asked = each.link.mav.param_request_read_send
            value = each.get("PARAM_VALUE", again=lambda ask=asked: ask(26, 1, b"", 0))
            name = value.param_id.encode()
            change = each.link.mav.param_set_send
            error = each.get(
                "PARAM_ERROR",
                again=lambda send=change, name=name, old=value: send(26, 1, name, 1.0, old.param_type),
            )
            assert error.error == PERMISSION_DENIED
            clear = each.link.mav.mission_clear_all_send
            assert each.get("MISSION_ACK", again=lambda send=clear: send(26, 1, 0)).type == 14
        assert listed.command(ARM, 0.0) != DENIED
        clear = listed.link.mav.mission_clear_all_send
        assert listed.get("MISSION_ACK", again=lambda: clear(26, 1, 0)).type == 0
        log = vehicle.log.read_text().splitlines()
        for system in (251, 255):
            named = [line for line in log if f"rejects orders of mavlink:{system}@127.0.0.1" in line]
            assert len(named) == 1, log
            assert "not in [General] Consoles" in named[0]
        assert not [line for line in log if "orders of mavlink:250" in line]
