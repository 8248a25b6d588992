"""When the motor has to bring a vehicle up, and what the fins do."""

import math

import pytest

from autonomy.control import AscentMonitor, ascent_fins, blind_ascent_fins, fin_torques

EFFECTS = 0.25, 0.5, 0.5


def watch(depth, seconds, monitor=None, surfaced=False, begin=0.0):
    """A monitor after a time in which `depth` (m, of the time) was measured at 4 Hz."""
    monitor = monitor or AscentMonitor(0.3, 20.0)
    if begin == 0.0:
        monitor.reset(0.0)
    for tick in range(round(4 * seconds)):
        now = begin + 0.25 * tick
        monitor.update(now, depth(now), surfaced)
    return monitor


def test_a_vehicle_that_rises_or_floats_gets_no_help():
    assert not watch(lambda t: 10.0 - 0.03 * t, 300.0).heavy
    assert not watch(lambda t: 10.0 + min(t, 4.0) * 0.4 - 0.05 * t, 100.0).heavy, "it was diving"
    assert not watch(lambda t: 10.0 + 3.0 * (1.0 - math.exp(-t / 5.0)) - 0.06 * t, 100.0).heavy, "it was diving fast"
    assert not watch(lambda t: 0.2 + 0.3 * math.sin(t), 300.0).heavy, "waves"
    assert not watch(lambda t: 4.0, 100.0, surfaced=True).heavy, "the depth is wrong"


def test_a_vehicle_that_does_not_rise_gets_help_until_it_is_at_the_surface_and_again_when_it_sinks():
    monitor = watch(lambda t: 10.0, 20.0)
    assert not monitor.helping
    monitor = watch(lambda t: 10.0, 2.0, monitor, begin=20.0)
    assert monitor.helping
    assert monitor.share == 1.0
    monitor = watch(lambda t: max(0.0, 10.0 - 0.3 * (t - 22.0)), 40.0, monitor, begin=22.0)
    assert not monitor.helping
    assert monitor.heavy
    monitor = watch(lambda t: 0.35, 1.0, monitor, begin=62.0)
    assert monitor.helping
    assert monitor.share < 0.5
    assert not watch(lambda t: 0.1, 130.0, monitor, begin=63.0).heavy, "it floats again"


def test_a_vehicle_that_rises_by_less_than_half_a_meter_in_that_time_gets_help():
    assert watch(lambda t: 10.0 - 0.02 * t, 25.0).helping
    assert not watch(lambda t: 10.0 - 0.03 * t, 25.0).helping


def test_a_vehicle_whose_depth_alone_rises_gets_help():
    def helped(depth, rising, altitude=lambda t: -1.0):
        monitor = AscentMonitor(0.3, 20.0)
        monitor.reset(0.0)
        for tick in range(100):
            monitor.watch_bottom(0.25 * tick, altitude(0.25 * tick), 0.0, rising or 0.0)
            monitor.update(0.25 * tick, 30.0 - depth * 0.25 * tick, False, False, rising)
        return monitor.helping

    assert helped(0.027, 0.008), "the depth is in feet"
    assert not helped(0.06, 0.06)
    assert not helped(0.06, None), "no vertical speed is known"
    assert helped(0.0, 0.06)
    assert not helped(0.06, 0.01, lambda t: 5.0 + 0.05 * t), "the altitude shows it, and the speed is wrong"
    assert helped(0.027, 0.008, lambda t: 5.0 + 0.008 * t)
    assert helped(0.06, 0.01, lambda t: 5.0 + 0.05 * t if t < 6.0 else -1.0), "the bottom is no longer seen"


def test_help_that_brings_nothing_goes_astern_and_then_pauses():
    monitor = watch(lambda t: 10.0 + 0.1 * t, 47.0)
    assert monitor.failed
    assert monitor.share == -1.0
    assert watch(lambda t: 10.0 + 0.1 * t, 2.0, monitor, begin=47.0).helping
    monitor = watch(lambda t: 10.0 + 0.1 * t, 30.0, monitor, begin=49.0)
    assert not monitor.helping
    assert not monitor.astern


