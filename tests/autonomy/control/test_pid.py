"""The controller with proportional, integral and derivative parts."""

import pytest

from autonomy.control import PID


def test_the_integral_is_that_of_the_steps_before():
    law = PID((2.0, 1.0, 0.5))
    assert law.step(0.1, 1.0, 0.2) == pytest.approx(2.1)
    assert law.step(0.1, 1.0, 0.0) == pytest.approx(2.1)
    assert (law.p, law.i, law.d) == (pytest.approx(2.0), pytest.approx(0.1), 0.0)


def test_the_integral_rests_at_the_limit_and_stays_within_its_own():
    law = PID((1.0, 1.0, 0.0), limit=0.5)
    for _ in range(100):
        assert law.step(0.1, 1.0) == 0.5
    assert law.step(0.1, -0.1) == pytest.approx(-0.1)
    bounded = PID((0.0, 1.0, 0.0), integral_limit=0.2)
    for _ in range(100):
        bounded.step(0.1, 1.0)
    assert bounded.step(0.1, 1.0) == pytest.approx(0.2)
