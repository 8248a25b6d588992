"""What happens when an autopilot loses its position, begins anew, falls silent, or this computer fails."""

import math
from collections import Counter
from itertools import pairwise

import pytest

import imc
from support.wgs84 import displacement
from tests.tasks.control.autopilot.bodies import PATIENT

HOME = math.radians(41.185), math.radians(-8.7062)
MEMORY = "Control.Autopilot.MAVLink:Plans In Memory=true"
OFFBOARD = "Control.Autopilot.MAVLink:PX4 Guidance=offboard"
FAR = "  - goto: {north: 60, speed: 4 m/s, depth: 0}\n  - goto: {north: 60, east: 20, speed: 4 m/s, depth: 0}\n"
FLIGHT = "  - takeoff: {altitude: 6, speed: 2 m/s}\n  - goto: {north: 400, altitude: 6}\n"


def north(vehicle):
    state = vehicle.last(imc.EstimatedState)
    return displacement(*HOME, 0.0, state.lat, state.lon, 0.0)[0] if state else 0.0


def under_way(vehicle, plan, start=5.0):
    vehicle.ready()
    vehicle.start(plan)
    vehicle.wait(lambda: vehicle.outcome() or north(vehicle) > start)
    assert vehicle.outcome() is None, "\n".join(vehicle.texts())
    return vehicle


def fails(vehicle, *words):
    assert vehicle.wait(vehicle.outcome) == "FAILURE", "\n".join(vehicle.texts())
    for text in words:
        vehicle.wait(lambda text=text: text in "\n".join(vehicle.texts()))


def works_again(vehicle, plan):
    vehicle.ready()
    vehicle.said[imc.PlanControlState].clear()
    vehicle.start(plan)
    assert vehicle.wait(vehicle.outcome) == "SUCCESS", "\n".join(vehicle.texts())


@pytest.mark.heavy
def test_a_copter_that_loses_its_position_ends_the_plan_and_lands(body):
    copter = under_way(body("autopilot-copter"), FLIGHT)
    copter.tell("gps lost")
    fails(copter, "the mode was not carried out: Mode change failed: requires position")
    copter.wait(lambda: not copter.armed)
    assert copter.state("Navigation").startswith("ERROR")
    assert copter.modes[-1] == "LAND"  # BRAKE needs a position


@pytest.mark.heavy
def test_an_autopilot_that_begins_anew_under_way_ends_the_plan_and_works_again(body):
    boat = under_way(body("autopilot-rover", kind="boat"), FAR)
    gps, before = boat.vehicle.entities.find("GPS").id, len(boat.said[imc.EntityState])
    boat.tell("reboot")
    fails(boat)
    first = "the autopilot has started anew", "a pilot or a failsafe has chosen another mode"  # as its HEARTBEAT comes
    boat.wait(lambda: any(reason in text for text in boat.texts() for reason in first))
    assert not boat.armed
    normal = imc.EntityState.State.NORMAL
    boat.wait(lambda: any(s.src_ent == gps and s.state != normal for s in boat.said[imc.EntityState][before:]))
    boat.wait(lambda: all(boat.state(label).startswith("NORMAL") for label in ("Autopilot", "Navigation", "GPS")))
    boat.said[imc.VehicleState].clear()
    works_again(boat, "  - goto: {north: 8, speed: 4 m/s, depth: 0}\n")
    times = [state.timestamp for state in boat.said[imc.EstimatedState]]
    assert times == sorted(times)


@pytest.mark.heavy
@pytest.mark.parametrize("jump", [3600, -4])
def test_a_clock_that_jumps_changes_nothing(body, jump):
    boat = under_way(body("autopilot-rover", kind="boat"), FAR)
    states, counts = boat.said[imc.EstimatedState], []
    boat.vehicle.kernel.post(boat.vehicle.observe, imc.Voltage, lambda _: counts.append(len(states)))
    boat.tell(f"clock {jump}")
    assert boat.wait(boat.outcome) == "SUCCESS", "\n".join(boat.texts())
    times = [state.timestamp for state in states]
    assert times == sorted(times)
    assert max(b - a for a, b in pairwise(times)) < 0.1 * 3600
    assert max(Counter(counts).values()) <= 2, "states pause while the autopilot reports its battery"