def test_help_that_turns_the_bow_down_ends_at_once():
    def turned(pitch, pitching):
        monitor = watch(lambda t: 10.0, 21.0)
        for tick in range(20):
            monitor.record_pitch(21.0 + 0.1 * tick, pitch, pitching)
        return monitor

    assert turned(-0.4, -0.1).astern
    for pitch, pitching in ((-0.4, 0.1), (-0.1, -0.1), (0.3, 0.0)):
        assert not turned(pitch, pitching).astern


def test_astern_it_pauses_when_the_bow_has_come_up():
    """Fins that are jammed downward lift the stern for some seconds, and then turn the bow up."""
    monitor = watch(lambda t: 10.0 + 0.1 * t, 47.0)
    assert monitor.share == -1.0
    shares, depth, astern = [], 14.7, 0.0
    for tick in range(4 * 60):
        shares.append(monitor.share)
        astern = astern + 0.25 if shares[-1] else 0.0
        depth += 0.25 * (0.04 if not astern else -0.5 if astern < 5.0 else 0.3)
        monitor.update(47.0 + 0.25 * tick, depth, False)
        if not monitor.astern:
            break
    assert set(shares) == {-1.0, 0.0}
    assert depth < 10.0
    assert monitor.helping


def dives(pitch, rising, seconds=10.0, depth=5.0):
    """Shares of the thrust of a vehicle without a plan whose bow is at a pitch (rad) that it keeps for a time (s)."""
    monitor = AscentMonitor(0.3, 20.0)
    monitor.reset(0.0)
    shares = []
    for tick in range(4 * 15):
        monitor.update(0.25 * tick, depth, False)
        monitor.stop_dive(0.25 * tick, pitch if 0.25 * tick < seconds else 0.0, rising)
        shares.append(monitor.share if monitor.helping else 0.0)
    return shares, monitor


def test_a_bow_far_down_is_brought_up_astern_at_once_and_only_once():
    shares, monitor = dives(-1.0, 0.0)
    assert shares.index(-1.0) <= 4
    assert 4 * 7 < shares.count(-1.0) <= 4 * 9, "it changes nothing"
    assert shares[-1] == 0.0
    assert (monitor.heavy, monitor.failed, monitor.astern) == (False, False, False)
    shares, _ = dives(-1.0, 0.0, seconds=4.0)
    assert shares.count(-1.0) <= 4 * 4, "the bow is up"
    for pitch, rising, depth in ((-0.4, -0.3, 5.0), (-1.0, 0.1, 5.0), (-1.0, 0.0, 0.5)):
        assert not any(dives(pitch, rising, depth=depth)[0])


def test_a_wrong_pitch_stops_no_vehicle_that_rises_by_depth_and_altitude():
    """A pitch that drifts makes the vertical speed wrong, too."""
    monitor = AscentMonitor(0.3, 20.0)
    monitor.reset(0.0)
    for tick in range(4 * 110):
        now = 0.25 * tick
        depth = 9.0 - 0.07 * now
        monitor.update(now, depth, False, False, 0.03)
        monitor.watch_bottom(now, 15.0 - depth, 0.0, 0.03)
        monitor.stop_dive(now, -0.16 - 0.004 * now, 0.03)
        assert not monitor.helping


def test_a_dive_is_stopped_only_once_also_after_help_that_fails():
    monitor = AscentMonitor(0.3, 20.0)
    monitor.reset(0.0)
    stops = []
    for tick in range(4 * 260):
        monitor.update(0.25 * tick, 20.0, False, False, 0.0)
        monitor.stop_dive(0.25 * tick, math.radians(-45.0), 0.0)
        stops.append(monitor.stops_dive)
    assert monitor.failed
    assert 4 * 7 < sum(stops) <= 4 * 9


