"""The grids on which rays meet the bottom, and the curves between their nodes."""

import math

import numpy as np
import pytest

from world.pictures.grids import CURVED, REACH, Grids
from world.pictures.relief import Relief
from world.sea import Bathymetry

PLACE = 1.0, 2.0, 3.0


def hills():
    places = [(n, e) for n in range(-60, 61, 6) for e in range(-60, 61, 6)]
    return Bathymetry([(n, e, 7 + 0.5 * math.sin(n / 9) + 0.4 * math.cos(e / 7)) for n, e in places], 20.0, 25.0)


def rays_down(count):
    """(3, n) all around, from straight down to a little above the horizon."""
    random = np.random.default_rng(5)
    bearing, slope = random.uniform(0.0, math.tau, count), random.uniform(-0.1, 3.0, count) ** 2 - 0.005
    return np.stack((np.cos(bearing), np.sin(bearing), slope))


@pytest.mark.parametrize("level", range(CURVED))
def test_curves_are_as_near_to_the_bottom_as_they_tell(level):
    sea, random = hills(), np.random.default_rng(level)
    curved, reach = Grids(sea).curved(level, PLACE), REACH * 4**level
    north, east = (at + random.uniform(-reach, reach, 4000) for at in PLACE[:2])
    apart = np.abs(curved.depths(north, east) - sea.depths(north, east))
    told = curved.errors_at(north, east)
    assert np.mean(apart <= told + 1e-9) > 0.98
    assert np.all(apart <= 3.0 * told + 1e-6)
    if level < 2:  # the next nodes are 4 m apart, and soundings 6 m
        straight = np.abs(curved.grid.depths(north, east) - sea.depths(north, east))
        assert np.median(apart) < 0.25 * np.median(straight)


def test_extents_hold_all_depths_farther_than_told():
    grid = Grids(hills()).around(2, PLACE)
    extent = grid.extent_beyond(64.0, PLACE)
    nodes = grid.nodes.reshape(-1, grid.columns)
    north, east = (start + grid.step * np.arange(count) for start, count in zip(grid[:2], nodes.shape, strict=True))
    away = np.hypot(north[:, None] - PLACE[0], east - PLACE[1])
    assert extent.shallowest <= nodes[away > 64.0].min()
    assert extent.deepest >= nodes[away > 64.0].max()
    assert away[nodes < extent.middle].max() <= extent.edge < away.max()


@pytest.mark.parametrize("exact", [False, True])
def test_what_a_ray_meets_does_not_depend_on_the_rays_beside_it(exact):
    relief, rays = Relief(hills()), rays_down(9000)
    together, rough = relief.meet(PLACE, rays, exact=exact, cell=0.05)
    for own in (slice(3, 7000, 7), slice(4090, 4100)):
        alone, same = relief.meet(PLACE, rays[:, own], exact=exact, cell=0.05)
        np.testing.assert_array_equal(alone, together[own])
        np.testing.assert_array_equal(same, rough[own])


def test_a_ray_that_is_begun_under_the_ground_is_begun_again():
    relief, rays = Relief(hills()), rays_down(2000)
    expected, _ = relief.meet(PLACE, rays, exact=True)
    hit = expected > 1.0 / 15.0
    found, _ = relief.meet(PLACE, rays[:, hit], exact=True, since=1.05 / expected[hit])
    np.testing.assert_allclose(found, expected[hit], rtol=1e-4)


def test_a_crossing_that_is_about_known_is_settled():
    relief, rays = Relief(hills()), rays_down(2000)
    expected, _ = relief.meet(PLACE, rays, exact=True)
    near = np.flatnonzero((expected > 0.1) & (rays[2] > 0.3))
    found, good = relief.settle(PLACE, rays[:, near], expected[near] * 1.03)
    assert good.mean() > 0.9
    np.testing.assert_allclose(found[good], expected[near][good], rtol=3e-4)
    lost, good = relief.settle(PLACE, rays[:, near], expected[near] * 2.0)
    assert not good.any()
    np.testing.assert_array_equal(lost, expected[near] * 2.0)
