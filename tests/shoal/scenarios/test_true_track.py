"""Coarse tracks of runs."""

import math

import pytest

import imc
from shoal.scenarios.true_track import TrueTrack


def test_a_track_has_a_true_position_every_five_seconds_of_its_own_vehicle():
    track = TrueTrack(system=7)
    lat, lon = math.radians(41.0), math.radians(-8.0)
    for tenth in range(200):
        for system in (7, 8):
            state = imc.SimulatedState(lat=lat, lon=lon, x=tenth * 1.0, z=0.1 * tenth)
            track.record_position(state.replace(src=system, timestamp=1000.0 + 0.1 * tenth))
    assert len(track.points) == 3 * 4
    assert track.points[:3] == [41.0, -8.0, 0.0]
    assert track.points[3::3] == pytest.approx(
        [41.0 + degrees for degrees in (50 / 111_046, 100 / 111_046, 150 / 111_046)], abs=1e-6
    )
    assert track.points[5::3] == pytest.approx([5.0, 10.0, 15.0])


def test_a_place_that_is_no_number_is_left_out():
    track = TrueTrack(system=7)
    for value in (math.nan, math.inf, 0.0):
        track.record_position(imc.SimulatedState(lat=value, src=7, timestamp=1.0))
    assert track.points == [0.0, 0.0, 0.0]
