"""The vehicle's own magnetic field, found while it turns."""

import math
import random

import pytest

from autonomy.navigation import HardIronError, HardIronFit
from support.rotations import rotation

EARTH = (0.26, -0.01, 0.37)  # G, off Porto
OWN = (0.05, -0.08, 0.03)  # G


def field(roll, pitch, heading, own=OWN):
    """What a magnetometer measures (G, body frame)."""
    r = rotation(roll, pitch, heading)
    x, y, z = (sum(r[k][i] * EARTH[k] for k in range(3)) + own[i] for i in range(3))
    return x, y, z


def turned(turns=2.0, noise=0.0, pitch=0.0, samples=400):
    fit, chance = HardIronFit(), random.Random(1)
    for k in range(samples):
        heading = math.tau * turns * k / samples
        tilt = pitch * math.sin(7.0 * heading)
        x, y, z = field(0.02, tilt, heading)
        measured = (x + chance.gauss(0.0, noise), y + chance.gauss(0.0, noise), z + chance.gauss(0.0, noise))
        fit.add(measured, 0.02, tilt, heading)
    return fit


def test_level_turns_give_the_horizontal_part():
    found = turned().solve()
    assert (found.x, found.y) == (pytest.approx(OWN[0], abs=2e-3), pytest.approx(OWN[1], abs=2e-3))
    assert found.earth == pytest.approx(math.hypot(EARTH[0], EARTH[1]), abs=2e-3)
    assert found.misfit < 1e-3


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e30, 1e300, -50.0])
def test_a_sample_that_is_no_field_does_not_spoil_the_others(bad):
    fit = turned()
    for place in range(3):
        x, y, z = (bad if k == place else 0.2 for k in range(3))
        fit.add((x, y, z), 0.0, 0.0, 1.0)
    assert fit.solve() == turned().solve()


def test_noise_and_a_zigzag_of_15_degrees_cost_little():
    found = turned(noise=0.005, pitch=math.radians(15.0)).solve()
    assert math.hypot(found.x - OWN[0], found.y - OWN[1]) < 0.01


@pytest.mark.parametrize(
    ("fit", "reason"),
    [
        (turned(samples=10), "10 samples of the magnetic field are too few"),
        (turned(turns=0.4), "do not go round the circle"),
        (turned(noise=2.0), "off a circle|not a circle"),
    ],
)
def test_samples_that_do_not_tell_it_are_rejected(fit, reason):
    with pytest.raises(HardIronError, match=reason):
        fit.solve()


def test_a_constant_field_is_rejected():
    fit = HardIronFit()
    for k in range(100):
        fit.add((0.2, 0.1, 0.3), 0.0, 0.0, 0.1 * k)
    with pytest.raises(HardIronError):
        fit.solve()


def test_values_that_are_not_numbers_do_not_count():
    fit = turned()
    before = fit.solve()
    fit.add((math.nan, 0.0, 0.0), 0.0, 0.0, 0.0)
    fit.add((0.1, 0.0, 0.0), math.inf, 0.0, 0.0)
    assert fit.solve() == before
