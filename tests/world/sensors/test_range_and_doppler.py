"""Beams against bodies, compared with a fine walk along them, and velocities from several beams."""

import math

import numpy as np
import pytest

from runtime.profile import load_profile
from support.rotations import rotation, to_ned
from support.wgs84 import offset
from world import Waypoint, World, WorldObject, read_world
from world.sea import Bathymetry
from world.sensors import SonarBeam, distance_to_bottom, janus_directions, nearest_echo, velocity_from_beams

RANDOM = np.random.Generator(np.random.PCG64(7))
STILL = (0.0, 0.0, 0.0)


def walked(start, direction, middle, heading, length, diameter, reach=30.0, step=1e-3):
    """Where a walk along the beam first comes within the radius of the body's axis."""
    t = np.arange(0.0, reach, step)
    points = np.array(start) + t[:, None] * np.array(direction) - middle
    axis = np.array([math.cos(heading), math.sin(heading), 0.0])
    half = (length - diameter) / 2
    along = np.clip(points @ axis, -half, half)
    inside = np.linalg.norm(points - along[:, None] * axis, axis=1) <= diameter / 2
    return t[np.argmax(inside)] if inside.any() else math.inf


@pytest.mark.heavy
def test_a_beam_meets_a_body_where_a_walk_along_it_does():
    hits = 0
    for _ in range(300):
        start, middle = RANDOM.uniform(-8, 8, 3), RANDOM.uniform(-2, 2, 3)
        aim = middle + RANDOM.normal(0, 0.6, 3) - start
        direction = tuple(aim / np.linalg.norm(aim))
        heading, length, diameter = RANDOM.uniform(-4, 4), RANDOM.uniform(1.0, 5.0), RANDOM.uniform(0.2, 1.0)
        found = SonarBeam(tuple(start), direction).distance_to_capsule(tuple(middle), heading, length, diameter)
        expected = walked(start, direction, middle, heading, length, diameter)
        if expected == math.inf:  # or stepped over at an edge
            grazed = diameter / 2 < 1e-3 + _from_axis(start, direction, middle, heading)
            assert found == math.inf or found > 29.0 or grazed
        else:
            hits += 1
            assert found == pytest.approx(expected, abs=2.1e-3)
    assert hits > 80


def _from_axis(start, direction, middle, heading):
    """How far (m) a beam passes from the line of the axis."""
    axis = np.array([math.cos(heading), math.sin(heading), 0.0])
    normal = np.cross(direction, axis)
    return abs(float((np.array(start) - middle) @ normal)) / np.linalg.norm(normal)


@pytest.mark.parametrize(
    ("start", "direction", "expected"),
    [
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 3.0),  # along its axis
        ((5.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0),  # from inside
        ((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), math.inf),  # behind
        ((5.0, 3.0, 0.0), (0.0, -1.0, 0.0), 2.5),
    ],
)
def test_beams_at_a_body_of_four_meters(start, direction, expected):
    assert SonarBeam(start, direction).distance_to_capsule((5.0, 0.0, 0.0), 0.0, 4.0, 1.0) == pytest.approx(expected)


WORLD = World(
    seabed=Bathymetry([(0.0, 0.0, 20.0)], 1.0, 20.0),
    objects=(
        WorldObject(1, (Waypoint(0.0, 0.0, 0.0), Waypoint(10.0, 5.0, 0.0)), depth=10.0, heading=0.0),
        WorldObject(2, (Waypoint(0.0, 30.0, 0.0),)),
    ),
    walls=(((-5.0, 8.0), (5.0, 8.0)),),
)
UP, DOWN, EAST = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("start", "direction", "what", "distance"),
    [
        ((1.0, 3.0, 5.0), UP, "surface", 5.0),
        ((1.0, 3.0, 5.0), DOWN, "bottom", 15.0),
        ((1.0, 3.0, 5.0), EAST, "wall", 5.0),
        ((1.0, 0.0, 5.0), DOWN, "Glider 1", 5.0 - 0.08),
        ((30.0, 0.0, 15.0), DOWN, "Glider 2", 5.0 - 0.08),
    ],
)
def test_the_nearest_is_received(start, direction, what, distance):
    echo = nearest_echo(WORLD, SonarBeam(start, direction), 2.0, (0.3, 0.0, 0.0), 0.0, 100.0)
    assert (echo.source, echo.distance) == (what, pytest.approx(distance))
    moved = {"surface": 0.3, "Glider 1": 0.5}
    assert echo.velocity[0] == pytest.approx(moved.get(what, 0.0))


