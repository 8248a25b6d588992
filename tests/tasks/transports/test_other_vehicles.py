"""Other vehicles beside a shipped one: what it sends could stop a plan of theirs, so they get nothing."""

import pytest

import imc
from tests.tasks.transports.imc_station import CONSOLE, Station, afloat

NEIGHBOR = 0x001B


class Neighbor(Station):
    """A vehicle that announces itself and sends its state, as DUNE does."""

    def __init__(self, vessel, system=NEIGHBOR, name="lauv-xplore-2"):
        super().__init__(vessel, system, name)

    def announce(self, services=None, port=None, **fields):
        super().announce(services, port, **{"sys_type": imc.SystemType.UUV, **fields})


@pytest.fixture(scope="module")
def vessel(tmp_path_factory):
    with afloat(tmp_path_factory.mktemp("others"), "Transports.UDP:Call Systems=0x001C") as vehicle:
        yield vehicle


def test_another_vehicle_gets_nothing_and_a_console_everything(vessel):
    neighbor, console = Neighbor(vessel), Station(vessel)
    neighbor.join()
    console.join()
    vessel.logged("lauv-xplore-2 is another vehicle and gets nothing, since Call Systems does not name it")
    console.packets()
    received: list[imc.Message] = []
    wanted = {imc.VehicleState, imc.EstimatedState, imc.PlanControlState}
    vessel.until(lambda: received.extend(console.messages()) or wanted <= {type(message) for message in received})
    console.send(imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_CURRENT_NAME, dst=vessel.vehicle.system))
    console.get(imc.LoggingControl)
    assert neighbor.messages() == []
    vessel.until(lambda: f"127.0.0.1:{neighbor.port}, gets nothing" in vessel.udp.entity.description)


def test_what_another_vehicle_says_is_taken(vessel):
    states = vessel.hears(imc.EstimatedState)
    neighbor = Neighbor(vessel).join()
    neighbor.send(imc.EstimatedState(lat=0.5))
    vessel.until(lambda: [state for state in states if state.src == NEIGHBOR])


def test_a_vehicle_that_call_systems_names_gets_everything(vessel):
    Neighbor(vessel, 0x001C, "lauv-xplore-3").join().get(imc.VehicleState)


def test_the_same_system_as_a_console_gets_everything_and_as_a_vehicle_nothing_again(vessel):
    system = Neighbor(vessel, 0x001D, "dune")
    system.join()
    system.announce(sys_type=imc.SystemType.CCU)
    system.get(imc.VehicleState)
    system.join()
    vessel.until(lambda: vessel.udp.vehicles.withholds(0x001D))
    system.packets()
    assert system.during(1.0) == []


def test_a_stranger_does_not_silence_a_console_by_calling_it_a_vehicle(vessel):
    console = Station(vessel, CONSOLE + 1).join()
    console.get(imc.VehicleState)
    seen = vessel.hears(imc.Announce)
    Station(vessel, CONSOLE + 1).announce(services=console.services, sys_type=imc.SystemType.UUV)
    vessel.until(lambda: [other for other in seen if other.sys_type == imc.SystemType.UUV and other.src == CONSOLE + 1])
    console.packets()
    console.get(imc.VehicleState)


def test_a_gateway_sends_to_vehicles(tmp_path):
    with afloat(tmp_path, "Transports.Announce:System Type=ccu") as gateway:
        Neighbor(gateway).join().get(imc.EstimatedState)
