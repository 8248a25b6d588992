"""The grids on which rays meet the bottom, and the curves between their nodes."""

import math

import numpy as np
import pytest

from world.rendering.seabed.depth_clipmap import CURVED, LEVELS, REACH, DepthClipmap
from world.rendering.seabed.ray_hit_bounds import GridHorizon, HorizonSectors, sector_of_rays
from world.rendering.seabed.seabed_intersection import SeabedIntersector
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
    curved, reach = DepthClipmap(sea).curved_grid_around(level, PLACE), REACH * 4**level
    north, east = (at + random.uniform(-reach, reach, 4000) for at in PLACE[:2])
    apart = np.abs(curved.depths(north, east) - sea.depths(north, east))
    told = curved.errors_at(north, east)
    assert np.mean(apart <= told + 1e-9) > 0.98
    assert np.all(apart <= 3.0 * told + 1e-6)
    if level < 2:  # the next nodes are 4 m apart, and soundings 6 m
        straight = np.abs(curved.grid.depths(north, east) - sea.depths(north, east))
        assert np.median(apart) < 0.25 * np.median(straight)


@pytest.mark.parametrize("level", range(LEVELS))
@pytest.mark.parametrize("deep", [2.0, 6.9, 12.0])
def test_no_ray_touches_a_grid_before_or_after_where_the_horizon_tells(level, deep):
    place, rays = (*PLACE[:2], deep), rays_down(1500)
    slope = rays[2] * 0.1
    grid = DepthClipmap(hills()).grid_around(level, place)
    horizon = GridHorizon.from_grid(place, grid, level, HorizonSectors())
    touch, nearest, farthest = horizon.possible_hits(sector_of_rays(rays[0], rays[1]), slope)
    first, last = np.full(len(slope), np.inf), np.zeros(len(slope))
    first[touch], last[touch] = nearest, farthest
    begin, end = (0.0 if level == 0 else REACH * 4 ** (level - 1)), REACH * 4**level
    away = np.linspace(begin, end, 600)
    places = [at + np.outer(each, away) for at, each in zip(PLACE[:2], rays[:2], strict=True)]
    clear = grid.depths(*(each.ravel() for each in places)).reshape(places[0].shape) - deep - np.outer(slope, away)
    outside = (away < first[:, np.newaxis]) | (away > last[:, np.newaxis])
    assert (clear > 0.0)[outside].all()
    crossing = (clear <= 0.0).any(axis=1)
    assert touch[crossing].all()
    if (~crossing).sum() > 100:
        assert (~touch[~crossing]).mean() > 0.5  # most of those that miss are told
    if level < 2 and crossing.any():
        assert np.median(away[(clear <= 0.0).argmax(axis=1)][crossing] - first[crossing]) < 8 * grid.step


@pytest.mark.parametrize("exact", [False, True])
def test_what_a_ray_meets_does_not_depend_on_the_rays_beside_it(exact):
    relief, rays = SeabedIntersector(hills()), rays_down(9000)
    together, rough = relief.intersect(PLACE, rays, exact=exact, cell=0.05)
    for own in (slice(3, 7000, 7), slice(4090, 4100)):
        alone, same = relief.intersect(PLACE, rays[:, own], exact=exact, cell=0.05)
        np.testing.assert_array_equal(alone, together[own])
        np.testing.assert_array_equal(same, rough[own])


def test_a_crossing_that_is_about_known_is_settled():
    relief, rays = SeabedIntersector(hills()), rays_down(2000)
    expected, _ = relief.intersect(PLACE, rays, exact=True)
    near = np.flatnonzero((expected > 0.1) & (rays[2] > 0.3))
    found, good = relief.refine(PLACE, rays[:, near], expected[near] * 1.03)
    assert good.mean() > 0.9
    np.testing.assert_allclose(found[good], expected[near][good], rtol=3e-4)
    lost, good = relief.refine(PLACE, rays[:, near], expected[near] * 2.0)
    assert not good.any()
    np.testing.assert_array_equal(lost, expected[near] * 2.0)
