"""The way by a speed that is measured at other times than it is used at."""

import math

import pytest

from autonomy.navigation.speed_integral import SpeedIntegral


def test_the_way_does_not_depend_on_when_speeds_are_measured():
    speed, way = SpeedIntegral(), 0.0
    speed.add(0.0, 0.0)
    assert math.isnan(speed.take(0.0))
    for begin in range(20):
        for time in (begin + 0.1, begin + 0.25, begin + 0.95, begin + 1.0):
            speed.add(time, 2.0 * time)  # the way is the square of the time
        way += speed.take(begin + 0.97)
    assert way == pytest.approx(19.97**2, abs=1e-3)


def test_a_speed_that_is_held_too_long_is_corrected_by_the_next():
    speed = SpeedIntegral()
    speed.add(0.0, 1.0)
    speed.take(0.0)
    assert speed.take(0.8) == pytest.approx(0.8)
    speed.add(1.0, 0.0)
    assert speed.take(1.0) == pytest.approx(0.5 - 0.8)


def test_several_speeds_of_one_time_count_once():
    speed = SpeedIntegral()
    speed.add(0.0, 1.0)
    speed.take(0.0)
    for value in (5.0, 3.0):
        speed.add(0.5, value)
    speed.add(0.4, 100.0)
    assert speed.take(0.5) == pytest.approx(1.0)


@pytest.mark.parametrize("pause", [1.5, -1.5])
def test_the_way_over_a_time_without_speeds_is_unknown(pause):
    speed = SpeedIntegral()
    speed.add(10.0, 1.0)
    speed.take(10.0)
    assert math.isnan(speed.take(10.0 + pause))
    speed.add(10.0 + pause, 1.0)
    assert math.isnan(speed.take(10.0 + pause))
    assert speed.take(10.2 + pause) == pytest.approx(0.2)
    speed.skip()
    assert math.isnan(speed.take(10.3 + pause))
    speed.forget()
    assert math.isnan(speed.speed)
