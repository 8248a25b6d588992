"""Plans of the profiles autopilot-copter and autopilot-rover, carried out by a stand-in for their autopilots."""

import math

import pytest

import imc
from support.wgs84 import displacement
from tests.tasks.control.autopilot.bodies import PATIENT

HOME = math.radians(41.185), math.radians(-8.7062)
SQUARE = """
  - takeoff: {altitude: 6, speed: 2 m/s}
  - goto: {north: 15, altitude: 8}
  - goto: {north: 15, east: 15, altitude: 8}
  - land: {}
"""


def place(state):
    north, east, _ = displacement(*HOME, 0.0, state.lat, state.lon, 0.0)
    return north, east, state.alt


@pytest.mark.heavy
def test_a_copter_takes_off_flies_two_legs_and_lands(body):
    copter = body("autopilot-copter")
    copter.ready()
    copter.start(SQUARE)
    assert copter.wait(copter.outcome) == "SUCCESS", "\n".join(copter.texts())
    assert not copter.armed
    places = [place(state) for state in copter.said[imc.EstimatedState]]
    for corner in ((15.0, 0.0, 8.0), (15.0, 15.0, 8.0)):
        assert min(math.dist(corner, at) for at in places) < 2.0
    assert places[-1] == pytest.approx((15.0, 15.0, 0.0), abs=1.5)
    assert copter.modes == ["STABILIZE", "GUIDED", "LAND"]


@pytest.mark.heavy
def test_px4_takes_off_circles_hovers_and_lands(body):
    copter = body("autopilot-copter", kind="px4")
    copter.ready()
    copter.start("""
  - takeoff: {altitude: 5, speed: 2 m/s}
  - loiter: {north: 0, radius: 10, duration: 6, altitude: 5}
  - loiter: {north: 20, duration: 3, type: HOVER, altitude: 5}
  - land: {}
""")
    assert copter.wait(copter.outcome) == "SUCCESS", "\n".join(copter.texts())
    assert copter.modes == ["LOITER", "TAKEOFF", "LOITER", "POSCTL", "LOITER", "LAND"]
    places = [place(state) for state in copter.said[imc.EstimatedState]]
    assert sum(abs(math.hypot(north, east) - 10.0) < 1.5 for north, east, _ in places) > 50
    assert not any("COMMAND" in text or "accepted" in text for text in copter.texts())


@pytest.mark.heavy
def test_a_boat_goes_circles_and_keeps_station(body):
    boat = body("autopilot-rover", "--old", kind="boat", overrides=[*PATIENT, "Maneuver.Loiter:Minimum Radius=8"])
    boat.ready()
    boat.start("""
  - goto: {north: 20, speed: 3 m/s, depth: 0}
  - loiter: {north: 20, radius: 8, duration: 8, speed: 3 m/s, depth: 0}
  - station_keeping: {north: 5, east: 5, duration: 5, speed: 3 m/s, depth: 0}
""")
    assert boat.wait(boat.outcome) == "SUCCESS", "\n".join(boat.texts())
    assert boat.modes[:2] == ["MANUAL", "GUIDED"]
    places = [place(state)[:2] for state in boat.said[imc.EstimatedState]]
    assert math.dist(places[-1], (5.0, 5.0)) < 3.5
    assert sum(abs(math.dist(at, (20.0, 0.0)) - 8.0) < 1.5 for at in places) > 30
    boat.wait(lambda: boat.modes[-1] == "LOITER")  # it holds after the plan


@pytest.mark.heavy
def test_a_submarine_dives_to_a_depth(body):
    sub = body("autopilot-rover", kind="submarine", overrides=[*PATIENT, "General:Absolute Maximum Depth=10"])
    sub.ready()
    sub.start("  - goto: {north: 10, speed: 2 m/s, depth: 4}")
    assert sub.wait(sub.outcome) == "SUCCESS", "\n".join(sub.texts())
    assert sub.last(imc.EstimatedState).depth == pytest.approx(4.0, abs=1.1)


@pytest.mark.heavy
def test_a_plane_takes_off_and_circles_at_the_end_of_its_leg(body):
    radius = "Control.Autopilot.MAVLink:Radius To Endpoint=80"
    plane = body(
        "autopilot-copter",
        kind="plane",
        overrides=[*PATIENT, radius, radius.replace("Radius To Endpoint=80", "Height Tolerance=5")],
    )
    plane.ready()
    plane.start("""
  - takeoff: {altitude: 30, speed: 10 m/s}
  - goto: {north: 300, altitude: 30, speed: 10 m/s}
""")
    assert plane.wait(plane.outcome) == "SUCCESS", "\n".join(plane.texts())
    assert plane.modes[:3] == ["MANUAL", "TAKEOFF", "GUIDED"]
    plane.publish(imc.Abort())
    plane.wait(lambda: plane.modes[-1] == "RTL")  # it cannot land on command


