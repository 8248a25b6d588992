"""A position that moves against the velocity of its own receiver."""

import math

import numpy as np
import pytest

import imc
from autonomy.navigation import GnssVelocityCheck, ground_velocity

ALL = 0x1FF


def checked(*, sigma=0.6, drift=0.0, jump=0.0, scale=1.0, seconds=120.0, seed=0, velocity=True):
    """Circles at 4 m/s with fixes at 5 Hz with noise, a drift (m/s) from 30 s on and a jump (m) at 60 s."""
    check, noise, found = GnssVelocityCheck(), np.random.default_rng(seed), math.inf
    for step in range(round(5 * seconds)):
        t = 0.2 * step
        off = drift * max(0.0, t - 30.0) + jump * (t > 60.0)
        north, east = 20.0 * math.sin(0.2 * t), 20.0 * math.cos(0.2 * t)
        speed = scale * 4.0 * math.cos(0.2 * t), -scale * 4.0 * math.sin(0.2 * t)
        dn, de = sigma * noise.standard_normal(2)
        check.update(t, north + dn + off, east + de, sigma, speed if velocity else None)
        found = min(found, t - 30.0) if check.faulty else found
    return check, found, (north, east)


@pytest.mark.parametrize("drift", [0.3, 0.6, -3.2])
def test_a_drift_is_found_and_the_velocity_goes_on(drift):
    check, found, true = checked(drift=drift)
    assert 0.0 < found * abs(drift) < 12.0
    assert math.dist(check.reckoned, true) < 12.0


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("case", [{}, {"sigma": 1.5}, {"jump": 200.0}, {"velocity": False, "drift": 3.0}])
def test_noise_a_jump_or_a_receiver_without_velocity_is_no_drift(case, seed):
    assert checked(seed=seed, **case)[1] == math.inf


def test_a_velocity_in_other_units_is_found_too():
    assert checked(scale=0.3048)[1] < math.inf


def test_a_velocity_is_used_only_if_it_is_valid():
    fix = imc.GpsFix(validity=ALL, sog=2.0, cog=0.5 * math.pi)
    assert ground_velocity(fix) == pytest.approx((0.0, 2.0))
    speed_only = ALL & ~imc.GpsFix.Validity.VALID_COG
    for odd in ({"validity": speed_only}, {"sog": -1.0}, {"sog": 1e6}, {"sog": math.nan}, {"cog": math.inf}):
        assert ground_velocity(fix.replace(**odd)) is None