@pytest.mark.parametrize("measured", [True, False])
def test_a_dive_stop_ends_after_its_longest_time_although_pitch_and_speed_fall_silent(measured):
    monitor = AscentMonitor(0.3, 20.0)
    monitor.reset(0.0)
    helped = []
    for tick in range(4 * 19):
        now = 0.25 * tick
        if now < 2.0 or measured:
            monitor.update(now, 5.0, False)
        else:
            monitor.update_without_depth(now, 5.0, now - 2.0)
        if now < 2.0:
            monitor.stop_dive(now, -1.0, 0.0)
        helped.append(monitor.helping)
    assert 4 * 7 < sum(helped) <= 4 * 9
    assert not monitor.astern


def test_astern_at_the_surface_it_does_not_pause_for_an_attempt_before():
    monitor = watch(lambda t: 10.0 + 0.1 * t, 47.0)
    monitor = watch(lambda t: max(0.0, 14.7 - 1.5 * (t - 47.0)), 30.0, monitor, begin=47.0)
    assert not monitor.helping
    shares = []
    for tick in range(8):
        monitor.update(77.0 + 0.25 * tick, 0.4, False)
        shares.append(monitor.share)
    assert min(shares) < 0.0
    assert max(shares) < 0.0


def test_an_attempt_astern_goes_ahead_while_the_bow_is_up():
    """Fins that are jammed turn the bow up astern, and down ahead."""
    monitor = watch(lambda t: 10.0 + 0.1 * t, 47.0)

    def share(pitch, at, measured=True):
        if measured:
            monitor.record_pitch(at, pitch, 0.0)
        monitor.update(at, 14.6, False)
        return monitor.share

    assert [share(pitch, 47.0) for pitch in (-0.3, 0.1, 0.3, 0.1, -0.01, 0.1)] == [-1.0, -1.0, 1.0, 1.0, -1.0, -1.0]
    assert share(0.3, 48.0) == 1.0
    assert share(0.3, 50.0, measured=False) == -1.0, "no pitch is measured any more"
    monitor.pitch_faulty = True
    assert share(0.3, 51.0) == -1.0


def test_help_that_keeps_the_vehicle_level_is_tried_by_the_depth():
    monitor = watch(lambda t: 10.0, 47.0)
    assert (monitor.helping, monitor.pitch_faulty, monitor.failed) == (True, True, False)
    assert monitor.share == 1.0
    assert watch(lambda t: 10.0, 27.0, monitor, begin=47.0).failed


def test_a_pitch_up_with_which_the_vehicle_sinks_is_wrong():
    def judged(pitch, rising, seconds=6.0):
        monitor = watch(lambda t: 10.0, 21.0)
        for tick in range(round(10 * seconds)):
            monitor.record_pitch(21.0 + 0.1 * tick, pitch, 0.0, rising)
        return monitor

    assert judged(0.3, -0.2).pitch_faulty
    assert not judged(0.3, -0.2, 3.0).pitch_faulty, "it may still be sinking"
    for pitch, rising in ((0.3, 0.1), (0.3, 0.0), (0.0, -0.2)):
        assert not judged(pitch, rising).pitch_faulty
    monitor = judged(0.3, -0.2)
    watch(lambda t: 10.0 + 0.1 * t, 30.0, monitor, begin=27.0)
    assert monitor.failed
    assert monitor.pitch_faulty, "an attempt that fails makes it no better"
    monitor.reset(60.0)
    assert not monitor.pitch_faulty


def test_a_vehicle_that_would_reach_the_bottom_before_is_not_left_to_its_buoyancy():
    def begins(altitude, sinking, speed=0.2, seconds=15.0):
        """Time (s) at which help begins for an altitude (m) of the time and a vertical speed (m/s)."""
        monitor = AscentMonitor(0.3, 20.0)
        monitor.reset(0.0)
        for tick in range(round(4 * seconds)):
            now = 0.25 * tick
            monitor.watch_bottom(now, altitude(now), speed, -sinking)
            monitor.update(now, 10.0 + sinking * now, False, False, -sinking)
            if monitor.helping:
                return now
        return math.inf

    assert 4.0 < begins(lambda t: 1.5 - 0.1 * t, 0.1) < 5.0
    assert 8.0 < begins(lambda t: 2.5 - 0.1 * t, 0.1) < 10.0, "then the bottom is 20 s away"
    assert begins(lambda t: 1.5, -0.06) == math.inf, "it rises"
    assert begins(lambda t: 1.5 - 0.1 * t, 0.1, speed=1.0) == math.inf, "it is in a dive that ends"
    assert begins(lambda t: 1.5 - 0.1 * t if t % 3.0 else 9.0, 0.1) == math.inf, "the altitude is not steady"
    assert begins(lambda t: -1.0, 0.1) == math.inf, "none is known"


