"""IMC over UDP: a shipped vehicle in real time and systems on the loopback interface."""

import socket
import struct
import time

import pytest

import imc
from imc.discovery import Service, Services
from runtime.kernel import ScaledClock, WallClock
from runtime.testing import simulate
from tasks.transports.udp import UDP
from tests.outside import free_port
from tests.tasks.transports.imc_station import Afloat, Station, afloat

OWN = 0x001A


@pytest.fixture(scope="module")
def vessel(tmp_path_factory):
    """A vehicle for all tests that change none of its options."""
    with afloat(tmp_path_factory.mktemp("udp")) as vehicle:
        yield vehicle


@pytest.mark.parametrize("order", ["little", "big"])
def test_a_console_that_announces_itself_gets_telemetry_and_is_obeyed(vessel, order):
    console = Station(vessel, system=0x4100 + (order == "big")).join()
    state = console.get(imc.EstimatedState)
    assert (state.src, round(state.lat, 2)) == (OWN, 0.72)
    request = imc.PlanDB(type=imc.PlanDB.Type.REQUEST, op=imc.PlanDB.Op.GET_STATE, request_id=77, dst=OWN)
    console.send(request, order=order)
    answers = vessel.until(lambda: [m for m in console.messages(imc.PlanDB) if m.request_id == 77])
    assert (answers[0].dst, answers[0].src) == (console.system, OWN)


def test_the_state_comes_at_the_rate_of_the_profile_and_other_types_at_theirs(vessel):
    console = Station(vessel).join()
    console.get(imc.EstimatedState)
    messages = console.during(2.0)
    count = sum(type(m) is imc.EstimatedState for m in messages)
    assert 2 <= count <= 6  # 2 Hz
    assert sum(type(m) is imc.EulerAngles for m in messages) > 100  # no limit
    assert {type(m) for m in messages} <= set(vessel.udp.messages.types)
    assert not [m for m in messages if isinstance(m, imc.Distance) and m.src_ent not in labels(vessel, "Altimeter")]


def test_who_comes_is_answered_at_once_and_told_the_last_states(vessel):
    vessel.until(lambda: imc.FuelLevel in {type(state) for state, _ in vessel.udp.states.values()})
    for system in (0x4500, 0x4501):  # FuelLevel comes every 10 s
        console = Station(vessel, system)
        console.announce()
        announce = console.get(imc.Announce)
        assert Services.parse(announce.services).endpoints("imc+udp") == (("127.0.0.1", vessel.udp.port),)
        console.send(imc.Heartbeat())
        assert 0.0 < console.get(imc.FuelLevel, patience=4.0).value <= 100.0
        time.sleep(0.06)


def labels(vessel, *names):
    return [e.id for e in vessel.vehicle.entities if e.label in (*names, "Echo Sounder")]


def test_a_stranger_is_not_taken_and_is_named(vessel):
    stranger = Station(vessel, system=0x4321)
    texts = vessel.hears(imc.TextMessage)
    stranger.send(imc.TextMessage(origin="stranger"))
    vessel.logged("0x4321 at 127.0.0.1 dropped: not announced (it has to send an Announce first)")
    stranger.join()
    stranger.send(imc.TextMessage(origin="friend"))
    vessel.until(lambda: [text.origin for text in texts] == ["friend"])


def test_an_announce_to_the_vehicles_own_port_is_enough(vessel):
    console = Station(vessel, system=0x4400)
    console.announce(port=vessel.udp.port)
    assert console.get(imc.EstimatedState).src == OWN


def test_a_peer_that_moves_to_another_port_is_followed_at_once(vessel):
    console = Station(vessel, system=0x4200).join()
    console.get(imc.EulerAngles)
    old = console.socket
    console.move()
    console.announce()
    console.get(imc.EulerAngles, patience=2.0)
    old.setblocking(False)
    drained(old)
    time.sleep(0.3)
    assert not drained(old), "nothing goes to the old port"


def drained(sock):
    found = []
    while True:
        try:
            found.append(sock.recv(65535))
        except BlockingIOError:
            return found


def test_a_peer_that_moves_to_another_address_is_followed_when_it_sends_from_there(vessel):
    console = Station(vessel, system=0x4201).join()
    console.get(imc.EulerAngles)
    console.move("127.0.0.2")
    console.announce()
    console.send(imc.Heartbeat())
    console.get(imc.EulerAngles, patience=2.0)
    assert vessel.udp.peers.find(0x4201).endpoint == ("127.0.0.2", console.port)


