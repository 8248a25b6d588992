"""The filter of a boat's position, velocity and current."""

import math

import pytest

from autonomy.navigation.asv_filter import STREAM_EAST, STREAM_NORTH, ASVFilter, U


def test_a_filter_tells_its_own_way_from_the_current_when_it_turns():
    state = ASVFilter(1.0, 1.0, 0.25, (1e-3, 0.05, 1e-4), 2.0)
    for k in range(4000):
        psi = 0.005 * k
        state.predict(0.05, psi)
        if k % 20 == 0:
            state.measure_velocity(1.2 * math.cos(psi) + 0.4, 1.2 * math.sin(psi) - 0.1, psi, 0.01)
    assert (state.x[U], state.x[STREAM_NORTH], state.x[STREAM_EAST]) == pytest.approx((1.2, 0.4, -0.1), abs=0.03)
