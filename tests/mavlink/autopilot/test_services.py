"""The services of a companion as bytes in and out, with a peer that keeps a mission; without a vehicle or a socket."""

import math
from functools import partial

import pytest

from mavlink import ARMED, StreamSplitter, encode, load_dialect
from mavlink.autopilot import (
    ACCEPTED,
    ARDUPILOT,
    DROPPED,
    SILENT,
    AutopilotConnection,
    GuidedGoal,
    MissionClient,
    MissionPhase,
    ModeController,
    result_text,
    steered_vehicle,
)
from mavlink.missions import Item, MissionCommand, MissionResult

DIALECT = load_dialect()
SET_MODE, ARM, DENIED = 176, 400, 2
GUIDED, HOLD = 15, 5  # modes of a boat
ITEMS = [Item(6, MissionCommand.NAV_WAYPOINT, x=411850000 + n, y=-87062000, z=0.0) for n in range(3)]


class Peer:
    """An autopilot at the other end: answers what it is sent, and loses the answers that are named in `lost`."""

    def __init__(self, result=ACCEPTED, lost=()):
        self.now, self.result, self.lost = 0.0, result, list(lost)
        self.mode, self.armed, self.kept, self.coming = HOLD, True, [], []
        self.received, self.results = [], []
        self._splitter = StreamSplitter(DIALECT)
        self._answers = []
        self.connection = AutopilotConnection(DIALECT, self, self.results.append)
        self.missions = MissionClient(self.connection.send)
        self.controller = ModeController(
            self.command, self.connection.send, self.results.append, lambda: "", self.missions
        )
        self.controller.vehicle = steered_vehicle(ARDUPILOT, 11)
        self.heartbeat()
        self.run(0.0)

    def command(self, message, fields, on_result):
        self.connection.commands.send(message, fields, on_result, self.now, urgent=True)

    def write(self, data):
        for message in self._splitter.feed(data)[0]:
            self.received.append((self.now, message.name, message.values))
            self.answer_to(message.name, message.values)

    def set_destination(self, data):
        """The sender of a datagram is the autopilot; there is only one."""

    def say(self, name, **values):
        if name in self.lost:
            self.lost.remove(name)
            return
        definition = DIALECT.by_name[name]
        target = {"target_system": 1, "target_component": 191}
        self._answers.append(encode(definition, definition.pack({**target, **values}), 0, 1, 1))

    def heartbeat(self):
        base = 1 | (ARMED if self.armed else 0)
        self.say("HEARTBEAT", type=11, autopilot=3, base_mode=base, custom_mode=self.mode, mavlink_version=3)

    def answer_to(self, name, values):
        if name in ("COMMAND_LONG", "COMMAND_INT"):
            if self.result == ACCEPTED and values["command"] == SET_MODE:
                self.mode = int(values["param2"])
                self.heartbeat()
            self.say("COMMAND_ACK", command=values["command"], result=self.result)
        elif name == "MISSION_COUNT":
            self.coming = [None] * values["count"]
            self.say("MISSION_REQUEST_INT", seq=0)
        elif name == "MISSION_ITEM_INT" and self.coming:
            self.coming[values["seq"]] = values
            if None in self.coming:
                self.say("MISSION_REQUEST_INT", seq=self.coming.index(None))
            else:
                self.kept, self.coming = self.coming, []
                self.say("MISSION_ACK", type=MissionResult.ACCEPTED)
        elif name == "MISSION_REQUEST_LIST":
            self.say("MISSION_COUNT", count=len(self.kept))
        elif name == "MISSION_REQUEST_INT":
            self.say("MISSION_ITEM_INT", **self.kept[values["seq"]])

    def run(self, until):
        """Deliver what was answered, and wake the services when they want to be, until a time (s)."""
        while True:
            while self._answers:
                self.deliver(self._answers.pop(0))
            deadline = min(self.connection.commands.next_deadline, self.missions.next_deadline)
            if deadline > until:
                self.now = until
                return
            self.now = max(self.now, deadline)
            self.connection.commands.tick(self.now)
            self.missions.tick(self.now)

    def deliver(self, data):
        for message in self.connection.receive(data, self.now):
            if message.name == "COMMAND_ACK":
                self.connection.commands.receive(message.values["command"], message.values["result"], self.now)
            elif message.name == "HEARTBEAT":
                self.controller.mode = message.values["custom_mode"]
                self.controller.armed = bool(message.values["base_mode"] & ARMED)
            else:
                self.missions.receive(message.name, message.values, self.now)

    def times(self, name):
        return [time for time, each, _ in self.received if each == name]