@pytest.mark.parametrize("sensed", [True, False])
def test_a_bottom_that_was_near_before_the_estimate_fell_silent_hurries_no_help(sensed):
    monitor, begun = AscentMonitor(0.3, 20.0), math.inf
    monitor.reset(0.0)
    monitor.update(0.0, 10.0, False, False, -0.1)
    monitor.watch_bottom(0.0, 0.5, 0.0, -0.1)
    for tick in range(1, 4 * 15):
        if sensed:
            monitor.update(0.25 * tick, 10.0, False, False, None)
        elif tick < 4 * 10:
            monitor.update_without_depth(0.25 * tick, 10.0, 0.25 * tick)
        else:
            monitor.update(0.25 * tick, 10.0, False, False, 0.05)
            monitor.watch_bottom(0.25 * tick, 0.5, 0.0, 0.05)
        begun = min(begun, 0.25 * tick) if monitor.helping else begun
    assert begun == math.inf


def test_without_a_depth_it_helps_for_the_time_that_the_last_one_takes():
    monitor = AscentMonitor(0.3, 20.0)
    helping = []
    for elapsed in (10.0, 21.0, 69.0, 71.0):
        monitor.update_without_depth(elapsed, 10.0, elapsed)
        helping.append(monitor.helping)
    assert helping == [False, True, True, False]


def test_fins_pitch_up_to_the_reference_and_level_the_vehicle():
    limit = math.radians(25.0)
    rolled = fin_torques(ascent_fins((0.2, 0.0, 1.0), (0.0, 0.0, 0.0), 0.35, limit), EFFECTS)
    assert rolled[0] < 0.0 < rolled[1]
    steep = fin_torques(ascent_fins((0.0, 0.6, 1.0), (0.0, 0.0, 0.0), 0.35, limit), EFFECTS)
    assert steep[1] < 0.0
    assert max(map(abs, ascent_fins((0.0, -1.5, 1.0), (0.0, 0.0, 0.0), 0.35, limit))) == pytest.approx(limit)
    assert fin_torques(blind_ascent_fins(0.0, limit), EFFECTS)[1] > 0.0
    assert fin_torques(blind_ascent_fins(1.0, limit), EFFECTS)[1] < 0.0


def test_a_pitch_with_which_help_brings_the_vehicle_down_is_wrong_as_soon_as_its_vertical_speed_says_up():
    for sinks, faulty in ((0.08, True), (-0.3, False)):  # m/s while it helps
        monitor, depth = AscentMonitor(0.3, 20.0), 6.0
        monitor.reset(0.0)
        for tick in range(round(4 * 35.0)):
            monitor.update(0.25 * tick, depth, False, False, 0.4 if monitor.helping else -0.1)
            depth += 0.25 * (sinks if monitor.helping else 0.1)
        assert monitor.helping
        assert monitor.pitch_faulty == faulty


def test_after_help_that_turned_its_bow_down_a_light_vehicle_at_a_false_surface_is_left_to_its_buoyancy():
    def helped(pitch):
        monitor, now, seconds = AscentMonitor(0.3, 20.0), 0.0, 0.0
        monitor.reset(0.0)
        for tick in range(round(4 * 300.0)):
            now = 0.25 * tick
            monitor.update(now, 0.01, False, True, pitch if monitor.helping else -0.1)
            monitor.record_pitch(now, pitch, 0.1 * pitch)
            seconds += 0.25 * monitor.helping
        return seconds

    assert 0.0 < helped(-0.6) < 2.0
    assert helped(0.3) > 10.0