def test_a_peer_that_sends_by_turns_from_two_addresses_is_greeted_once(vessel):
    one, two = Station(vessel, 0x4203), Station(vessel, 0x4203, address="127.0.0.2")
    vessel.until(lambda: imc.FuelLevel in {type(state) for state, _ in vessel.udp.states.values()})
    both = [Service("imc+udp", station.address, station.port) for station in (one, two)]
    one.announce(str(Services.of(both, uid=1)))
    vessel.until(lambda: vessel.udp.peers.find(0x4203))
    for _ in range(20):
        for station in (one, two):
            station.send(imc.Heartbeat())
            time.sleep(0.005)
    vessel.until(lambda: vessel.udp.peers.find(0x4203).taken == 40)
    assert sum("in contact with ccu-test (0x4203)" in text for text in vessel.log) == 1
    assert sum(len(station.messages(imc.FuelLevel)) for station in (one, two)) <= 2, "it comes every 10 s"
    one.packets(), two.packets()
    assert two.get(imc.EulerAngles), "where it came last"
    assert not one.packets()
    time.sleep(1.0)
    one.send(imc.Heartbeat())
    assert one.get(imc.EulerAngles), "it has come back"


def test_nothing_comes_back_and_nothing_is_forwarded_to_others(vessel):
    one, two = Station(vessel, system=0x4001).join(), Station(vessel, system=0x4002).join()
    texts = vessel.hears(imc.TextMessage)
    one.get(imc.Heartbeat), two.get(imc.Heartbeat)
    one.send(imc.TextMessage(origin="one", text="to all"))
    vessel.until(lambda: texts)
    time.sleep(0.3)
    assert not one.messages(imc.TextMessage)
    assert not two.messages(imc.TextMessage)


def test_the_own_id_from_the_network_is_dropped_counted_and_named(vessel):
    liar = Station(vessel, system=0x4666).join()
    states = vessel.hears(imc.VehicleCommand)
    for _ in range(3):
        liar.send(imc.VehicleCommand(src=OWN))
    vessel.logged("0x001A at 127.0.0.1 dropped: sent as this vehicle (it sends our packets back, or is a second")
    vessel.until(lambda: vessel.udp.drops["sent as this vehicle"]["0x001A at 127.0.0.1"] == 3)
    assert sum("sent as this vehicle" in text for text in vessel.log) == 1
    assert not states
    liar.announce(src=OWN, services="", sys_name="impostor")
    vessel.logged("the id 0x001A of this vehicle is also used by impostor at 127.0.0.1: give one of them another id")


def test_rubbish_is_counted_named_and_loses_nothing_else(vessel):
    console = Station(vessel, system=0x4500).join()
    console.get(imc.EulerAngles)
    good = imc.encode(imc.TextMessage(src=0x4500, origin="good"))
    texts = vessel.hears(imc.TextMessage)
    before = vessel.udp.drops["malformed"].total()
    header = struct.pack("<HHHdHBHB", 0xFE54, 160, 60000, 0.0, 0x4500, 1, OWN, 1)
    rubbish = [b"", b"x", good[:-1], good[:-1] + b"\0", bytes(22), header + bytes(65507 - 20), b"\xff" * 60000]
    for data in rubbish:
        console.send_bytes(data)
    console.send_bytes(good + b"surplus")
    vessel.until(lambda: [text.origin for text in texts] == ["good"])
    dropped = sum(vessel.udp.drops[reason].total() for reason in ("malformed", "not announced"))
    assert dropped - before >= len(rubbish)
    assert not [text for text in vessel.log if "Traceback" in text]
    assert vessel.vehicle.task("Transports.UDP").entity.state == imc.EntityState.State.NORMAL


