"""Legs and circles of the shipped profiles in GUIDED: speeds, targets, radii; and what ends or outlives them."""

import math

import pytest

import imc
from support.wgs84 import displacement
from tests.tasks.control.autopilot.bodies import PATIENT

HOME = math.radians(41.185), math.radians(-8.7062)
HEAVY = pytest.mark.heavy


def track(vehicle):
    """North and east (m), and speed (m/s), of each state."""
    states = vehicle.said[imc.EstimatedState]
    return [(*displacement(*HOME, 0.0, s.lat, s.lon, 0.0)[:2], math.hypot(s.vx, s.vy)) for s in states]


def succeeds(vehicle, plan, patience=480.0):
    vehicle.ready()
    vehicle.start(plan)
    assert vehicle.wait(vehicle.outcome, patience) == "SUCCESS", "\n".join(vehicle.texts())


def fails(vehicle, words):
    assert vehicle.wait(vehicle.outcome) == "FAILURE", "\n".join(vehicle.texts())
    vehicle.wait(lambda: words in "\n".join(vehicle.texts()))


def under_way(vehicle, plan):
    vehicle.ready()
    vehicle.start(plan)
    vehicle.wait(lambda: vehicle.outcome() or (track(vehicle) and math.hypot(*track(vehicle)[-1][:2]) > 5.0))
    assert vehicle.outcome() is None, "\n".join(vehicle.texts())
    return vehicle


