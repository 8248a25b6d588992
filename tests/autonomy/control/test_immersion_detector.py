"""Whether an underwater vehicle is at sea."""

import math

import pytest

from autonomy.control import ImmersionDetector


def estimated(depth, altitude, seconds=60.0, sinking=lambda t: 0.0):
    """The detector after estimates of `depth` and `altitude` (m), and `sinking` (m/s), of the time, at 4 Hz."""
    detector = ImmersionDetector()
    for tick in range(round(4 * seconds)):
        now = 0.25 * tick
        detector.record_estimate(now, depth(now), altitude(now), sinking(now))
    return detector


def test_a_vehicle_that_sinks_as_its_altitude_shows_is_at_sea():
    assert estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t).is_at_sea
    assert estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t if t > 20.0 else -1.0).is_at_sea
    assert not estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t, seconds=25.0).is_at_sea
    assert not estimated(lambda t: 0.04 * t, lambda t: 10.0 - 0.04 * t if t < 20.0 else -1.0).is_at_sea


def surfaced(altitude, sinking, seconds=60.0):
    """Whether the vehicle is at sea by `altitude` (m) and `sinking` (m/s) of the time; its depth stays that of the
    surface."""
    return estimated(lambda t: 0.004, altitude, seconds, sinking).is_at_sea


def test_a_vehicle_whose_vertical_speed_and_altitude_show_that_it_sinks_is_at_sea_whatever_its_depth():
    assert surfaced(lambda t: 8.0 - 0.12 * t, lambda t: 0.11)
    assert not surfaced(lambda t: 8.0 - 0.12 * t, lambda t: 0.11, seconds=9.0)
    assert surfaced(lambda t: 8.0 - 0.12 * t, lambda t: 0.11 if t > 20.0 else math.nan)
    assert not surfaced(lambda t: 8.0 - 0.12 * t, lambda t: 0.0)
    assert not surfaced(lambda t: 3.0 + 0.04 * t, lambda t: -0.04), "it rises"


def carried(t):
    """Vertical speed of a vehicle that is carried: up, along, down, and stairs."""
    return (-0.3, 0.0, 0.3, 0.5)[int(t / 4.0) % 4] + 0.1 * math.sin(7.0 * t)


@pytest.mark.parametrize("sinking", [carried, lambda t: 0.1, lambda t: math.nan, lambda t: 1e6, lambda t: -0.2])
@pytest.mark.parametrize(
    "altitude",
    [
        lambda t: -1.0,
        lambda t: math.nan,
        lambda t: 0.7,
        lambda t: 0.0,
        lambda t: 7.0 * math.sin(97.0 * t) ** 2,
        lambda t: 0.4 + 0.3 * math.sin(31.0 * t),
    ],
)
def test_a_vehicle_that_is_carried_is_not_at_sea(sinking, altitude):
    assert not surfaced(altitude, sinking, seconds=600.0)


def test_no_way_is_summed_up_over_times_without_a_vertical_speed():
    altitudes = {0.0: 8.0, 0.25: 8.0, 10.0: 6.0, 11.5: 5.7, 11.75: 5.65}
    detector = ImmersionDetector()
    for now, altitude in altitudes.items():
        detector.record_estimate(now, 0.0, altitude, 0.2)
    assert not detector.is_at_sea


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
            detector.record_estimate(now, depth, -1.0, 0.0)
        return detector.is_at_sea

    assert not any(record(0.25 * tick, 6.0 if tick == 8 else 4.9) for tick in range(40))
    assert not any(record(10.0 + 0.25 * tick, 5.1) for tick in range(4))
    assert record(11.0, 5.1)
    assert record(12.0, 0.0), "it stays so"


def test_a_depth_far_beyond_the_limit_is_that_of_a_broken_sensor():
    detector = ImmersionDetector(50.0)
    for tick in range(400):
        detector.record_depth(0.1 * tick, 100.0 if tick % 100 < 50 else 6000.0)
        detector.record_estimate(0.1 * tick, 100.0, 10.0, 0.0)
    assert not detector.is_at_sea
    detector.record_depth(41.0, 59.0)
    detector.record_depth(42.0, 59.0)
    assert detector.is_at_sea