def test_what_is_too_far_too_near_or_out_of_the_water():
    def heard(start, direction, blanking=0.0, reach=100.0):
        return nearest_echo(WORLD, SonarBeam(start, direction), 2.0, STILL, blanking, reach)

    assert heard((1.0, 3.0, 5.0), DOWN, reach=14.9) is None
    assert heard((1.0, 3.0, 5.0), DOWN, reach=15.1) is not None
    assert heard((1.0, 0.0, 9.0), DOWN, blanking=1.0) is None, "the glider hides the bottom"
    assert heard((1.0, 3.0, -1.0), DOWN) is None
    assert nearest_echo(World(), SonarBeam((0.0, 0.0, 3.0), EAST), 0.0, STILL, 0.0, 100.0) is None


def test_beams_tell_the_velocity():
    directions, velocity = janus_directions(math.radians(30.0)), (1.5, -0.3, 0.2)
    speeds = [float(np.dot(direction, velocity)) for direction in directions]
    assert [math.hypot(*direction) for direction in directions] == pytest.approx([1.0] * 4)
    assert [direction[2] for direction in directions] == pytest.approx([math.cos(math.radians(30.0))] * 4)
    for left_out in range(4):
        some = [n for n in range(4) if n != left_out]
        assert velocity_from_beams([directions[n] for n in some], [speeds[n] for n in some]) == pytest.approx(velocity)
    assert velocity_from_beams(directions, speeds) == pytest.approx(velocity)
    assert velocity_from_beams(directions[:2], speeds[:2]) is None
    assert velocity_from_beams([directions[0]] * 3, [1.0] * 3) is None


@pytest.mark.heavy
def test_a_beam_without_a_limit_hears_the_bottom_of_a_shipped_vehicle():
    """Against a walk along the beam in steps of 5 cm, over soundings in a sea that is 120 m deep elsewhere."""
    seabed = read_world(load_profile("lauv-noptilus-1").value, offset).seabed
    random = np.random.default_rng(2)
    for north, east, share, heading in random.random((60, 4)) * (250.0, 250.0, 0.6, 2.0 * math.pi) - (100, 100, 0, 0):
        down = (0.2 + share) * min(seabed.depth(north, east), 20.0)
        direction = to_ned(rotation(0.0, 0.0, heading), janus_directions(math.radians(30.0))[0])
        beam = SonarBeam((north, east, down), direction)
        steps = (0.05 * k for k in range(3000))
        hits = (t for t in steps if seabed.depth(*at(beam, t)[:2]) <= at(beam, t)[2])
        assert distance_to_bottom(beam, seabed, 1000.0) == pytest.approx(next(hits, math.inf), abs=0.06)


def at(beam, distance):
    return tuple(start + distance * part for start, part in zip(beam.start, beam.direction, strict=True))


@pytest.mark.parametrize("reach", [40.0, 80.0, 1000.0])
@pytest.mark.parametrize("tilt", [30.0, 60.0, 89.0])
def test_a_beam_does_not_pass_through_a_ridge(reach, tilt):
    places = [(north, east) for north in range(-50, 51, 2) for east in range(-10, 11, 2)]
    seabed = Bathymetry([(n, e, 12.0 if 18 <= n <= 22 else 30.0) for n, e in places], 4.0, 30.0)
    down = 15.0 if tilt == 89.0 else 18.0 - 18.0 / math.tan(math.radians(tilt)) - 2.0
    beam = SonarBeam((0.0, 0.0, down), (math.sin(math.radians(tilt)), 0.0, math.cos(math.radians(tilt))))
    expected = next(0.01 * k for k in range(4000) if seabed.depth(*at(beam, 0.01 * k)[:2]) <= at(beam, 0.01 * k)[2])
    assert distance_to_bottom(beam, seabed, reach) == pytest.approx(expected, abs=0.03)
