"""Whether an underwater vehicle is at sea."""

import math

import pytest

from autonomy.control import ImmersionDetector


def estimated(depth, altitude, seconds=60.0):
    """The detector after estimates of `depth` and `altitude` (m, of the time) at 4 Hz."""
    detector = ImmersionDetector()
    for tick in range(round(4 * seconds)):
        detector.record_estimate(0.25 * tick, depth(0.25 * tick), altitude(0.25 * tick))
    return detector


def test_a_vehicle_that_sinks_as_its_altitude_shows_is_at_sea():
    assert estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t).is_at_sea
    assert estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t if t > 20.0 else -1.0).is_at_sea
    assert not estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t, seconds=25.0).is_at_sea
    assert not estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t if t < 20.0 else -1.0).is_at_sea


@pytest.mark.parametrize("altitude", [-1.0, 0.0, 0.7, 30.0, math.nan])
@pytest.mark.parametrize("rate", [0.0, 0.04, -0.04, 0.08])
def test_a_depth_without_zero_that_no_altitude_follows_shows_a_bench(altitude, rate):
    assert not estimated(lambda t: rate * t, lambda t: altitude).is_at_sea
    assert not estimated(lambda t: rate * t, lambda t: altitude + t % 7.0).is_at_sea
    assert not estimated(lambda t: 1.5 * (t >= 10.0), lambda t: altitude).is_at_sea


@pytest.mark.parametrize("source", ["measured", "estimated"])
def test_a_depth_beyond_that_of_a_bench_shows_the_sea_after_a_second(source):
    detector = ImmersionDetector()

    def record(now, depth):
        if source == "measured":
            detector.record_depth(now, depth)
        else:
            detector.record_estimate(now, depth, -1.0)
        return detector.is_at_sea

    assert not any(record(0.25 * tick, 6.0 if tick == 8 else 4.9) for tick in range(40))
    assert not any(record(10.0 + 0.25 * tick, 5.1) for tick in range(4))
    assert record(11.0, 5.1)
    assert record(12.0, 0.0), "it stays so"


def test_a_depth_far_beyond_the_limit_is_that_of_a_broken_sensor():
    detector = ImmersionDetector(50.0)
    for tick in range(400):
        detector.record_depth(0.1 * tick, 100.0 if tick % 100 < 50 else 6000.0)
        detector.record_estimate(0.1 * tick, 100.0, 10.0)
    assert not detector.is_at_sea
    detector.record_depth(41.0, 59.0)
    detector.record_depth(42.0, 59.0)
    assert detector.is_at_sea
