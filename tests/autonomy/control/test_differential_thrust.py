"""Thrust and turning on two motors."""

import math

import pytest

from autonomy.control import allocate_thrust, forces_to_actuations


def test_forces_are_shared_so_that_turning_comes_first():
    assert allocate_thrust(0.5, 0.2, 1.0, 0.6) == pytest.approx((0.7, 0.3))
    assert allocate_thrust(1.0, 0.4, 1.0, 0.6) == pytest.approx((1.0, 0.2))
    assert allocate_thrust(-0.6, -0.3, 1.0, 0.6) == pytest.approx((-0.6, 0.0))
    assert allocate_thrust(0.0, 2.0, 1.0, 0.6) == pytest.approx((1.0, -0.6))
    assert allocate_thrust(1.0, 0.4, 1.0, 0.6, turn_first=False) == pytest.approx((1.0, 0.6))


def test_actuations_give_the_forces_that_are_wanted():
    assert forces_to_actuations((0.25, -0.25), 0.5) == pytest.approx((0.5, -math.sqrt(0.5)))
    assert forces_to_actuations((0.0, -1.0), 0.5) == (0.0, -1.0)
