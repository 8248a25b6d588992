"""The controller of mode, arming and target, with an autopilot that acknowledges or refuses, and does nothing."""

from dataclasses import replace
from itertools import pairwise

import pytest

import imc
from mavlink.autopilot.command_client import ACCEPTED, WITHDRAWN
from mavlink.autopilot.guided_mode_controller import POSITION_TARGET, WARM_UP, ModeController
from mavlink.autopilot.leg import Leg, ReportedPosition
from mavlink.autopilot.mission_client import MissionClient, MissionPhase
from mavlink.autopilot.setpoints import REPOSITION
from mavlink.autopilot.vehicle_modes import ARDUPILOT, PX4, steered_vehicle

FAILED = 4
HERE = ReportedPosition(0.7188, -0.1519, amsl=40.0, above_home=10.0)


def path(**values):
    usual = {"end_lat": HERE.lat, "end_lon": HERE.lon, "speed": 3.0, "speed_units": imc.SpeedUnits.METERS_PS}
    return imc.DesiredPath(**{**usual, **values})


class Deaf:
    """A pilot whose autopilot acknowledges, or refuses, and does nothing; `said` has times and what was sent."""

    def __init__(self, body, result=0):
        self.now, self.said, self.words = 0.0, [], []
        memory = MissionClient(self.send)
        self.pilot = ModeController(self.give(result), self.send, self.words.append, lambda: "", memory)
        self.pilot.vehicle, self.pilot.armed, self.pilot.position = body, True, HERE
        self.pilot.mode = body.hold

    def send(self, name, fields):
        self.said.append((self.now, name, fields))

    def give(self, result):
        def give(message, fields, then):
            self.said.append((self.now, message, fields))
            then(result)

        return give

    def run(self, seconds):
        for _ in range(round(5 * seconds)):
            self.pilot.tick(self.now)
            self.now += 0.2


def test_setpoints_stream_before_offboard_and_on_until_it_has_left_it():
    line = Deaf(steered_vehicle(PX4, 2, offboard=True))
    line.pilot.follow(Leg(path(), HERE, 10.0), 0.0)
    line.run(1.6)
    asked = next(time for time, name, _ in line.said if name == "COMMAND_LONG")
    before = [time for time, name, _ in line.said if name == POSITION_TARGET and time < asked]
    assert asked >= WARM_UP
    assert len(before) >= 5
    line.pilot.mode = line.pilot.vehicle.guided
    line.run(1.0)
    line.pilot.hold_position(line.now)
    line.run(1.0)
    times = [time for time, name, _ in line.said if name == POSITION_TARGET]
    assert max(b - a for a, b in pairwise(times)) < 0.5
    assert times[-1] > line.now - 0.5
    line.pilot.mode = line.pilot.vehicle.hold
    line.run(1.0)
    assert line.said[-1][0] < line.now - 0.5


@pytest.mark.parametrize(("kind", "hold", "instead"), [(2, 17, 9), (11, 5, 4), (12, 16, 2)])
def test_a_hold_that_is_refused_gives_way_to_one_that_needs_no_position(kind, hold, instead):
    line = Deaf(steered_vehicle(ARDUPILOT, kind), result=4)
    line.pilot.mode = 3
    line.pilot.hold_position(0.0)
    line.run(12.0)
    asked = [fields["param2"] for _, _, fields in line.said]
    assert asked[:4] == [hold] * 3 + [instead]
    assert line.words


class Remembered(MissionClient):
    """A mission that is in the autopilot's memory already."""

    def __init__(self):
        super().__init__(lambda *_: None, phase=MissionPhase.READY, items=("home", "there", "back"), current=1)

    def head_for(self, start, now):
        return True