@pytest.mark.heavy
def test_who_disarms_a_boat_is_not_contradicted(body):
    boat = body("autopilot-rover", kind="boat")
    boat.ready()
    boat.start("  - goto: {north: 200, speed: 3 m/s, depth: 0}")
    boat.wait(lambda: place(boat.last(imc.EstimatedState))[0] > 5.0)
    boat.tell("disarm")
    assert boat.wait(boat.outcome) == "FAILURE"
    assert "it was disarmed" in "\n".join(boat.texts())
    assert [state.state for state in boat.said[imc.ArmingState]][-1] == imc.ArmingState.State.DISARMED


def flying(copter, then="  - goto: {north: 400, altitude: 6}\n"):
    copter.ready()
    copter.start("  - takeoff: {altitude: 6, speed: 2 m/s}\n" + then)
    copter.wait(lambda: place(copter.last(imc.EstimatedState))[0] > 5.0)


@pytest.mark.heavy
def test_the_mode_that_a_pilot_chooses_is_not_fought(body):
    copter = body("autopilot-copter")
    flying(copter)
    copter.tell("mode 9")
    assert copter.wait(copter.outcome) == "FAILURE", "\n".join(copter.texts())
    assert any("has chosen another mode" in text for text in copter.texts())
    copter.wait(lambda: not copter.armed)
    assert copter.modes[-2:] == ["GUIDED", "LAND"]  # and not BRAKE, as after other plans


@pytest.mark.heavy
def test_a_killed_autopilot_is_an_error_and_a_new_one_works(body):
    copter = body("autopilot-copter", overrides=())
    flying(copter)
    copter.autopilot.kill()
    assert copter.wait(copter.outcome) == "FAILURE", "\n".join(copter.texts())
    copter.wait(lambda: copter.state("Autopilot").startswith("ERROR: "))
    copter.wait(lambda: copter.state("Navigation") == copter.state("GPS") == "ERROR: the autopilot is silent")
    copter.wait(lambda: copter.last(imc.VehicleState).op_mode == imc.VehicleState.OpMode.ERROR)
    silent_since = copter.last(imc.EstimatedState).timestamp
    copter.autopilot = copter.stand_in(kind="copter")
    copter.wait(lambda: copter.last(imc.VehicleState).op_mode == imc.VehicleState.OpMode.SERVICE)
    failed = next(entry for entry in copter.said[imc.LogBookEntry] if "no HEARTBEAT" in entry.text)
    assert failed.htime - silent_since == pytest.approx(3.0, abs=2.0)
    copter.said[imc.PlanControlState].clear()
    copter.start("  - takeoff: {altitude: 5, speed: 2 m/s}\n  - land: {}\n")
    assert copter.wait(copter.outcome) == "SUCCESS", "\n".join(copter.texts())


@pytest.mark.heavy
def test_an_abort_lands_and_an_idle_copter_too(body):
    settings = "Control.Autopilot.MAVLink:Idle Timeout=5", "Control.Autopilot.MAVLink:Ending=land"
    copter = body("autopilot-copter", overrides=[*PATIENT, *settings])
    flying(copter)
    copter.publish(imc.Abort())
    copter.wait(lambda: copter.modes[-1] == "LAND" and not copter.armed)
    copter.wait(lambda: copter.last(imc.VehicleState).op_mode == imc.VehicleState.OpMode.SERVICE)
    copter.said[imc.PlanControlState].clear()
    copter.start("  - takeoff: {altitude: 5, speed: 2 m/s}")
    assert copter.wait(copter.outcome) == "SUCCESS", "\n".join(copter.texts())
    copter.wait(lambda: copter.modes[-1] == "BRAKE")
    copter.wait(lambda: copter.modes[-1] == "LAND" and not copter.armed)


@pytest.mark.heavy
def test_what_the_autopilot_refuses_ends_the_plan_with_its_reason(body):
    copter = body("autopilot-copter", "--unready")
    copter.ready()
    copter.start(SQUARE)
    assert copter.wait(copter.outcome) == "FAILURE", "\n".join(copter.texts())
    assert "arming was not carried out: PreArm: compass not calibrated" in "\n".join(copter.texts())


@pytest.mark.heavy
def test_foreigners_garbage_and_what_is_no_number_have_no_effect(body):
    copter = body("autopilot-copter")
    copter.ready()
    foreign = copter.stand_in("--system", "9", "--north", "5000", kind="rover")
    copter.start(SQUARE)
    for _ in range(20):
        copter.tell("garbage")
        copter.tell("nan")
        copter.tell("mode 4", foreign)
    assert copter.wait(copter.outcome) == "SUCCESS", "\n".join(copter.texts())
    states = copter.said[imc.EstimatedState]
    assert all(abs(place(state)[0]) < 60.0 and math.isfinite(state.phi + state.p) for state in states)
    assert all(word in copter.state("Autopilot") for word in ("damaged", "foreign", "unsound"))
