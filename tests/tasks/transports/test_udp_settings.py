"""IMC over UDP: vehicles with settings of their own, and settings that are wrong."""

import socket
import time

import pytest

import imc
from runtime.kernel import ScaledClock, WallClock
from runtime.testing import simulate
from tasks.transports.udp import UDP
from tests.outside import free_port
from tests.tasks.transports.imc_station import Afloat, Station, afloat

OWN = 0x001A


def test_a_peer_that_sends_too_fast_is_bounded_and_named(tmp_path):
    with afloat(tmp_path, "Transports.UDP:Maximum Rate=50") as vessel:
        console = Station(vessel).join()
        texts = vessel.hears(imc.TextMessage)
        for _ in range(500):
            console.send(imc.TextMessage())
        vessel.logged("0x4042 at 127.0.0.1 dropped: too fast")
        vessel.until(lambda: len(texts) >= 49)
        assert len(texts) < 200


def test_only_listed_consoles_command_if_the_profile_says_so(tmp_path):
    with afloat(tmp_path, "Transports.UDP:Consoles=ccu-lsts-1-1@127.0.0.1, 0x4999@10.0.0.5") as vessel:
        listed, elsewhere, other = (Station(vessel, system=system).join() for system in (0x4101, 0x4999, 0x4042))
        requests = vessel.hears(imc.PlanControl)
        start = imc.PlanControl(op=imc.PlanControl.Op.START, plan_id="nothing", dst=OWN)
        for station in (other, elsewhere, listed):
            station.send(start)
        vessel.until(lambda: [r for r in requests if r.src != OWN])
        time.sleep(0.2)
        assert {r.src for r in requests} - {OWN} == {0x4101}
        vessel.logged("0x4042 at 127.0.0.1 dropped: command of a console that is not listed (see Consoles)")
        vessel.logged("0x4999 at 127.0.0.1 dropped: command of a console that is not listed")
        assert other.get(imc.EstimatedState), "but it may listen"


def test_what_others_say_is_forwarded_once_and_never_back(tmp_path):
    settings = "Transports.UDP:Local Messages Only=false", "Transports.UDP:Transports=TextMessage, EstimatedState"
    with afloat(tmp_path, *settings) as vessel:
        one, two = Station(vessel, system=0x4001).join(), Station(vessel, system=0x4002).join()
        vessel.until(lambda: len(vessel.udp.peers.contacts(time.time())) == 2)
        packet = imc.encode(imc.TextMessage(origin="one", src=0x4001, timestamp=1e9))
        one.send_bytes(packet)
        vessel.until(lambda: packet in two.packets())
        for _ in range(3):
            one.send_bytes(packet)
        time.sleep(0.3)
        assert packet not in two.packets(), "two vehicles that forward would send it for ever"
        assert packet not in one.packets()


@pytest.mark.heavy
def test_silence_ends_the_contact_and_a_packet_begins_it_again(tmp_path):
    with afloat(tmp_path, "Transports.UDP:Contact Timeout=1") as vessel:
        console = Station(vessel).join()
        console.get(imc.EulerAngles)
        vessel.logged("lost contact with ccu-test (0x4042)")
        console.packets()
        time.sleep(0.2)
        assert not console.packets()
        assert not vessel.udp.subscriptions, "nothing is done for nobody"
        console.send(imc.Heartbeat())
        console.get(imc.EulerAngles, patience=2.0)


@pytest.mark.heavy
def test_a_static_destination_needs_no_announce_and_a_peer_may_have_its_own_rate(tmp_path):
    port = free_port()
    settings = (
        f"Transports.UDP:Static Destinations=127.0.0.1:{port}",
        "Transports.UDP:Peer Rates=0x4003/EstimatedState:10",
    )
    with afloat(tmp_path, *settings) as vessel:
        static = Station(vessel, port=port)
        fast = Station(vessel, system=0x4003).join()
        static.get(imc.EstimatedState)
        fast.get(imc.EstimatedState)
        quick = len(fast.during(1.5, imc.EstimatedState))
        slow = len(static.during(1.5, imc.EstimatedState))
        assert 10 <= quick <= 19
        assert 1 <= slow <= 5
        texts = vessel.hears(imc.TextMessage)
        static.send(imc.TextMessage(origin="static"))
        vessel.until(lambda: texts)


@pytest.mark.heavy
def test_the_network_keeps_its_own_time_on_a_scaled_clock(tmp_path):
    with afloat(tmp_path, "Transports.UDP:Contact Timeout=2", clock=ScaledClock(8.0)) as vessel:
        console = Station(vessel).join()
        console.get(imc.EstimatedState)
        states = console.during(1.5, imc.EstimatedState)
        assert 1 <= len(states) <= 5, "2 Hz of the console's time"
        assert not [text for text in vessel.log if "lost contact" in text]