def test_orders_that_took_several_tries_leave_the_next_ones_theirs():
    """On a bad line, HEARTBEAT may show only after the third time that it is armed."""
    rover = steered_vehicle(ARDUPILOT, 10)
    line = Deaf(rover)
    line.pilot.missions, line.pilot.armed, line.pilot.mode = Remembered(), False, rover.arming_mode
    leg = Leg(path(), HERE, 0.0)
    leg.item = 1
    line.pilot.follow(leg, 0.0)
    line.run(4.0)
    line.pilot.armed = True
    before = len(line.said)
    line.run(4.6)
    assert [fields["command"] for _, _, fields in line.said] == [400] * 3 + [176] * 3
    assert (before, line.pilot.error) == (3, "")
    line.run(2.0)
    assert line.pilot.error == "the mode was accepted, but did not come"


@pytest.mark.parametrize(("current", "mode", "waits"), [(2, "hold", True), (1, "hold", False), (2, "guided", False)])
def test_a_mission_that_is_left_at_its_last_item_may_be_over(current, mode, waits):
    """Whatever told so was lost, or comes after the mode in which autopilots are then."""
    rover = steered_vehicle(ARDUPILOT, 10)
    line = Deaf(rover)
    line.pilot.missions, line.pilot.mode = Remembered(), rover.mission
    line.pilot.missions.current = current
    leg = Leg(path(), HERE, 0.0)
    leg.item = 2
    line.pilot.follow(leg, 0.0)
    line.run(1.0)
    line.pilot.mode = getattr(rover, mode)
    line.run(2.0)
    assert (line.pilot.error == "") is waits
    line.run(2.0)
    assert line.pilot.error.startswith("a pilot or a failsafe has chosen another mode")
    assert line.said == []


class Held(Deaf):
    """Keeps the commands, which the test answers."""

    def __init__(self, body):
        super().__init__(body)
        self.waiting = []

    def give(self, _):
        def give(message, fields, then):
            self.said.append((self.now, message, fields))
            self.waiting.append(then)

        return give


def test_the_order_of_a_leg_is_given_again_after_it_was_withdrawn():
    line = Held(steered_vehicle(PX4, 2))
    line.pilot.follow(Leg(path(), HERE, 10.0), 0.0)
    line.run(2.0)
    assert [fields["command"] for _, _, fields in line.said] == [REPOSITION]
    line.waiting.pop()(WITHDRAWN)
    line.run(2.0)
    assert [fields["command"] for _, _, fields in line.said] == [REPOSITION] * 2
    line.waiting.pop()(ACCEPTED)
    line.run(2.0)
    assert len(line.said) == 2


@pytest.mark.parametrize(
    ("refused_at", "climbs", "error_after"),
    [(0.4, False, 0.2), (1.6, False, 5.2), (1.6, True, None)],
)
def test_a_refused_takeoff_counts_unless_it_was_repeated_and_the_vehicle_climbs(refused_at, climbs, error_after):
    ground = replace(HERE, amsl=30.0, above_home=0.0)
    line = Held(steered_vehicle(ARDUPILOT, 2))
    line.pilot.mode, line.pilot.position = line.pilot.vehicle.guided, ground
    line.pilot.follow(Leg(path(flags=imc.DesiredPath.Flags.TAKEOFF, end_z=10.0), ground, 10.0), 0.0)
    line.run(refused_at)
    line.waiting.pop()(FAILED)
    if climbs:
        line.pilot.position = replace(ground, above_home=1.5)
    while not line.pilot.error and line.now < 20.0:
        line.run(0.2)
    took = line.now - refused_at
    assert line.pilot.error == ("" if climbs else "a takeoff was not carried out")
    assert climbs or took == pytest.approx(error_after, abs=0.3)


def test_a_hold_after_a_plan_does_not_fight_a_failsafe_that_the_leg_has_not_noticed():
    line = Deaf(steered_vehicle(ARDUPILOT, 2))
    line.pilot.mode = 4
    line.pilot.follow(Leg(path(), HERE, 10.0), 0.0)
    line.run(1.0)
    line.pilot.mode = 6  # RTL, in the same HEARTBEAT that says critical
    line.pilot.hold_position(line.now)
    line.said.clear()
    line.run(5.0)
    assert not line.said