def test_hostile_services_reach_nobody_and_break_nothing(vessel):
    victim = Station(vessel, system=0x4700)
    hostile = [
        "imc+udp://224.0.0.1:6001/;imc+udp://255.255.255.255:6001/",
        ";".join(f"imc+udp://10.{i >> 8}.{i & 255}.1:{i + 1}/" for i in range(2000)),
        "imc+udp://127.0.0.1:99999/;\x1b[2J;imc+udp://[::1]:1/;%s%n;" + "A" * 40000,
        "\udcff\udcfe;imc+udp://127.0.0.1:1/../../etc/passwd",
    ]
    for number, services in enumerate(hostile):
        victim.announce(services, src=0x4710 + number, sys_name="\x1b[31m;ccu\n" * 50)
    vessel.until(lambda: all(vessel.udp.peers.find(0x4710 + number) for number in range(len(hostile))))
    for peer in list(vessel.udp.peers):
        assert len(peer.addresses) <= 16
        assert peer.name.isprintable()
        assert len(peer.name) <= 64
    assert all(text.isprintable() for text in vessel.log)
    assert Station(vessel, system=0x4720).join().get(imc.EstimatedState)


def test_two_systems_with_one_id_are_reported_and_a_restart_is_not(vessel):
    one, two = Station(vessel, 0x4800, "left"), Station(vessel, 0x4800, "right")
    first, second = (str(Services.of(uid=uid)) for uid in (1, 2))
    one.announce(first, sys_name="left")
    vessel.logged("new system within range: left (0x4800) at 127.0.0.1")
    one.announce(second, sys_name="left")
    time.sleep(0.2)
    one.announce(second, sys_name="left")
    time.sleep(0.2)
    assert not [text for text in vessel.log if "0x4800 is also used" in text]
    two.announce(second, sys_name="right")
    time.sleep(0.1)
    one.announce(second, sys_name="left")
    vessel.logged("the id 0x4800 is also used by right at 127.0.0.1 and left at 127.0.0.1")
    vessel.until(lambda: "0x4800 is also used" in vessel.discovery.entity.description)


def test_another_system_with_the_name_of_this_vehicle_is_reported(vessel):
    name = vessel.vehicle.name
    Station(vessel, 0x4801, name).announce(sys_name=name)
    vessel.logged(f"the name {name} of this vehicle is also used by 0x4801 at 127.0.0.1: give one of them another name")
    vessel.until(lambda: "is also used by 0x4801" in vessel.discovery.entity.description)


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
        vessel.until(lambda: not vessel.udp.reach.has(console.system, imc.EulerAngles.ID))
        time.sleep(0.1)
        assert not [m for m in console.during(0.2) if isinstance(m, imc.EulerAngles)]
        console.announce(lat=here.lat, lon=here.lon, port=vessel.udp.port)
        assert console.get(imc.EulerAngles, patience=2.0)


def test_only_in_mode_simulation_the_radio_is_simulated():
    for mode, limited in (("Simulation", True), ("HardwareSimulation", False), ("Hardware/Simulation", False)):
        settings, wanted = {"General": {"Selected": mode}}, {"communication_range": 10.0, "local_port": 0}
        done = simulate(UDP, clock=WallClock(), seconds=0.0, settings=settings, **wanted)
        assert (done.task.reach is not None) == limited


def test_a_taken_port_gives_the_next_and_opened_networks_are_told(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", 0))
        port = taken.getsockname()[1]
        with afloat(tmp_path, f"Transports.UDP:Local Port={port}", "Transports.UDP:Address=0.0.0.0") as vessel:
            assert vessel.udp.port != port
            vessel.logged(f"port {port} is taken: listens at {vessel.udp.port}")
            vessel.logged(f"listens at 0.0.0.0:{vessel.udp.port} without passwords: whoever reaches it can command")


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


def test_services_of_the_vehicle_are_announced_with_their_slash(vessel):
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.bind(("127.0.0.1", next(p for p in vessel.ports if p != vessel.discovery.port)))
    listener.settimeout(15.0)
    Station(vessel, system=0x4900, name="new").announce()
    announce = imc.decode(listener.recv(65535))
    services = Services.parse(announce.services)
    assert (announce.src, announce.dst, announce.sys_name) == (OWN, 0, "lauv-noptilus-1")
    assert announce.sys_type == imc.SystemType.UUV
    assert str(Service("imc+udp", "127.0.0.1", vessel.udp.port)) in announce.services.split(";")
    assert announce.services.split(";") == sorted(announce.services.split(";"))
    assert services.uid == str(round(vessel.vehicle.start_time * 1e9))
    assert services.imc_version == imc.builtin().version
    assert services.refused == 0
    assert round(announce.lat, 2) == 0.72
