"""When the motor has to bring up a vehicle whose depth is, by mistake, that of the surface."""

import math

from autonomy.control import AscentMonitor
from tests.autonomy.control.test_powered_ascent import watch


def climb(monitor, bottom, drift, seconds, *, unfixed=True, sinks=0.1):
    """Shares of the thrust of a vehicle that starts at a depth (m) and climbs with its motor, else `sinks` (m/s).

    Its depth sensor is at the surface, and drifts (m/s). Also the least true depth (m).
    """
    true, least, shares = bottom, bottom, []
    for tick in range(round(4 * seconds)):
        monitor.update(100.0 + 0.25 * tick, true - bottom + drift * 0.25 * tick, False, unfixed)
        shares.append(monitor.share if monitor.helping else 0.0)
        true = max(0.0, true + 0.25 * (sinks - 0.5 * shares[-1]))
        least = min(least, true)
    return shares, least


def test_a_heavy_vehicle_without_a_fix_at_its_surface_climbs_on():
    def heavy():
        monitor = watch(lambda t: 10.0, 21.0)
        assert monitor.helping
        return monitor

    _, least = climb(heavy(), 10.0, -0.06, 60.0)
    assert least == 0.0
    shares, least = climb(heavy(), 10.0, -0.06, 60.0, unfixed=False)
    assert least > 9.0
    assert max(shares) < 0.5
    shares, _ = climb(heavy(), 0.3, 0.0, 60.0)
    assert shares.count(1.0) <= 4 * 16, "it is at the surface indeed"


def test_a_vehicle_above_the_surface_without_a_fix_climbs_on_until_that_changes_nothing():
    shares, least = climb(AscentMonitor(0.3, 20.0), 10.0, -0.15, 150.0)
    assert least == 0.0
    assert not any(shares[: 4 * 60]), "it may be on its way up by itself"
    shares, _ = climb(AscentMonitor(0.3, 20.0), 0.0, -0.15, 300.0, sinks=-0.1)
    assert shares.count(1.0) <= 4 * 16
    assert not climb(AscentMonitor(0.3, 20.0), 10.0, -0.15, 60.0, unfixed=False)[0].count(1.0)


def sinks_unseen(speed, jumped, seconds=200.0):
    """True depths from 5 m on of a vehicle whose depth is that of the surface, and that sinks by a speed (m/s)."""
    monitor, true, depths = AscentMonitor(0.3, 20.0), 5.0, []
    monitor.reset(0.0)
    for tick in range(round(4 * seconds)):
        rising, fixed = 0.45 if monitor.helping else -speed, true < 0.1
        monitor.update(0.25 * tick, 0.005, fixed, not fixed, rising, jumped)
        true = max(0.0, true - 0.25 * rising)
        depths.append(true)
    return depths, monitor


def test_a_vehicle_that_sinks_by_its_vertical_speed_climbs_although_its_depth_is_that_of_the_surface():
    depths, monitor = sinks_unseen(0.035, 0.0)
    assert max(depths) < 9.0
    assert min(depths) == 0.0
    assert monitor.heavy
    for error in (0.0, 0.001, 0.005):
        _, monitor = sinks_unseen(error, 0.0, 3600.0)
        assert not monitor.heavy, "it may be at the surface, and its vertical speed wrong"
        assert not monitor.helping


def climbs_slowly(speed, bottom=8.0):
    """True depths of a vehicle on the bottom (m) that its motor lifts by a speed (m/s), and whose depth has jumped."""
    monitor, true, depths = AscentMonitor(0.3, 20.0), bottom, []
    monitor.reset(0.0)
    for tick in range(4 * 200):
        rising = 0.19 if monitor.helping else -0.12
        monitor.update(0.25 * tick, 0.005, true < 0.1, true > 0.1, rising, 6.8)
        monitor.watch_bottom(0.25 * tick, bottom - true, 0.0, rising)
        true = min(bottom, max(0.0, true - 0.25 * (speed if monitor.helping else -0.12)))
        depths.append(true)
    return depths, monitor


def test_a_climb_that_altitude_and_vertical_speed_show_continues_although_it_is_slow():
    depths, monitor = climbs_slowly(0.19)
    assert max(depths[4 * 70 :]) < 1.0, "it comes up, and is kept there"
    assert monitor.heavy
    _, monitor = climbs_slowly(0.0)
    assert not monitor.heavy, "only the vertical speed shows it"


def test_a_heavy_vehicle_whose_depth_is_that_of_the_surface_is_kept_up_as_soon_as_it_sinks():
    depths, monitor = sinks_unseen(0.1, 0.0)
    assert monitor.heavy
    assert max(depths[4 * 60 :]) < 0.7, "without a fix and 0.3 m down it needs no other sign"


def test_a_climb_does_not_end_for_the_noise_of_a_depth_near_that_of_the_surface():
    monitor, true, driven = AscentMonitor(0.3, 20.0), 5.0, []
    monitor.reset(0.0)
    for tick in range(4 * 60):
        rising = 0.45 if monitor.helping else -0.035
        monitor.update(0.25 * tick, 0.1 + 0.1 * math.sin(tick), False, True, rising)
        true -= 0.25 * rising
        driven.append(monitor.helping)
    assert true < 1.0
    assert all(driven[driven.index(True) :])


def test_a_vehicle_whose_depth_has_jumped_to_the_surface_climbs():
    depths, _ = sinks_unseen(0.0, 5.0)
    assert depths[-1] < 0.1
    monitor = AscentMonitor(0.3, 20.0)
    monitor.reset(0.0)
    driven = []
    for tick in range(1200):
        monitor.update(0.25 * tick, 0.005, False, True, 0.0, 5.0)
        driven.append(monitor.helping)
    assert not any(driven[:240]), "it may rise by itself"
    assert sum(driven) <= 4 * 16, "it is at the surface indeed, where GPS is silent"


def test_a_vertical_speed_that_contradicts_gps_does_not_let_it_climb_for_ever():
    """With a wrong pitch the vehicle dives, and its vertical speed, computed with that pitch, says that it climbs."""
    monitor = AscentMonitor(0.3, 20.0)
    monitor.reset(0.0)
    driven, judged = [], []
    for tick in range(1200):
        monitor.update(0.25 * tick, 0.005, False, True, 0.45, 5.0)
        driven.append(monitor.helping)
        judged.append(monitor.pitch_faulty)
    begins = driven.index(True)
    assert judged.index(True) - begins < 4 * 31, "then the fins follow the depth"
    assert not all(driven[begins : begins + 4 * 62])
