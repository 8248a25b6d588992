"""Vehicles that are stuck on their path or stray from it."""

import math

from autonomy.guidance import AlongTrack, CrossTrack, DivergenceMonitor, Track, progress


def at(left=100.0, y=0.0, course=0.0):
    return progress(Track((0.0, 0.0), (200.0, 0.0)), (200.0 - left, y), 1.0, course, course)


def test_no_progress_twice_is_a_divergence():
    watch = DivergenceMonitor(AlongTrack(20.0, 0.05, math.radians(2.0)), None)
    watch.restart(0.0)
    found = [watch.error_text(float(t), at(), 0.0, 0.0) for t in range(61)]
    assert found.index("along-track divergence error") == 40


def test_progress_and_turning_are_none():
    watch = DivergenceMonitor(AlongTrack(20.0, 0.05, math.radians(2.0)), None)
    watch.restart(0.0)
    assert not any(watch.error_text(float(t), at(left=100.0 - 0.1 * t), 0.0, 0.0) for t in range(200))
    watch.restart(200.0)
    turning = (at(course=math.pi - math.radians(2.1) * t) for t in range(40))
    assert not any(watch.error_text(200.0 + t, where, 0.0, 0.0) for t, where in enumerate(turning))


def test_too_far_from_the_track_for_too_long_is_a_divergence_but_not_within_the_uncertainty():
    watch = DivergenceMonitor(None, CrossTrack(25.0, 20.0))
    watch.restart(10.0)
    found = [watch.error_text(float(t), at(y=-30.0), 0.0, 0.0) for t in range(40)]
    assert found.index("cross-track divergence error") == 30
    watch.restart(0.0)
    assert not any(watch.error_text(float(t), at(y=-30.0), 0.0, 10.0) for t in range(100))
