"""The task that serves the vehicle's page: ports, servers that must not be, packets in both directions."""

import socket
import threading
import time

import pytest

import imc
from imc.console_acl import ConsoleAcl
from runtime.kernel import WallClock
from runtime.profile import load_profile
from runtime.task import State
from runtime.vehicle import build
from tasks.transports.console import MOST_EVENTS, PagePackets
from tests.outside import free_port, until

CONSOLE = 0x4321
SECTION = "Transports.Console"


class Server:
    """A server that serves nothing, until it is stopped."""

    is_secure = False
    rejected_connections = 3

    def __init__(self, task, listener):
        self.task, self.listener = task, listener
        self.ended = threading.Event()
        self.woken = threading.Event()
        self.packets = task.connect_page(CONSOLE, self.woken.set)

    def run(self):
        self.ended.wait()

    def stop(self):
        self.ended.set()


@pytest.fixture
def run(tmp_path):
    """Runs a vehicle with nothing but the page, in a thread; returns its task."""
    ends = []

    def begin(make_page=Server, **options):
        settings = [f"{SECTION}:{name.replace('_', ' ')}={value}" for name, value in options.items()]
        profile = load_profile("lauv-noptilus-1", overrides=[*settings, f"{SECTION}:Enabled=Always"])
        made = build(profile, frozenset(), clock=WallClock(), log_root=tmp_path)
        vehicle = made.vehicle
        task = next(task for task in vehicle.tasks if task.name == SECTION)
        task.make_page = make_page
        texts = task.texts = []
        vehicle.observe(imc.LogBookEntry, lambda entry: texts.append(entry.text))
        services = task.services = []
        vehicle.observe(imc.AnnounceService, lambda offer: services.append(offer.service))
        vehicle.start()
        thread = threading.Thread(target=lambda: vehicle.run(60.0))
        thread.start()
        ends.append((vehicle, thread))
        until(lambda: task.entity.stateful)
        return task

    yield begin
    for vehicle, thread in ends:
        vehicle.kernel.post(vehicle.kernel.stop)
        thread.join(10.0)
        vehicle.close()


def test_a_port_that_is_taken_is_logged_and_the_next_one_serves(run):
    port = free_port()
    with socket.create_server(("127.0.0.1", port)):
        task = run(Port=port)
        until(lambda: task.services)
        (service,) = task.services
        other = int(service.removeprefix("http://127.0.0.1:").strip("/"))
        assert other not in (0, port)
        until(lambda: task.texts)
        assert task.texts == [f"port {port} is taken: listens at {other}"]
        assert (task.entity.state, task.entity.description) == (State.NORMAL, f"port {other}; 3 connections rejected")


def test_without_a_program_that_serves_it_there_is_no_page(run):
    task = run(make_page=None, Port=free_port())
    assert (task.entity.state, task.services) == (State.NORMAL, [])
    assert task.entity.description == "not served: `shoal run` serves the page"


def test_a_page_that_must_not_be_served_is_reported_once_and_tried_again(run, monkeypatch):
    monkeypatch.setattr("tasks.transports.imc_links.port_search.RETRY", 0.05)
    sockets = []
    has_user = threading.Event()

    def make_page(task, listener):
        if has_user.is_set():
            return Server(task, listener)
        sockets.append(listener)
        raise ValueError("make a user first")

    task = run(make_page=make_page, Port=0)
    until(lambda: len(sockets) > 3)
    assert {each.fileno() for each in sockets[:3]} == {-1}
    assert (task.texts, task.entity.state) == (["make a user first"], State.ERROR)
    has_user.set()
    until(lambda: task.entity.state is State.NORMAL)


def test_orders_go_to_the_bus_and_answers_to_the_page(run):
    task = run(Port=0)
    server = task._page
    heard = []
    task.vehicle.observe(imc.Abort, heard.append)
    task.request_messages(["LogBookEntry", "Heartbeat", "PlanControl", "NoSuchMessage"])
    task.set_watched(True)
    task.take_order(b"nonsense")
    task.take_order(imc.encode_with_header(imc.Abort(), time.time(), CONSOLE, 0, task.system, 0xFF))
    task.note("anna: abort")
    until(lambda: heard)
    assert (heard[0].src, heard[0].dst) == (CONSOLE, task.system)
    texts = list[str]()

    def is_noted():
        messages = map(imc.decode, server.packets.take())
        texts.extend(message.text for message in messages if isinstance(message, imc.LogBookEntry))
        return "anna: abort" in texts

    until(is_noted)
    until(lambda: task.malformed == 1)
    assert not server.woken.is_set()
    task.vehicle.kernel.post(task.publish, imc.PlanControl(dst=CONSOLE))
    assert server.woken.wait(10.0)


