"""The plans of the documents, carried out by the stand-in for each kind of autopilot, both flavors where they exist."""

import math
import re
from pathlib import Path

import pytest

import imc
from support.wgs84 import displacement
from tests.repeats import repeat
from tests.tasks.control.autopilot.bodies import PATIENT

ROOT = Path(__file__).parents[4]
HOME = math.radians(41.185), math.radians(-8.7062)
OFFBOARD = "Control.Autopilot.MAVLink:PX4 Guidance=offboard"
MEMORY = "Control.Autopilot.MAVLink:Plans In Memory=true"


def documented(file, document):
    """A plan file in a document."""
    text = (ROOT / "docs" / document).read_text()
    found = re.search(rf"```yaml file={file}\.yaml\n(.*?)```", text, re.DOTALL)
    return found[1]


def corners(plan):
    """The ends of the legs of a plan: m north and east."""
    places = re.findall(r"goto: {north: (\d+)(?:, east: (\d+))?", plan)
    return [(float(north), float(east or 0.0)) for north, east in places]


def fly(body, profile, kind, plan, *options, reach=2.5, patience=720.0, **more):
    vehicle = body(profile, *options, kind=kind, **more)
    vehicle.ready()
    vehicle.start_file(plan)
    assert vehicle.wait(vehicle.outcome, patience) == "SUCCESS", "\n".join(vehicle.texts())
    places = [displacement(*HOME, 0.0, s.lat, s.lon, 0.0)[:2] for s in vehicle.said[imc.EstimatedState]]
    for corner in corners(plan):
        assert min(math.dist(corner, at) for at in places) < reach, (corner, vehicle.texts())
    assert not any("COMMAND" in text or "accepted" in text for text in vehicle.texts())
    return vehicle


HOP, SQUARE = documented("hop", "autopilot.md"), documented("square", "aerial.md")
HARBOR, TRIANGLE = documented("harbor", "surface.md"), documented("triangle", "mission.md")
SLOW = "--of-loss", "20"  # a busy computer sends late


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("kind", "plan", "more"),
    [
        ("px4", HOP, (OFFBOARD,)),
        repeat(("copter", HOP, ())),
        repeat(("px4", HOP, ())),
        ("copter", SQUARE, ()),
        repeat(("px4", SQUARE, ())),
        repeat(("px4", SQUARE, (OFFBOARD,))),
        ("copter", SQUARE, (MEMORY,)),
        # PX4 has no circles in the missions of copters
        ("px4", re.sub(r".*radius: 15.*\n", "", SQUARE), (MEMORY,)),
    ],
)
def test_a_copter_carries_out_the_plans_of_the_documents(body, kind, plan, more):
    copter = fly(body, "autopilot-copter", kind, plan, *SLOW, overrides=[*PATIENT, *more])
    assert not copter.armed
    assert ("OFFBOARD" in copter.modes) == (OFFBOARD in more)
    assert ({"AUTO", "MISSION"} & {*copter.modes} != set()) == (MEMORY in more)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("kind", "more"),
    [
        ("boat", ()),
        repeat(("boat", (MEMORY,))),
        repeat(("rover", ())),
        ("rover", (MEMORY,)),
        repeat(("px4-rover", ())),
        ("px4-rover", (OFFBOARD,)),
        ("px4-rover", (MEMORY,)),
        repeat(("px4-boat", ())),
    ],
)
def test_rovers_and_boats_carry_out_the_plan_of_the_boats(body, kind, more):
    fly(body, "autopilot-rover", kind, HARBOR, *SLOW, reach=4.5, overrides=[*PATIENT, *more])


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("kind", "more"),
    [
        repeat(("submarine", ())),
        ("submarine", (MEMORY,)),
        ("px4-submarine", ()),
    ],
)
def test_a_submarine_carries_out_the_triangle(body, kind, more):
    sub = fly(body, "autopilot-sub", kind, TRIANGLE, reach=3.0, overrides=[*PATIENT, *more])
    assert max(s.depth for s in sub.said[imc.EstimatedState]) == pytest.approx(2.0, abs=0.6)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("kind", "more"),
    [("plane", (MEMORY,)), ("px4-plane", ()), repeat(("plane", ())), repeat(("px4-plane", (MEMORY,)))],
)
def test_a_plane_carries_out_the_square_and_lands_against_the_wind(body, kind, more):
    plan = SQUARE.replace("speed: 5 m/s", "speed: 15 m/s").replace("40", "400")
    plane = fly(
        body, "autopilot-plane", kind, plan, "--wind", "-4", reach=85.0, patience=1440.0, overrides=[*PATIENT, *more]
    )
    assert not plane.armed
    last = plane.last(imc.EstimatedState)
    assert math.hypot(*displacement(*HOME, 0.0, last.lat, last.lon, 0.0)[:2]) < 150.0
    assert math.cos(last.psi) > 0.9  # the wind came from the north