@pytest.mark.heavy
def test_an_autopilot_that_is_silent_for_a_while_holds_when_it_is_back(body):
    copter = under_way(body("autopilot-copter", overrides=PATIENT[1:]), FLIGHT)
    copter.tell("silent 6")
    fails(copter, "no HEARTBEAT of the autopilot for 3 s")
    stopped = len(copter.said[imc.EstimatedState])
    copter.wait(lambda: copter.modes[-1] == "BRAKE")
    assert len(copter.said[imc.EstimatedState]) > stopped
    assert copter.state("Autopilot").startswith("NORMAL")


@pytest.mark.heavy
def test_a_command_without_an_answer_ends_the_plan(body):
    copter = body("autopilot-copter")
    copter.ready()
    copter.tell("deaf 400")
    copter.start(FLIGHT)
    fails(copter, "arming was not acknowledged")


@pytest.mark.heavy
def test_what_an_autopilot_does_not_do_ends_the_plan(body):
    copter = body("autopilot-copter")
    copter.ready()
    copter.tell("refuse 22 4")
    copter.start(FLIGHT)
    fails(copter, "a takeoff was not carried out")


@pytest.mark.heavy
def test_px4_in_offboard_holds_when_this_computer_fails(body):
    copter = under_way(body("autopilot-copter", kind="px4", overrides=[*PATIENT, OFFBOARD]), FLIGHT)
    assert copter.modes[-1] == "OFFBOARD"
    copter.die()
    hold, offboard = 4 << 16 | 3 << 24, 6 << 16
    copter.wait(lambda: copter.seen()[-1][0] == hold)
    modes = [mode for mode, *_ in copter.seen()]
    assert modes.index(offboard) > 0
    assert copter.seen()[-1][2] < 100.0  # and does not go on to its target, 400 m to the north


@pytest.mark.heavy
def test_a_plan_in_the_memory_goes_on_when_this_computer_fails(body):
    boat = under_way(body("autopilot-rover", kind="boat", overrides=[*PATIENT, MEMORY]), FAR)
    assert boat.modes[-1] == "AUTO"
    boat.die()
    boat.wait(lambda: math.dist(boat.seen()[-1][2:4], (60.0, 20.0)) < 6.0)


@pytest.mark.heavy
def test_a_mission_that_somebody_else_changes_ends_the_plan_and_the_boat_holds(body):
    boat = under_way(body("autopilot-rover", kind="boat", overrides=[*PATIENT, MEMORY]), FAR)
    boat.tell("swap")
    fails(boat, "another mission was put into the autopilot")
    boat.wait(lambda: boat.modes[-1] == "LOITER")


def test_a_plan_that_no_mission_says_is_refused_with_the_maneuver(body):
    boat = body("autopilot-rover", kind="boat", overrides=[*PATIENT, MEMORY])
    boat.ready()
    boat.start("  - goto: {north: 9, speed: 3 m/s, depth: 0}\n  - idle: {duration: 0}\n    id: Wait\n")
    fails(boat, "cannot be put into the autopilot's memory: Wait: a wait without end is no item")
    assert not boat.armed


@pytest.mark.heavy
def test_the_pilot_of_a_boat_in_its_mission_is_not_fought(body):
    boat = under_way(body("autopilot-rover", kind="boat", overrides=[*PATIENT, MEMORY]), FAR)
    boat.tell("mode 0")
    fails(boat, "a pilot or a failsafe has chosen another mode")
    assert boat.modes[-1] == "MANUAL"


@pytest.mark.heavy
def test_a_stop_in_the_mission_holds(body):
    boat = under_way(body("autopilot-rover", kind="boat", overrides=[*PATIENT, MEMORY]), FAR)
    boat.publish(imc.PlanControl(op=imc.PlanControl.Op.STOP, plan_id="test", request_id=2))
    boat.wait(lambda: boat.modes[-1] == "LOITER")