def test_all_messages_are_kept_only_until_they_are_released(run):
    task = run(Port=0)
    task.set_watched(True)
    task.request_messages(["Heartbeat"])
    task.request_messages([])
    until(lambda: list(task._subscribed) == [""])
    task.release_messages([])
    until(lambda: list(task._subscribed) == ["Heartbeat"])


def test_the_latest_detection_of_each_object_waits_for_the_page():
    packets = PagePackets(CONSOLE, lambda: None)
    for number, x in ((1, 1.0), (2, 2.0), (1, 3.0)):
        found = imc.EstimatedMugState(id=number, x=x)
        packets.put(found, imc.encode(found))
    assert [imc.decode(packet).x for packet in packets.take()] == [3.0, 2.0]


def test_while_nobody_looks_only_positions_and_the_log_book_are_kept(run):
    task = run(Port=0)
    server, kinds = task._page, (imc.EstimatedState, imc.Temperature)

    def kept_kinds():
        server.packets.take()
        for kind in kinds:
            task.vehicle.kernel.post(task.publish, kind())
        done = threading.Event()
        task.vehicle.kernel.post(task.vehicle.kernel.soon, done.set)
        assert done.wait(10.0)
        return {type(imc.decode(packet)) for packet in server.packets.take()} & set(kinds)

    task.request_messages([kind.__name__ for kind in kinds])
    assert kept_kinds() == {imc.EstimatedState}
    task.set_watched(True)
    assert kept_kinds() == set(kinds)
    task.set_watched(False)
    assert kept_kinds() == {imc.EstimatedState}
    task.request_messages([])
    assert kept_kinds() == {imc.EstimatedState}
    task.set_watched(True)
    assert kept_kinds() == set(kinds)


def packet_of(message):
    return imc.encode(message)


def test_the_page_gets_the_latest_of_each_entity_and_every_event():
    wakes = []
    packets = PagePackets(CONSOLE, lambda: wakes.append(1))
    for value in range(3):
        for entity in (1, 2):
            message = imc.Temperature(src_ent=entity, value=float(value))
            packets.put(message, packet_of(message))
    assert wakes == []
    reply = imc.PlanControl(dst=CONSOLE, plan_id="x")
    packets.put(reply, packet_of(reply))
    packets.put(reply, packet_of(reply))
    assert len(wakes) == 2
    found = [imc.decode(packet) for packet in packets.take()]
    assert [type(message).__name__ for message in found] == ["PlanControl", "PlanControl", "Temperature", "Temperature"]
    assert [message.value for message in found[2:]] == [2.0, 2.0]
    assert packets.take() == []


def test_a_page_that_takes_nothing_costs_bounded_memory():
    packets = PagePackets(CONSOLE, lambda: None)
    entry = imc.LogBookEntry(text="again")
    for number in range(MOST_EVENTS + 10):
        packets.put(entry, packet_of(entry))
        state = imc.EstimatedState(timestamp=float(number))
        packets.put(state, packet_of(state))
    assert (len(packets.take()), packets.dropped) == (2 * MOST_EVENTS, 10)


def test_a_position_of_each_second_waits_for_a_page_that_looks_seldom_and_wakes_nobody():
    wakes = []
    packets = PagePackets(CONSOLE, lambda: wakes.append(1))
    times = [number / 10.0 for number in range(41)]
    for timestamp in [*times, 1.0, 1.5]:  # the clock is set back at the end
        state = imc.EstimatedState(timestamp=timestamp)
        packets.put(state, imc.encode_with_header(state, timestamp, 0x1A, 0, 0xFFFF, 0xFF))
    entry = imc.LogBookEntry(text="again")
    packets.put(entry, packet_of(entry))
    found = [imc.decode(packet) for packet in packets.take()]
    assert isinstance(found[0], imc.LogBookEntry)
    assert [message.timestamp for message in found[1:]] == [0.0, 1.0, 2.0, 3.0, 4.0, 1.0, 1.5]
    assert wakes == packets.take() == []


def test_the_list_of_consoles_may_name_users_of_the_page():
    def nobody(_):
        return None

    assert ConsoleAcl([], nobody).allows_page_user("anna")
    listed = ConsoleAcl(["page:anna", "page: ben"], nobody)
    assert [listed.allows_page_user(name) for name in ("anna", "ben", "local", "")] == [True, True, False, False]
    assert not listed.allows(0x4101, "127.0.0.1", imc.Abort.ID)
    assert not ConsoleAcl(["mavlink:255"], nobody).allows_page_user("local")
    with pytest.raises(ValueError, match="page:"):
        ConsoleAcl(["page:"], nobody)
