"""Limits of altitude and speed of a multirotor."""

import math

import pytest

import imc
from autonomy.guidance import MultirotorLimits, ground_z

Bits = imc.OpLimitsMask
STATE = imc.EstimatedState(z=-10.0, alt=12.0)  # the ground is 2 m below the reference


def test_heights_stay_between_the_limits():
    limits = MultirotorLimits(lowest=5.0, highest=30.0)
    assert ground_z(STATE) == 2.0
    assert [limits.limit_height(down, STATE, 0.5) for down in (-50.0, -10.0, 0.0)] == [-27.5, -10.0, -3.5]
    assert MultirotorLimits().limit_height(-1e4, STATE, 0.5) == -1e4


def test_limits_of_a_message_are_taken_or_none():
    message = imc.OperationalLimits(mask=Bits.MAX_ALT | Bits.MAX_SPEED, max_altitude=30.0, max_speed=4.0)
    assert MultirotorLimits.from_message(message) == MultirotorLimits(0.0, 30.0, 4.0)


@pytest.mark.parametrize("value", [-1.0, math.nan])
def test_limits_that_are_none_are_refused(value):
    assert MultirotorLimits.from_message(imc.OperationalLimits(mask=Bits.MAX_ALT, max_altitude=value)) is None