def test_a_simulated_radio_reaches_so_far(tmp_path):
    with afloat(tmp_path, "Transports.UDP:Communication Range=1000", "Transports.UDP:Transports+=Abort") as vessel:
        here = vessel.until(lambda: [s for s, _ in vessel.udp.states.values() if isinstance(s, imc.EstimatedState)])[0]
        near, far = Station(vessel, system=0x4501), Station(vessel, system=0x4502)
        texts, aborts = vessel.hears(imc.TextMessage), vessel.hears(imc.Abort)
        for station, lat in ((far, 0.5), (near, here.lat)):
            station.announce(lat=lat, lon=here.lon)
            vessel.until(lambda station=station: vessel.udp.peers.find(station.system))
            station.send(imc.TextMessage(origin=station.name))
            station.send(imc.Abort())
        near.get(imc.EulerAngles)
        vessel.until(lambda: len(aborts) == 2)
        assert [text.src for text in texts] == [near.system]
        assert not [m for m in far.messages() if not isinstance(m, (imc.SimulatedState, imc.Announce))]
        assert vessel.udp.drops["out of range"]["ccu-test"] >= 1


def test_a_simulated_radio_keeps_the_positions_and_hears_who_comes_back(tmp_path):
    with afloat(tmp_path, "Transports.UDP:Communication Range=1000") as vessel:
        here = vessel.until(lambda: [s for s, _ in vessel.udp.states.values() if isinstance(s, imc.EstimatedState)])[0]
        console = Station(vessel, system=0x4503)
        console.announce(lat=here.lat, lon=here.lon)
        vessel.until(lambda: vessel.udp.peers.find(console.system))
        wish = imc.EntityParameter(name="Communication Range", value="2000")
        label = vessel.udp.entity.label
        console.send(imc.SetEntityParameters(name=label, params=(wish,), dst=OWN))
        vessel.until(lambda: vessel.udp.communication_range == 2000)
        console.packets()
        assert console.get(imc.EulerAngles, patience=2.0), "nobody has announced anything since"
        console.announce(lat=0.5, lon=here.lon)
        vessel.until(lambda: not vessel.udp.reach.reaches(console.system, imc.EulerAngles.ID))
        time.sleep(0.1)
        assert not [m for m in console.during(0.2) if isinstance(m, imc.EulerAngles)]
        console.announce(lat=here.lat, lon=here.lon, port=vessel.udp.port)
        assert console.get(imc.EulerAngles, patience=2.0)


def test_only_in_mode_simulation_the_radio_is_simulated():
    for mode, limited in (("Simulation", True), ("HardwareSimulation", False), ("Hardware/Simulation", False)):
        settings, wanted = {"General": {"Selected": mode}}, {"communication_range": 10.0, "local_port": 0}
        done = simulate(UDP, clock=WallClock(), seconds=0.0, settings=settings, **wanted)
        assert (done.task.reach is not None) == limited


def test_a_taken_port_gives_the_next_and_opened_networks_are_reported(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", 0))
        port = taken.getsockname()[1]
        with afloat(tmp_path, f"Transports.UDP:Local Port={port}", "Transports.UDP:Address=0.0.0.0") as vessel:
            assert vessel.udp.port != port
            vessel.logged(f"port {port} is taken: listens at {vessel.udp.port}")
            vessel.logged(f"listens at 0.0.0.0:{vessel.udp.port} without passwords: anyone who reaches it can command")


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("Address", "everywhere", "'everywhere' is not an IPv4 address"),
        ("Static Destinations", "10.0.0.7", "'10.0.0.7' is not the IPv4 address of a computer and a port"),
        ("Consoles", "neptus", "'neptus' is not in [IMC Addresses]"),
        ("Rate Limiters", "EstimatedState", "'EstimatedState' is not a message and its rate in Hz"),
        ("Filtered Entities", "Voltage", "'Voltage' is not a message and its entities"),
        ("Custom Filters", "its rate in Hz", "'its rate in Hz' is not one of EntityStateChangeFilter"),
        ("Peer Rates", "EstimatedState:2", "'EstimatedState:2' is not a system, a message and a rate"),
    ],
)
def test_a_wrong_option_names_its_line(tmp_path, option, value, reason):
    with pytest.raises(ValueError) as raised:
        Afloat("lauv-noptilus-1", tmp_path, f"Transports.UDP:{option}={value}")
    assert f"{option}: {reason}" in str(raised.value)
    assert "command line" in str(raised.value)


def test_an_entity_that_no_task_has_is_doubted_with_the_nearest(tmp_path):
    filters = "Acceleration:Nothere, Distance:Altimetre+DVL Filtered, Temperature:CTD+Elsewhere, Voltage:Batteries"
    with afloat(
        tmp_path,
        f"Transports.UDP:Filtered Entities={filters}",
        "Transports.UDP:Custom Filters=EntityStateChangeFilter:GSP, LogBookEntryFilter:ERROR",
    ) as vessel:
        assert [(doubt.text, doubt.hint) for doubt in vessel.udp.configuration_warnings()] == [
            ("Filtered Entities: no task of the profile has the entity 'Nothere'", ""),
            ("Filtered Entities: no task of the profile has the entity 'Altimetre'", "did you mean 'Altimeter'?"),
            ("Custom Filters: no task of the profile has the entity 'GSP'", "did you mean 'GPS'?"),
        ]
