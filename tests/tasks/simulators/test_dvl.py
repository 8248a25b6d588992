"""The beams of a DVL hear bottom, surface, walls and gliders; its place and axes count."""

import math
from itertools import pairwise

import pytest

import imc
from runtime import ParameterError
from runtime.testing import simulate
from support.rotations import rotation, to_body
from tasks.simulators.dvl import DVL

LAT, LON = math.radians(41.185), math.radians(-8.7062)
QUIET = {"ground_noise": 0.0, "water_noise": 0.0, "invalid_reading_probability": 0.0}
BOTTOM = {"Latitude (degrees)": "41.185", "Longitude (degrees)": "-8.7062", "Data": "0 0 20"}
MOVING = {"x": 0.0, "y": 0.0, "z": 5.0, "phi": 0.1, "theta": -0.05, "psi": 0.7, "u": 1.2, "v": -0.1, "w": 0.05}


def measured(world=None, seconds=2.0, truth=MOVING, **options):
    settings = {
        "Bathymetry": BOTTOM,
        "World": {"Gliders": "none", "Sounding Radius": "1", "Out Of Bounds Depth": "20", **(world or {})},
    }
    feed = [
        imc.SimulatedState(timestamp=0.05 * k, lat=LAT, lon=LON, svx=0.4, **truth) for k in range(round(seconds * 20))
    ]
    return simulate(DVL, feed, settings=settings, entity_label="DVL", **{**QUIET, **options})


def over_ground(run):
    last = run.of(imc.GroundVelocity)[-1]
    return last.x, last.y, last.z


def beams(run):
    """The last distance of each beam, None without an echo, and what it hears."""
    found = []
    for number in range(1, 5):
        entity = run.vehicle.entities.find(f"DVL Beam {number}")
        last = [m for m in run.of(imc.Distance) if m.src_ent == entity.id][-1]
        found.append((last.value if last.validity else None, entity.description))
    return found


def true_velocity(truth=MOVING):
    current = to_body(rotation(truth["phi"], truth["theta"], truth["psi"]), (0.4, 0.0, 0.0))
    return tuple(truth[axis] + part for axis, part in zip("uvw", current, strict=True))


def test_four_beams_tell_what_the_ideal_device_does():
    run, ideal = measured(beams=4), measured()
    assert over_ground(run) == pytest.approx(true_velocity(), abs=1e-6)
    assert over_ground(run) == pytest.approx(over_ground(ideal), abs=1e-6)
    assert [what for _, what in beams(run)] == ["bottom"] * 4
    level = measured(beams=4, truth={**MOVING, "phi": 0.0, "theta": 0.0})
    assert [distance for distance, _ in beams(level)] == pytest.approx([15.0 / math.cos(math.radians(30.0))] * 4)
    assert not [m for m in ideal.of(imc.Distance)]


def test_beams_have_ranges():
    deep = measured(beams=4, bottom_range=10.0)
    assert beams(deep) == [(None, "no echo")] * 4
    assert deep.of(imc.GroundVelocity)[-1].validity == 0
    assert deep.of(imc.WaterVelocity)[-1].validity == 7
    shallow = measured(beams=4, bottom_range=50.0, blanking_distance=20.0)
    assert beams(shallow) == [(None, "no echo")] * 4
    # Rolled by 20°, the beams to one side reach the bottom, those to the other do not.
    rolled = {**MOVING, "phi": 0.35, "theta": 0.0}
    two = measured(beams=4, bottom_range=18.0, truth=rolled)
    assert sorted(what for _, what in beams(two)) == ["bottom", "bottom", "no echo", "no echo"]
    assert two.of(imc.GroundVelocity)[-1].validity == 0


def test_a_wall_is_received_instead_of_the_bottom():
    level = {**MOVING, "phi": 0.0, "theta": 0.0, "psi": 0.0}
    run = measured({"Walls": "-100 3 100 3, 500 500 600 600"}, beams=4, truth=level)
    heard = beams(run)
    assert [what for _, what in heard] == ["wall", "wall", "bottom", "bottom"]
    assert heard[0][0] == pytest.approx(3.0 / (math.sin(math.radians(30.0)) * math.sqrt(0.5)))
    assert over_ground(run) == pytest.approx(true_velocity(level), abs=1e-6)


def test_a_device_that_looks_up_measures_against_the_surface():
    run = measured(beams=4, device_orientation=[180.0, 0.0, 0.0])
    assert [what for _, what in beams(run)] == ["surface"] * 4
    # The surface drifts with the water; the device's y and z point to port and up.
    assert over_ground(run) == pytest.approx((1.2, 0.1, -0.05), abs=1e-6)