@pytest.mark.parametrize("result", [ACCEPTED, DENIED])
def test_a_command_is_acknowledged_or_refused(result):
    peer = Peer(result)
    peer.command("COMMAND_LONG", {"command": ARM, "param1": 1.0}, peer.results.append)
    peer.run(10.0)
    assert peer.results == [result]
    assert len(peer.received) == 1
    assert peer.connection.commands.next_deadline == math.inf


def test_an_acknowledgment_that_is_lost_comes_with_the_next_try():
    peer = Peer(lost=["COMMAND_ACK"])
    peer.command("COMMAND_LONG", {"command": ARM, "param1": 1.0}, peer.results.append)
    peer.run(10.0)
    assert peer.results == [ACCEPTED]
    assert [(time, values["confirmation"]) for time, _, values in peer.received] == [(0.0, 0), (1.0, 1)]


def test_a_command_that_nobody_answers_is_timed_out():
    peer = Peer(lost=["COMMAND_ACK"] * 10)
    peer.command("COMMAND_LONG", {"command": ARM, "param1": 1.0}, peer.results.append)
    peer.run(5.9)
    assert peer.results == []
    peer.run(6.0)
    assert peer.results == [SILENT]
    assert peer.times("COMMAND_LONG") == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def test_the_command_for_which_there_is_no_room_is_answered_at_once():
    peer = Peer(lost=["COMMAND_ACK"] * 1000)
    results = {}
    for number in range(66):  # one is under way, 64 wait
        peer.connection.commands.send("COMMAND_LONG", {"command": number}, partial(results.setdefault, number), 0.0)
    assert results == {64: DROPPED}
    assert "64 other commands wait" in result_text(DROPPED)
    peer.run(1000.0)
    assert {result for number, result in results.items() if number != 64} == {SILENT}
    assert len(results) == 66, "each command has one result"


def test_a_mission_is_uploaded_though_the_last_acknowledgment_is_lost():
    peer = Peer(lost=["MISSION_ACK"])
    peer.missions.upload(ITEMS, 0.0)
    peer.run(1.0)
    assert peer.missions.phase is MissionPhase.WRITING
    peer.run(60.0)
    assert peer.missions.ready
    assert [Item.of(values).pack() for values in peer.kept] == [item.pack() for item in ITEMS]
    assert peer.missions.next_deadline == math.inf


@pytest.mark.parametrize("lost", ["MISSION_REQUEST_INT", "MISSION_COUNT", "MISSION_ITEM_INT"])
def test_a_mission_is_uploaded_whatever_message_is_lost(lost):
    peer = Peer(lost=[lost])
    peer.missions.upload(ITEMS, 0.0)
    peer.run(60.0)
    assert peer.missions.ready


def test_a_mode_is_asked_for_until_a_heartbeat_shows_it():
    peer = Peer()
    peer.mode = peer.controller.mode = GUIDED
    peer.lost = ["HEARTBEAT"]
    peer.controller.hold_position(0.0)
    for tick in range(50):
        peer.run(0.2 * tick)
        peer.controller.tick(peer.now)
    peer.run(10.0)
    assert peer.controller.mode == peer.mode == HOLD
    assert [values["param2"] for _, _, values in peer.received] == [HOLD, HOLD]
    assert peer.controller.goal is GuidedGoal.HOLD


def test_a_mode_that_is_refused_is_reported():
    peer = Peer(DENIED)
    peer.mode = peer.controller.mode = GUIDED
    peer.controller.hold_position(0.0)
    for tick in range(50):
        peer.run(0.2 * tick)
        peer.controller.tick(peer.now)
    assert peer.controller.mode == GUIDED
    assert "the mode was denied" in peer.results
