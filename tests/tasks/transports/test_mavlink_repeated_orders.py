"""A ground station that repeats an order without end, at shipped vehicles: lines of the log book, and answers."""

import math
from collections import Counter
from itertools import product

import pytest

from tests.repeats import all_but
from tests.tasks.transports.mavlink_tcp_lines import ConnectedVehicle

RATE, REQUESTS = 45, 300
MOST_LINES = 150
MOST_LINES_OF_MODES = 250  # the vehicle does change its mode with each
HOLD, RETURN, OFFBOARD, BY_HAND = ((main | sub << 8) << 16 for main, sub in ((4, 3), (4, 5), (6, 0), (3, 0)))
MODES = HOLD, RETURN, OFFBOARD, BY_HAND


@pytest.fixture
def sail(tmp_path):
    made = []

    def make(profile):
        made.append(ConnectedVehicle(profile, tmp_path))
        return made[-1]

    yield make
    for each in made:
        each.close()


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
ONCE = [("hexa-00" if order in ("takeoff", "modes", "guided item") else "lauv-noptilus-1", order) for order in ORDERS]


def repeat(vehicle, order, times):
    """The kinds of the messages that answer an order, given so many times at RATE."""
    station, answers = vehicle.connect(), Counter()
    for number in range(times):
        name, fields = order(number)
        station.send(name, **fields)
        vehicle.vehicle.run(1.0 / RATE)
        answers.update(message.name for message in station.read())
    vehicle.vehicle.run(2.0)
    answers.update(message.name for message in station.read())
    return answers


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(("profile", "order"), all_but(ONCE, product(["lauv-noptilus-1", "hexa-00"], ORDERS)))
def test_an_order_that_is_repeated_without_end_writes_few_lines_and_each_is_answered(sail, profile, order):
    vehicle = sail(profile)
    answers = repeat(vehicle, ORDERS[order], REQUESTS)
    most = MOST_LINES_OF_MODES if order == "modes" else MOST_LINES
    assert len(vehicle.log_book) <= most, Counter(vehicle.log_book).most_common(5)
    if ORDERS[order](0)[0].startswith("COMMAND"):
        assert answers["COMMAND_ACK"] >= REQUESTS


@pytest.mark.heavy
@pytest.mark.computing
def test_after_a_flood_of_orders_the_log_book_says_how_many_it_left_out_and_logs_the_next_plan(sail):
    vehicle = sail("lauv-noptilus-1")
    repeat(vehicle, reposition, 100)
    assert "more plans start one after the other, which are not logged one by one" in vehicle.log_book
    vehicle.vehicle.run(5.0)
    vehicle.lines[0].send("COMMAND_LONG", command=20)
    vehicle.vehicle.run(1.0)
    logged = vehicle.log_book.count("switching to goto")
    left_out = sum(int(line.split()[0]) for line in vehicle.log_book if "were not logged one by one" in line)
    started = sum(control.info == "plan loaded" for control in vehicle.replies)
    assert (logged + left_out + 1, left_out > 50) == (started, True)
    assert "switching to return" in vehicle.log_book