def test_a_glider_in_a_beam_is_received_and_its_motion_misleads():
    level = {**MOVING, "phi": 0.0, "theta": 0.0, "psi": 0.0}
    across = 5.0 * math.tan(math.radians(30.0)) * math.sqrt(0.5)
    glider = {"Objects": "Whale", "Gliders": "none"}
    settings = {"Position": f"{across} {across}", "Lies On": "Depth", "Depth": "10", "Length": "1", "Diameter": "0.5"}
    still = measured_with(glider, settings, level)
    assert beams(still)[0][1] == "Glider 1"
    assert beams(still)[0][0] == pytest.approx(5.0 / math.cos(math.radians(30.0)), abs=0.5)
    assert over_ground(still) == pytest.approx(true_velocity(level), abs=1e-6)
    del settings["Position"]
    track = f"0 {across - 2.0} {across}, 4 {across + 2.0} {across}"
    moving = measured_with(glider, {**settings, "Track": track}, level)
    assert beams(moving)[0][1] == "Glider 1"
    assert abs(over_ground(moving)[0] - true_velocity(level)[0]) > 0.1


def measured_with(world, thing, truth):
    settings = {
        "Bathymetry": BOTTOM,
        "World": {"Sounding Radius": "1", "Out Of Bounds Depth": "20", **world},
        "World/Whale": thing,
    }
    feed = [imc.SimulatedState(timestamp=0.05 * k, lat=LAT, lon=LON, svx=0.4, **truth) for k in range(42)]
    return simulate(DVL, feed, settings=settings, entity_label="DVL", beams=4, **QUIET)


def test_the_place_and_axes_of_the_device_count():
    turning = {**MOVING, "q": 0.2, "r": 0.5}
    at_bow = measured(truth=turning, device_position=[2.0, 0.0, 0.0])
    u, v, w = true_velocity()
    assert over_ground(at_bow) == pytest.approx((u, v + 1.0, w - 0.4), abs=1e-6)
    water = at_bow.of(imc.WaterVelocity)[-1]
    assert (water.x, water.y, water.z) == pytest.approx((1.2, 0.9, -0.35), abs=1e-6)
    turned = measured(device_orientation=[0.0, 0.0, 45.0], beams=4)
    c = math.sqrt(0.5)
    assert over_ground(turned) == pytest.approx((c * (u + v), c * (v - u), w), abs=1e-6)


def test_a_tilted_device_looks_for_the_bottom_where_it_points():
    level = {**MOVING, "phi": 0.0, "theta": 0.0}
    assert measured(truth=level, bottom_range=15.5).of(imc.GroundVelocity)[-1].validity == 7
    tilted = measured(truth=level, bottom_range=15.5, device_orientation=[20.0, 0.0, 0.0])
    assert tilted.of(imc.GroundVelocity)[-1].validity == 0
    lowered = measured(truth=level, bottom_range=15.5, blanking_distance=14.8, device_position=[0.0, 0.0, 0.5])
    assert lowered.of(imc.GroundVelocity)[-1].validity == 0


def test_distances_have_the_noise_that_is_reported():
    run = measured(beams=4, beam_noise=0.1, seconds=60.0)
    values = [m.value for m in run.of(imc.Distance)]
    first = values[::4]
    mean = math.fsum(first) / len(first)
    assert math.sqrt(math.fsum((v - mean) ** 2 for v in first) / len(first)) == pytest.approx(0.1, rel=0.2)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"device_position": [1.0]}, "1 numbers instead of three"),
        ({"device_orientation": [1.0, 2.0]}, "2 numbers instead of three"),
        ({"beams": 3}, "Beams"),
    ],
)
def test_impossible_options(options, said):
    with pytest.raises(ParameterError, match=said):
        measured(**options)


@pytest.mark.parametrize("walls", ["1 2 3", "1 2 1 2", "a b c d", "0 0 1 nan"])
def test_walls_that_are_none_are_named(walls):
    with pytest.raises(ParameterError, match=r"\[World\] Walls = .* is not north and east of both ends"):
        measured({"Walls": walls})


def test_there_is_no_velocity_without_a_recent_state():
    feed = [imc.SimulatedState(timestamp=0.05 * k, lat=LAT, lon=LON, **MOVING) for k in (*range(20), *range(160, 200))]
    settings = {"Bathymetry": BOTTOM, "World": {"Gliders": "none", "Out Of Bounds Depth": "20"}}
    run = simulate(DVL, feed, settings=settings, seconds=10.0, beams=4, **QUIET)
    for kind in (imc.GroundVelocity, imc.WaterVelocity, imc.Distance):
        times = [message.timestamp for message in run.of(kind)]
        assert max(after - before for before, after in pairwise(times)) > 6.0
    said = [(m.state, m.description) for m in run.of(imc.EntityState)]
    assert (imc.EntityState.State.FAULT, "no recent SimulatedState") in said
    assert run.task.entity.state == imc.EntityState.State.NORMAL
