"""The steering effort of a boat."""

import math

import pytest

import imc
from autonomy.control import HeadingController

YAW, YAW_RATE = imc.CLoopsMask.YAW, imc.CLoopsMask.YAW_RATE


def steered(rate_gains=(1.0, 0.0, 0.0), feedforward=0.0):
    return HeadingController((0.5, 0.0, 0.0), 0.2, rate_gains, feedforward)


def test_without_a_loop_nothing_is_done_and_without_a_reference_nothing_is_known():
    assert steered().effort(0, 0.0, 0.1, 0.05, 1.0) == 0.0
    assert steered().effort(YAW, 0.0, 0.1, 0.05, 1.0) is None
    assert steered().effort(YAW_RATE, 0.0, 0.1, 0.05, 1.0) is None


def test_headings_turn_the_short_way_at_a_limited_rate():
    law = steered()
    law.heading = math.radians(-175.0)
    assert law.error(math.radians(175.0)) == pytest.approx(math.radians(10.0))
    assert law.effort(YAW, math.radians(175.0), 0.0, 0.05, 1.0) == pytest.approx(0.5 * math.radians(10.0))
    assert law.effort(YAW, 0.0, 0.0, 0.05, 1.0) == pytest.approx(-0.2)
    assert law.effort(YAW, math.radians(-175.0), 0.0, 0.05, 1.0) == pytest.approx(0.0)


def test_a_rate_comes_before_a_heading():
    law = steered(feedforward=0.5)
    law.heading, law.desired_rate = 1.0, -0.1
    assert law.effort(YAW | YAW_RATE, 0.0, 0.0, 0.05, 1.0) == pytest.approx(-0.15)


def test_the_effort_is_limited_and_the_integral_rests_there():
    law = steered((1.0, 1.0, 0.0))
    law.desired_rate = 0.2
    for _ in range(200):
        assert law.effort(YAW_RATE, 0.0, -0.8, 0.1, 0.5) == 0.5
    assert law.i == 0.0
    for _ in range(200):
        effort = law.effort(YAW_RATE, 0.0, 0.1, 0.1, 0.5)
    assert effort == pytest.approx(0.5)
    law.reset()
    assert (law.heading, law.desired_rate, law.i) == (None, None, 0.0)


def test_turning_faster_is_damped():
    law = steered((0.0, 0.0, 2.0))
    law.desired_rate = 0.0
    law.effort(YAW_RATE, 0.0, 0.0, 0.1, 1.0)
    assert law.effort(YAW_RATE, 0.0, 0.01, 0.1, 1.0) == pytest.approx(-0.2)
    assert law.pid_parts.d == pytest.approx(-0.2)
