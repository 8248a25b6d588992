"""A ground station that repeats an order without end, at shipped vehicles: lines of the log book, and answers."""

import math
import socket
from collections import Counter
from itertools import count

import pytest

import imc
from mavlink import StreamSplitter, encode, mavlink_system_id
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.transports.mavlink import MAVLink
from tests.outside import free_port
from tests.tasks.transports.mavlink_station import DIALECT, HOST

RATE, REQUESTS = 45, 300
MOST_LINES = 150
MOST_LINES_OF_MODES = 250  # the vehicle does change its mode with each
HOLD, RETURN, OFFBOARD, BY_HAND = ((main | sub << 8) << 16 for main, sub in ((4, 3), (4, 5), (6, 0), (3, 0)))
MODES = HOLD, RETURN, OFFBOARD, BY_HAND


class Repeater:
    """A station of PX4's flavor at a vehicle in virtual time, which asks over TCP and reads what comes."""

    def __init__(self, profile, folder):
        loaded, port = load_profile(profile), free_port()
        self.vehicle = build(
            loaded,
            loaded.parse_modes("Simulation"),
            clock=VirtualClock(loaded.start_time_ns),
            log_root=folder / "log",
            state_folder=folder / "db",
        ).vehicle
        self.vehicle.add(MAVLink, "Transports.MAVLink", links=[f"tcpin://{HOST}:{port}?flavour=px4"])
        self.lines, self.answers, self.sequence = [], Counter(), count()
        self.splitter = StreamSplitter(DIALECT)
        self.target = {"target_system": mavlink_system_id(self.vehicle.system), "target_component": 1}
        self.vehicle.start()
        self.vehicle.run(20.0)
        self.replies = []
        self.vehicle.observe(imc.PlanControl, self.replies.append)
        self.vehicle.observe(imc.LogBookEntry, lambda entry: self.lines.append(entry.text))
        self.line = socket.create_connection((HOST, port))
        self.line.setblocking(False)

    def send(self, name, **fields):
        definition = DIALECT.by_name[name]
        known = {field.name for field in definition.fields}
        target = {key: value for key, value in self.target.items() if key in known}
        payload = definition.pack({**target, **fields})
        self.line.sendall(encode(definition, payload, next(self.sequence) % 256, 255, 190))

    def run(self, seconds):
        self.vehicle.run(seconds)
        try:
            while data := self.line.recv(1 << 16):
                self.answers.update(message.name for message in self.splitter.feed(data)[0])
        except BlockingIOError:
            pass


@pytest.fixture
def repeater(tmp_path):
    made = []

    def make(profile):
        made.append(Repeater(profile, tmp_path))
        return made[-1]

    yield make
    for each in made:
        each.line.close()
        each.vehicle.close()


def reposition(number, name="COMMAND_LONG"):
    place = {"x": 411_850_000 + 10 * number, "y": -87_060_000} if name == "COMMAND_INT" else {}
    degrees = {"param5": 41.185, "param6": -8.706, "param7": math.nan} if name == "COMMAND_LONG" else {}
    return name, {"command": 192, "frame": 6, **place} if place else {"command": 192, **degrees}


ORDERS = {
    "reposition": reposition,
    "reposition elsewhere": lambda number: reposition(number, "COMMAND_INT"),
    "takeoff": lambda number: ("COMMAND_LONG", {"command": 22, "param7": math.nan}),
    "orbit": lambda number: (
        "COMMAND_LONG",
        {"command": 34, "param1": 30.0 + number % 9, "param5": math.nan, "param6": math.nan, "param7": math.nan},
    ),
    "speed": lambda number: ("COMMAND_LONG", {"command": 178, "param1": 1, "param2": 1.0 + number % 3 / 10}),
    "terminate": lambda number: ("COMMAND_LONG", {"command": 185, "param1": 1}),
    "modes": lambda number: ("SET_MODE", {"base_mode": 1, "custom_mode": MODES[number % len(MODES)]}),
    "guided item": lambda number: (
        "MISSION_ITEM_INT",
        {"current": 2, "frame": 6, "command": 16, "x": 411_850_000 + 10 * number, "y": -87_060_000},
    ),
}


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "hexa-00"])
def test_an_order_that_is_repeated_without_end_writes_few_lines_and_each_is_answered(repeater, profile, order):
    station = repeater(profile)
    for number in range(REQUESTS):
        name, fields = ORDERS[order](number)
        station.send(name, **fields)
        station.run(1.0 / RATE)
    station.run(2.0)
    most = MOST_LINES_OF_MODES if order == "modes" else MOST_LINES
    assert len(station.lines) <= most, Counter(station.lines).most_common(5)
    if name.startswith("COMMAND"):
        assert station.answers["COMMAND_ACK"] >= REQUESTS


@pytest.mark.heavy
@pytest.mark.computing
def test_after_a_flood_of_orders_the_log_book_says_how_many_it_left_out_and_logs_the_next_plan(repeater):
    station = repeater("lauv-noptilus-1")
    for number in range(100):
        name, fields = reposition(number)
        station.send(name, **fields)
        station.run(1.0 / RATE)
    assert "more plans start one after the other, which are not logged one by one" in station.lines
    station.run(5.0)
    station.send("COMMAND_LONG", command=20)
    station.run(1.0)
    logged = station.lines.count("switching to goto")
    left_out = sum(int(line.split()[0]) for line in station.lines if "were not logged one by one" in line)
    started = sum(control.info == "plan loaded" for control in station.replies)
    assert (logged + left_out + 1, left_out > 50) == (started, True)
    assert "switching to return" in station.lines
