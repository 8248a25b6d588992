"""Torques on four fins."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autonomy.control import allocate_fins, fin_torques

EFFECTS = (0.25, 0.5, 0.5)
LIMIT = math.radians(25.0)
SMALL = st.floats(-0.05, 0.05)
ANY = st.floats(-10.0, 10.0)


@given(SMALL, SMALL, SMALL)
def test_small_torques_are_what_the_fins_give(k, m, n):
    assert fin_torques(allocate_fins((k, m, n), EFFECTS, LIMIT), EFFECTS) == pytest.approx((k, m, n), abs=1e-12)


@given(ANY, ANY, ANY, st.sampled_from([0.0, 0.8 * LIMIT]))
def test_no_fin_goes_beyond_its_limit_and_pitch_and_yaw_come_first(k, m, n, crossed):
    fins = allocate_fins((k, m, n), EFFECTS, LIMIT, crossed)
    assert all(abs(fin) <= LIMIT + 1e-12 for fin in fins)
    _, pitch, yaw = fin_torques(fins, EFFECTS)
    free = LIMIT - crossed
    assert pitch == pytest.approx(max(-free, min(free, m)), abs=1e-12)
    assert yaw == pytest.approx(0.0 if crossed else max(-free, min(free, n)), abs=1e-12)


def test_a_brake_crosses_the_fins_without_any_torque():
    fins = allocate_fins((0.0, 0.0, 0.0), EFFECTS, LIMIT, 0.8 * LIMIT)
    assert {round(abs(fin), 12) for fin in fins} == {round(0.8 * LIMIT, 12)}
    assert fin_torques(fins, EFFECTS) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
