"""Detections are judged by what is there."""

import math

import numpy as np
import pytest

from world.detection import detection_statistics, match_objects

THINGS = np.array([[2.0, 1.0], [8.0, -3.0]])


def judged(ids, offsets, spreads=None, shown=None):
    offsets = np.array(offsets, float).reshape(-1, 2)
    truth = np.repeat(THINGS[None], len(offsets), axis=0)
    spreads = np.full((len(offsets), 2, 2), np.nan) if spreads is None else spreads
    return detection_statistics(np.array(ids, int), offsets, truth, spreads, shown)


def test_misses_false_alarms_and_exchanged_numbers_are_counted():
    offsets = [(2.1, 1.0), (8.0, -3.2), (2.0, 0.9), (-5.0, 0.0), (2.0, 1.1), (-5.0, 0.2), (20.0, 20.0)]
    shown = np.array([[True, True]] * 4 + [[True, False]] * 3)
    found = judged([1, 2, 1, 9, 3, 9, 4], offsets, shown=shown)
    first, second = found.objects
    assert (first.pictures, first.detections, first.missed_picture_count, first.ids, first.switches) == (
        7,
        3,
        4,
        (1, 3),
        1,
    )
    assert (second.pictures, second.detections, second.missed_picture_count, second.ids, second.switches) == (
        4,
        1,
        3,
        (2,),
        0,
    )
    assert (found.false_alarms, found.false_ids) == (3, 2)
    assert first.rms == pytest.approx(0.1)
    assert second.rms == pytest.approx(0.2)


def test_nees_is_two_for_errors_as_large_as_told():
    random, spread = np.random.default_rng(1), np.array([[0.04, 0.01], [0.01, 0.02]])
    offsets = THINGS[0] + random.multivariate_normal((0.0, 0.0), spread, 2000)
    told = judged([1] * 2000, offsets, np.repeat(spread[None], 2000, axis=0))
    assert told.objects[0].nees == pytest.approx(2.0, abs=4.0 * 2.0 / math.sqrt(2000))
    bold = judged([1] * 2000, offsets, np.repeat(spread[None] / 4.0, 2000, axis=0))
    assert bold.objects[0].nees == pytest.approx(4.0 * told.objects[0].nees)


def test_without_detections_pictures_or_things_nothing_is_claimed():
    empty = judged([], [])
    assert [(thing.pictures, thing.detections, thing.missed_picture_count, thing.ids) for thing in empty.objects] == [
        (-1, 0, 0, ())
    ] * 2
    assert math.isnan(empty.objects[0].rms)
    assert math.isnan(empty.objects[0].nees)
    nothing = detection_statistics(
        np.array([4]), np.zeros((1, 2)), np.empty((1, 0, 2)), np.full((1, 2, 2), np.nan), None
    )
    assert (nothing.objects, nothing.false_alarms, nothing.false_ids) == ((), 1, 1)
    assert match_objects(np.zeros((3, 2)), np.empty((3, 0, 2))).tolist() == [-1] * 3


def test_of_two_things_the_nearer_one_is_meant_and_reach_grows_with_the_distance():
    truth = np.array([[[0.0, 0.0], [1.5, 0.0], [40.0, 0.0]]])
    for offset, thing in ((0.6, 0), (1.0, 1), (3.0, -1), (35.0, 2), (30.0, -1)):
        assert match_objects(np.array([[offset, 0.0]]), truth).tolist() == [thing]
