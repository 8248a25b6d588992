"""The bottom between soundings, against the formula over all of them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from world.sea import Bathymetry, bathymetry

METERS = st.floats(-300.0, 300.0)
SOUNDINGS = st.lists(st.tuples(METERS, METERS, st.floats(0.0, 100.0)), max_size=30)


@given(soundings=SOUNDINGS, points=st.lists(st.tuples(METERS, METERS), max_size=20), radius=st.floats(0.5, 200.0))
def test_the_search_misses_no_sounding(soundings, points, radius):
    sea = Bathymetry(soundings, radius, 120.0)
    for north, east in [*points, *((n, e) for n, e, _ in soundings)]:
        distances = [(math.hypot(n - north, e - east), depth) for n, e, depth in soundings]
        if min((distance for distance, _ in distances), default=math.inf) < 1.1e-3:
            continue  # at a sounding itself
        weights = [((1.0 / d - 1.0 / radius) ** 2, depth) for d, depth in distances if d < radius]
        total = math.fsum(weight for weight, _ in weights)
        if weights and total < 1e-12:
            continue  # at the edge of the radius, where rounding decides
        expected = math.fsum(weight * depth for weight, depth in weights) / total if weights else 120.0
        assert math.isclose(sea.depth(north, east), expected, rel_tol=1e-6, abs_tol=1e-6)


def test_places_without_soundings_are_not_remembered_and_others_within_bounds(monkeypatch):
    monkeypatch.setattr(bathymetry, "REMEMBERED", 50)
    sea, fresh = (Bathymetry([(0.0, 0.0, 8.0), (30.0, 5.0, 12.0)], 40.0, 120.0) for _ in range(2))
    assert [sea.depth(1000.0 + k, -1000.0) for k in range(500)] == [120.0] * 500
    assert not sea._near
    for north in range(-40, 70, 3):
        for east in range(-40, 45, 3):
            assert sea.depth(north, east) == pytest.approx(fresh.depth(north, east))
            fresh._near.clear()
            assert len(sea._near) <= 50


@given(soundings=SOUNDINGS, points=st.lists(st.tuples(METERS, METERS), max_size=40), radius=st.floats(0.5, 200.0))
def test_many_depths_at_once_are_those_one_by_one(soundings, points, radius):
    sea = Bathymetry(soundings, radius, 120.0, level=0.3)
    places = [*points, *((n, e) for n, e, _ in soundings), *((n + 5e-4, e) for n, e, _ in soundings)]
    north, east = np.array(places).reshape(-1, 2).T
    np.testing.assert_array_equal(sea.depths(north, east), [sea.depth(*place) for place in places])


@pytest.mark.parametrize("span", [8.0, 400.0])
def test_many_depths_are_those_one_by_one_whether_they_are_close_together_or_scattered(span):
    random = np.random.default_rng(4)
    soundings = [(6.0 * i, 6.0 * j, random.uniform(3.0, 9.0)) for i in range(-15, 16) for j in range(-15, 16)]
    sea, (north, east) = Bathymetry(soundings, 25.0, 12.0), random.uniform(-0.5 * span, 0.5 * span, (2, 1200))
    found = sea.depths(north, east)
    np.testing.assert_array_equal(found, [sea.depth(*place) for place in zip(north, east, strict=True)])
    assert np.unique(found).size > 200
