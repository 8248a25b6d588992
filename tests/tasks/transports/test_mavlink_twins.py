"""A station or vehicle that has the vehicle's MAVLink id is a fault that is told, on each kind of link."""

import socket

import pytest

from runtime import State
from runtime.kernel import ScaledClock
from tests.outside import free_port
from tests.tasks.transports.mavlink_station import HOST, SerialStation, Station, TcpStation, mavlink, sail

OURS = 26
FAST = 20.0
FAULT = f"MAVLink id {OURS} is also that of "


async def shows(control, what, seconds=10.0):
    """Wait until the state of MAVLink's entity shows a fault of this kind, or no more."""
    entity, end = mavlink(control).entity, control.now + seconds * FAST
    while (FAULT in entity.description) != what:
        assert control.now < end, entity.description
        await control.sleep(0.1)
    return entity.state


class Ends:
    """The other end of a link: `connect` gives a station there, whatever the scheme."""

    def __init__(self, scheme, folder):
        self.scheme = scheme
        self.port = free_port()
        self.line = folder / "ttyTEST"
        self.server = socket.create_server((HOST, self.port)) if scheme == "tcpout" else None

    @property
    def link(self):
        if self.scheme == "serial":
            return f"serial://{self.line}?baud=57600"
        return f"{self.scheme}://{'127.255.255.255' if self.scheme == 'udpbcast' else HOST}:{self.port}"

    async def connect(self, control):
        if self.scheme == "serial":
            station = SerialStation(control, self.line, OURS)
        elif self.scheme == "tcpin":
            station = TcpStation(control, (HOST, self.port), OURS)
        elif self.server is not None:
            self.server.setblocking(False)
            while True:
                try:
                    station = TcpStation(control, self.server.accept()[0], OURS)
                    break
                except BlockingIOError:
                    await control.sleep(0.05)
        elif self.scheme == "udpin":
            station = Station(control, system=OURS)
            station.vehicle = (HOST, self.port)
            return station
        else:
            station = Station(control, self.port, OURS, "127.255.255.255" if self.scheme == "udpbcast" else HOST)
        await station.expect("HEARTBEAT", seconds=30.0 * FAST)
        return station


@pytest.mark.heavy
@pytest.mark.parametrize("scheme", ["udpin", "udpout", "udpbcast", "tcpin", "tcpout", "serial"])
def test_a_heartbeat_with_our_id_is_a_fault_until_it_has_been_away(scheme, tmp_path):
    ends = Ends(scheme, tmp_path)

    async def script(control):
        station = await ends.connect(control)
        if scheme == "udpbcast":  # who hears at the address of a network sends from its own
            station.socket.close()
            station, vehicle = Station(control, system=OURS), station.vehicle
            station.vehicle = vehicle
        assert mavlink(control).entity.state is State.NORMAL
        station.send("HEARTBEAT", type=2, autopilot=3)
        assert await shows(control, True) is State.FAULT
        assert await shows(control, False, 40.0) is not State.FAULT

    run = sail(script, ends.link, clock=ScaledClock(FAST))
    if ends.server is not None:
        ends.server.close()
    told = [text for text in run.log if FAULT in text]
    assert len(told) == 1
    assert "set System Id" in told[0]


def test_a_computer_on_board_has_our_id_with_right():
    async def script(control):
        station = Station(control, system=OURS)
        station.vehicle = (HOST, port)
        station.send("HEARTBEAT", type=18, autopilot=8)  # as component 190
        await station.expect("HEARTBEAT")
        await control.sleep(3.0)
        assert mavlink(control).entity.state is State.NORMAL

    port = free_port()
    run = sail(script, f"udpin://{HOST}:{port}")
    assert not any(FAULT in text for text in run.log)


def test_many_twins_are_reported_once_each_and_the_last_ones_are_not_forgotten():
    async def script(control):
        for _ in range(20):
            station = Station(control, system=OURS)
            station.vehicle = (HOST, port)
            station.send("HEARTBEAT", type=2, autopilot=3)
            await control.sleep(0.2)
            station.socket.close()
        await control.sleep(1.0)
        state = mavlink(control).entity
        assert (state.state, "and 13 more: set System Id" in state.description) == (State.FAULT, True)

    port = free_port()
    run = sail(script, f"udpin://{HOST}:{port}", maximum_peers=64)
    assert sum(FAULT in text for text in run.log) == 16
