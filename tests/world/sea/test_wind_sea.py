"""A sea of waves: its height, its derivatives, and how hulls ride on it."""

import math

import numpy as np
import pytest

from world import World
from world.sea import SeaState, WindSea

STEP = 1e-4  # m or s
POINT, BOAT, BARGE = (0.0, 0.0), (2.0, 1.08), (12.0, 5.0)
STILL = (0.0, 0.0, 0.0)


def sea(height=0.5, bearing=0.7, seed=3):
    return WindSea(SeaState(height), bearing, seed)


def spread(values):
    return float(np.std(values))


@pytest.mark.parametrize("height", [0.1, 0.5, 2.5])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_surface_has_the_significant_height(height, seed):
    """Hs is four standard deviations; half an hour has some hundred independent waves."""
    waves, scale = sea(height, seed=seed), math.sqrt(height / 0.5)
    heights = [waves.elevation(3.0, 4.0, scale * t) for t in np.arange(0.0, 1800.0, 0.7)]
    assert spread(heights) == pytest.approx(height / 4, rel=0.06)
    assert abs(np.mean(heights)) < 0.01 * height


def test_it_comes_from_its_bearing_with_the_peak_of_pierson_and_moskowitz():
    waves = sea(0.5, bearing=0.7)
    heading = np.arctan2(np.sin(waves.direction).sum(), np.cos(waves.direction).sum())
    assert (heading - (0.7 + math.pi) + math.pi) % math.tau - math.pi == pytest.approx(0.0, abs=0.1)
    energy, borders = np.histogram(waves.frequency, bins=np.arange(1.0, 4.0, 0.25))
    assert borders[energy.argmax()] == pytest.approx(0.4 * math.sqrt(9.80665 / 0.5), abs=0.3)


def test_slope_and_velocity_are_derivatives_of_its_height():
    waves, (n, e, t) = sea(), (12.0, -7.0, 31.0)
    north, east = waves.surface_slope(n, e, t)
    rise = {
        "north": (waves.elevation(n + STEP, e, t) - waves.elevation(n - STEP, e, t)) / (2 * STEP),
        "east": (waves.elevation(n, e + STEP, t) - waves.elevation(n, e - STEP, t)) / (2 * STEP),
        "down": -(waves.elevation(n, e, t + STEP) - waves.elevation(n, e, t - STEP)) / (2 * STEP),
    }
    assert (north, east) == pytest.approx((rise["north"], rise["east"]), abs=1e-6)
    assert waves.surface_orbital_velocity(n, e, t)[2] == pytest.approx(rise["down"], abs=1e-6)


def test_water_runs_downhill():
    """Of deep water, the acceleration at the surface is g times the slope."""
    waves = sea()
    before, after = (waves.surface_orbital_velocity(1.0, 2.0, 5.0 + s) for s in (-STEP, STEP))
    slope = waves.surface_slope(1.0, 2.0, 5.0)
    for number in (0, 1):
        assert (after[number] - before[number]) / (2 * STEP) == pytest.approx(-9.80665 * slope[number], abs=1e-5)


def test_a_small_boat_lies_in_the_surface_and_moves_with_the_water():
    waves = sea()
    ride = waves.hull_motion((1.0, 2.0), STILL, 0.4, 0.0, POINT, 9.0)
    north, east = waves.surface_slope(1.0, 2.0, 9.0)
    ahead = north * math.cos(0.4) + east * math.sin(0.4)
    starboard = east * math.cos(0.4) - north * math.sin(0.4)
    roll, pitch, yaw = ride.angles
    assert -ride.offset[2] == pytest.approx(waves.elevation(1.0, 2.0, 9.0), abs=1e-6)
    assert ride.velocity == pytest.approx(waves.surface_orbital_velocity(1.0, 2.0, 9.0), abs=1e-4)
    assert (math.tan(pitch), yaw) == (pytest.approx(ahead, abs=1e-4), 0.4)
    assert math.tan(roll) / math.cos(pitch) == pytest.approx(-starboard, abs=1e-4)


def test_a_hull_lies_in_the_plane_that_fits_best_under_it():
    waves, (length, beam), (n, e), heading = sea(), BARGE, (5.0, -3.0), 0.9
    x, y = np.meshgrid((np.arange(60) + 0.5) / 60 * length - length / 2, (np.arange(30) + 0.5) / 30 * beam - beam / 2)
    c, s = math.cos(heading), math.sin(heading)
    places = zip((n + c * x - s * y).ravel(), (e + s * x + c * y).ravel(), strict=True)
    heights = np.array([waves.elevation(*place, 20.0) for place in places]).reshape(x.shape)
    ride = waves.hull_motion((n, e), STILL, heading, 0.0, BARGE, 20.0)
    assert -ride.offset[2] == pytest.approx(heights.mean(), abs=1e-4)
    assert math.tan(ride.angles[1]) == pytest.approx(np.sum(heights * x) / np.sum(x * x), abs=1e-4)
    slope = -math.tan(ride.angles[0]) / math.cos(ride.angles[1])
    assert slope == pytest.approx(np.sum(heights * y) / np.sum(y * y), abs=1e-4)


def test_long_hulls_feel_less():
    waves = sea()
    heaves = [
        spread([waves.hull_motion((0.0, 0.0), STILL, 0.0, 0.0, size, t).offset[2] for t in np.arange(0.0, 300.0, 0.5)])
        for size in (POINT, BOAT, BARGE)
    ]
    assert heaves[0] > 1.03 * heaves[1] > 1.5 * heaves[2]


def test_velocities_and_rates_are_derivatives_under_way_and_in_a_turn():
    waves, velocity, turn = sea(), (1.2, -0.5, 0.0), 0.3

    def ride(late):
        place = 4.0 + late * velocity[0], 5.0 + late * velocity[1]
        return waves.hull_motion(place, velocity, 2.0 + late * turn, turn, BOAT, 17.0 + late)

    before, now, after = ride(-1e-3), ride(0.0), ride(1e-3)
    moved = [(b - a) / 2e-3 for a, b in zip(before.offset, after.offset, strict=True)]
    assert now.velocity == pytest.approx(moved, abs=1e-5)
    roll, pitch, yaw = ((b - a) / 2e-3 for a, b in zip(before.angles, after.angles, strict=True))
    p, q, r = now.rates
    phi, theta, _ = now.angles
    assert p == pytest.approx(roll - yaw * math.sin(theta), abs=1e-4)
    assert q == pytest.approx(pitch * math.cos(phi) + yaw * math.cos(theta) * math.sin(phi), abs=1e-4)
    assert r == pytest.approx(yaw * math.cos(theta) * math.cos(phi) - pitch * math.sin(phi), abs=1e-4)


def test_a_seed_is_a_sea_and_a_calm_one_moves_nothing():
    assert sea().elevation(1.0, 2.0, 3.0) == sea().elevation(1.0, 2.0, 3.0) != sea(seed=4).elevation(1.0, 2.0, 3.0)
    assert World(waves=SeaState(0.0), waves_move_boats=True).wind_sea(1) is None
    assert World().wind_sea(1) is None
