"""IMC over UDP: a shipped vehicle in real time and systems on the loopback interface."""

import socket
import struct
import time

import pytest

import imc
from imc.discovery import Service, Services
from tasks.transports.imc_links.peer_table import MOST_PEERS
from tests.outside import REFUSED
from tests.tasks.transports.imc_station import Station, afloat

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


@pytest.mark.heavy
def test_the_state_comes_at_the_rate_of_the_profile_and_other_types_at_theirs(vessel):
    console = Station(vessel).join()
    console.get(imc.EstimatedState)
    messages = console.during(2.0)
    count = sum(type(m) is imc.EstimatedState for m in messages)
    assert 2 <= count <= 6  # 2 Hz
    assert sum(type(m) is imc.EulerAngles for m in messages) > 100  # no limit
    assert {type(m) for m in messages} <= {imc.Announce, *vessel.udp.messages.types}
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


def test_two_that_appear_together_are_both_answered(vessel):
    consoles = [Station(vessel, system) for system in (0x4510, 0x4511, 0x4512)]
    for console in consoles:
        console.announce()
    assert {console.get(imc.Announce).src for console in consoles} == {OWN}


@pytest.mark.heavy
def test_each_question_for_states_is_answered_whatever_the_rate_of_the_telemetry(vessel):
    console = Station(vessel, system=0x4502).join()
    console.get(imc.EntityState)
    asked = {entity.id for entity in vessel.vehicle.entities if entity.stateful}
    for _ in range(3):
        console.packets()
        console.send(imc.QueryEntityState(dst=OWN))
        found = set()

        def complete(found=found):
            found |= {m.src_ent for m in console.messages(imc.EntityState) if m.dst == console.system}
            return found == asked

        vessel.until(complete, 2.0)
        gps = vessel.vehicle.task_by_label("GPS").entity.id
        console.send(imc.QueryEntityInfo(id=gps, dst=OWN, dst_ent=gps))
        assert console.get(imc.EntityInfo, 2.0).id == gps
        console.send(imc.GetOperationalLimits(dst=OWN))
        assert console.get(imc.OperationalLimits, 2.0)


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


@pytest.mark.heavy
def test_a_peer_that_sends_by_turns_from_two_addresses_is_greeted_once(vessel):
    one, two = Station(vessel, 0x4203), Station(vessel, 0x4203, address="127.0.0.2")
    vessel.until(lambda: imc.FuelLevel in {type(state) for state, _ in vessel.udp.states.values()})
    both = [Service("imc+udp", station.address, station.port) for station in (one, two)]
    one.announce(str(Services.from_system_info(both, uid=1)))
    vessel.until(lambda: vessel.udp.peers.find(0x4203))
    before = vessel.udp.taken
    for _ in range(20):
        for station in (one, two):
            station.send(imc.Heartbeat())
            time.sleep(0.005)
    vessel.until(lambda: vessel.udp.taken == before + 40)
    assert sum("in contact with ccu-test (0x4203)" in text for text in vessel.log) == 1
    assert sum(len(station.messages(imc.FuelLevel)) for station in (one, two)) <= 2, "it comes every 10 s"
    one.packets(), two.packets()
    assert two.get(imc.EulerAngles), "where it came last"
    assert not one.packets()
    time.sleep(1.0)
    one.send(imc.Heartbeat())
    assert one.get(imc.EulerAngles), "it has come back"


@pytest.mark.heavy
@pytest.mark.computing
def test_any_number_of_systems_shuts_out_neither_an_operator_nor_an_abort(tmp_path):
    """More of them than there is room for, all from one address."""
    with afloat(tmp_path) as vessel:
        fakes = Station(vessel, address="127.0.0.9")
        aborts = vessel.hears(imc.Abort)
        for system in range(0x4800, 0x4800 + MOST_PEERS):
            fakes.announce(src=system)
            vessel.until(lambda system=system: vessel.udp.peers.find(system))
            fakes.send(imc.Heartbeat(src=system))
        vessel.until(lambda: len(vessel.udp.peers.contacts(time.time())) == MOST_PEERS)
        Station(vessel, 0x4012).send(imc.Abort(dst=OWN))
        vessel.until(lambda: [abort.src for abort in aborts if abort.src != OWN] == [0x4012])
        operator = Station(vessel, 0x4011).join()
        assert operator.get(imc.EstimatedState).src == OWN


@pytest.mark.heavy
def test_a_console_that_has_ended_is_no_longer_in_contact(vessel):
    console = Station(vessel, system=0x4204).join()
    console.get(imc.EulerAngles)
    console.socket.close()
    vessel.logged(f"lost contact with ccu-test (0x4204): nothing listens at 127.0.0.1:{console.port}")
    assert 0x4204 not in [peer.system for peer, _ in vessel.udp.peers.contacts(time.time())]
    other = Station(vessel, system=0x4205).join()
    assert other.get(imc.EulerAngles)
    assert not vessel.udp.unsent[f"not sent ({REFUSED})"]


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
    first, second = (str(Services.from_system_info(uid=uid)) for uid in (1, 2))
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


@pytest.mark.heavy
def test_another_system_with_the_name_of_this_vehicle_is_reported(vessel):
    name = vessel.vehicle.name
    Station(vessel, 0x4801, name).announce(sys_name=name)
    vessel.logged(f"the name {name} of this vehicle is also used by 0x4801 at 127.0.0.1: give one of them another name")
    vessel.until(lambda: "is also used by 0x4801" in vessel.discovery.entity.description)


@pytest.mark.parametrize(
    ("task", "name", "value"),
    [
        ("UDP", "Consoles", "0x4001"),
        ("UDP", "Maximum Rate", "1"),
        ("UDP", "Contact Timeout", "1"),
        ("UDP", "Static Destinations", "10.0.0.7:6001"),
        ("UDP", "Ignore Filter", "true"),
        ("TCP.Server", "Consoles", "0x4001"),
        ("TCP.Server", "Maximum Rate", "10"),
        ("TCP.Server", "Maximum Connections", "1"),
        ("Announce", "Enable Loopback", "false"),
        ("Announce", "Ports", "1"),
    ],
)
def test_who_commands_and_reaches_the_vehicle_is_up_to_its_profile(vessel, task, name, value):
    """Otherwise any console could shut out all others, with their Abort."""
    parameters = vessel.vehicle.task(f"Transports.{task}").parameter_set
    before = parameters.text(parameters.find(name))
    assert before != value
    console = Station(vessel, system=0x4206).join()
    wish = imc.EntityParameter(name=name, value=value)
    label = vessel.vehicle.task(f"Transports.{task}").entity.label
    console.send(imc.SetEntityParameters(name=label, params=(wish,), dst=OWN))
    told = f"{name} = {value!r} from 0x4206: cannot be changed while the vehicle runs"
    vessel.logged(told)
    vessel.until(lambda: any(told in entry.text for entry in console.messages(imc.LogBookEntry)))
    assert parameters.text(parameters.find(name)) == before


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