@HEAVY
@pytest.mark.parametrize(
    ("profile", "kind", "before", "speed"),
    [
        ("autopilot-copter", "copter", "  - takeoff: {altitude: 10, speed: 2 m/s}\n", 3.0),
        ("autopilot-rover", "rover", "", 2.0),
        ("autopilot-rover", "boat", "", 2.0),
    ],
)
def test_the_first_leg_has_the_speed_of_the_plan(body, profile, kind, before, speed):
    vehicle = body(profile, kind=kind)
    z = "altitude: 10" if before else "depth: 0"
    succeeds(vehicle, f"{before}  - goto: {{north: 60, {z}, speed: {speed} m/s}}\n")
    speeds = [v for north, _, v in track(vehicle) if north > 5.0]
    assert max(speeds) < 1.15 * speed + 0.2
    assert sorted(speeds)[len(speeds) // 2] == pytest.approx(speed, rel=0.1)


@HEAVY
@pytest.mark.parametrize(
    ("profile", "kind", "before"),
    [
        ("autopilot-copter", "copter", "  - takeoff: {altitude: 10, speed: 2 m/s}\n"),
        ("autopilot-copter", "px4", "  - takeoff: {altitude: 10, speed: 2 m/s}\n"),
        ("autopilot-rover", "rover", ""),
    ],
)
def test_a_speed_that_is_accepted_and_not_kept_ends_the_plan(body, profile, kind, before):
    vehicle = body(profile, kind=kind)
    vehicle.ready()
    vehicle.tell("ignore speed")
    z = "altitude: 10" if before else "depth: 0"
    vehicle.start(f"{before}  - goto: {{north: 400, {z}, speed: 2 m/s}}\n")
    fails(vehicle, "m/s, not the plan's 2 m/s")


SLOW_TAKEOFF = "  - takeoff: {altitude: 24, speed: 1 m/s}\n"


@HEAVY
def test_a_copter_takes_off_at_the_speed_of_the_plan(body):
    vehicle = body("autopilot-copter", kind="copter")
    succeeds(vehicle, SLOW_TAKEOFF, 720.0)
    states = vehicle.said[imc.EstimatedState]
    heights = [state.height - states[0].height for state in states]
    climbs = sorted(-state.vz for state, height in zip(states, heights, strict=True) if 13.0 < height < 22.0)
    assert climbs[len(climbs) // 2] == pytest.approx(1.0, rel=0.2)
    assert "it climbs at" not in "\n".join(vehicle.texts())


@HEAVY
@pytest.mark.parametrize(("kind", "hand"), [("copter", "ignore speed"), ("px4", "")])
def test_a_takeoff_that_climbs_faster_than_the_plan_says_is_reported(body, kind, hand):
    vehicle = body("autopilot-copter", kind=kind)
    vehicle.ready()
    if hand:
        vehicle.tell(hand)
    vehicle.start(SLOW_TAKEOFF)
    assert vehicle.wait(vehicle.outcome) == "SUCCESS", "\n".join(vehicle.texts())
    told = [text for text in vehicle.texts() if "it climbs at" in text]
    assert len(told) == 1
    assert told[0].endswith("m/s, not the plan's 1 m/s")


@HEAVY
def test_a_speed_that_is_refused_ends_the_plan(body):
    rover = body("autopilot-rover", kind="rover")
    rover.ready()
    rover.tell("refuse 178 4")
    rover.start("  - goto: {north: 400, depth: 0, speed: 2 m/s}\n")
    fails(rover, "the speed was not carried out")


@HEAVY
def test_a_submarine_moves_at_the_speed_of_the_plan_and_circles(body):
    sub = body("autopilot-sub", kind="submarine", overrides=[*PATIENT, "Maneuver.Loiter:Minimum Radius=8"])
    succeeds(
        sub,
        "  - goto: {north: 25, depth: 3, speed: 1 m/s}\n"
        "  - loiter: {north: 25, east: 20, radius: 8, depth: 4, duration: 120s, speed: 1 m/s}\n",
    )
    places = track(sub)
    assert max(speed for north, _, speed in places if north < 20.0) == pytest.approx(1.0, abs=0.2)
    on_circle = [math.dist(at[:2], (25.0, 20.0)) for at in places[len(places) * 2 // 3 :]]
    assert sum(on_circle) / len(on_circle) == pytest.approx(8.0, abs=0.8)


@HEAVY
@pytest.mark.parametrize(("profile", "kind"), [("autopilot-sub", "submarine"), ("autopilot-rover", "rover")])
def test_a_target_that_is_lost_is_sent_again(body, profile, kind):
    vehicle = body(profile, kind=kind)
    vehicle.ready()
    vehicle.tell("ignore targets 1")
    succeeds(vehicle, "  - goto: {north: 15, depth: 0, speed: 1 m/s}\n")


@HEAVY
@pytest.mark.parametrize(
    ("profile", "kind", "before"),
    [
        ("autopilot-copter", "copter", "  - takeoff: {altitude: 10, speed: 2 m/s}\n"),
        ("autopilot-rover", "rover", ""),
    ],
)
def test_a_circle_has_the_radius_of_the_plan(body, profile, kind, before):
    vehicle = body(profile, kind=kind, overrides=[*PATIENT, "Maneuver.Loiter:Minimum Radius=8"])
    z, speed = ("altitude: 10", 4) if before else ("depth: 0", 2)
    succeeds(
        vehicle,
        f"{before}  - goto: {{north: 40, {z}, speed: {speed} m/s}}\n"
        f"  - loiter: {{north: 40, east: 40, radius: 12, {z}, duration: 60s, speed: {speed} m/s}}\n",
    )
    places = track(vehicle)
    radii = [math.dist(at[:2], (40.0, 40.0)) for at in places[-200:]]
    assert sum(radii) / len(radii) == pytest.approx(12.0, abs=0.5)


GAP = "General:Longest Radio Gap=12"
FLIGHT = "  - takeoff: {altitude: 6, speed: 2 m/s}\n  - goto: {north: 60, altitude: 6, speed: 4 m/s}\n"


@HEAVY
@pytest.mark.parametrize(
    ("profile", "kind", "plan"),
    [
        ("autopilot-copter", "copter", FLIGHT),
        ("autopilot-rover", "boat", "  - goto: {north: 60, speed: 2 m/s, depth: 0}\n"),
    ],
)
def test_a_plan_outlives_a_gap_of_the_radio_that_the_profile_allows(body, profile, kind, plan):
    vehicle = under_way(body(profile, kind=kind, overrides=[GAP]), plan)
    vehicle.tell("silent 7")
    vehicle.wait(lambda: any("the autopilot is silent: the plan waits" in text for text in vehicle.texts()))
    vehicle.wait(lambda: any("the autopilot was silent for" in text for text in vehicle.texts()))
    assert vehicle.wait(vehicle.outcome) == "SUCCESS", "\n".join(vehicle.texts())
    assert math.hypot(*track(vehicle)[-1][:2]) == pytest.approx(60.0, abs=4.0)


@HEAVY
def test_a_mode_that_a_pilot_chose_in_a_gap_ends_the_plan(body):
    copter = under_way(body("autopilot-copter", overrides=[GAP]), FLIGHT)
    copter.tell("silent 6\nmode 5")
    fails(copter, "has chosen another mode")


@HEAVY
def test_a_gap_that_is_too_long_ends_the_plan_and_the_copter_returns(body):
    copter = under_way(body("autopilot-copter", overrides=()), FLIGHT)
    copter.tell("silent 6")
    fails(copter, "no HEARTBEAT of the autopilot for 3 s")
    copter.wait(lambda: copter.modes[-1] == "RTL")


@HEAVY
@pytest.mark.parametrize("kind", ["copter", "px4"])
def test_a_takeoff_whose_acknowledgment_is_lost_is_one(body, kind):
    """The copy of the command comes in the air, where ArduCopter refuses it."""
    copter = body("autopilot-copter", kind=kind)
    copter.ready()
    copter.tell("unheard 22")
    copter.start("  - takeoff: {altitude: 20, speed: 2 m/s}\n")
    assert copter.wait(copter.outcome) == "SUCCESS", "\n".join(copter.texts())


@HEAVY
@pytest.mark.parametrize("timeout", [2, 10])
@pytest.mark.parametrize(("kind", "order"), [("px4", 192), ("copter", 22)])
def test_an_order_that_is_lost_in_a_gap_of_the_radio_is_given_after_it(body, kind, order, timeout):
    overrides = [GAP, f"Control.Autopilot.MAVLink:Position Timeout={timeout}"]
    copter = body("autopilot-copter", kind=kind, overrides=overrides)
    copter.ready()
    copter.tell(f"deaf {order}")
    copter.start(FLIGHT)
    copter.wait(lambda: any("Goto" in text for text in copter.texts()) if order == 192 else copter.armed)
    copter.tell(f"silent 7\nhear {order}")  # a copter that does not take off disarms after 10 s
    copter.wait(lambda: any("the autopilot was silent for" in text for text in copter.texts()))
    assert copter.wait(copter.outcome) == "SUCCESS", "\n".join(copter.texts())
    assert math.hypot(*track(copter)[-1][:2]) == pytest.approx(60.0, abs=4.0)
