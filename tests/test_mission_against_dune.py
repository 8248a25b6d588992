"""A plan that DUNE flew, flown by Shoal: states, modes, track, times and depth compared with DUNE's log.

On the first two legs the water is too shallow for the plan: both keep 2.5 m above the bottom, measured by altimeter.
"""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from shoal.missions import load_plan

BENCH = Path(__file__).parents[1] / "bench" / "against_dune.py"
LEGS = range(4)
SHALLOW, SURFACED = (0, 1), (2, 3)


def load():
    spec = importlib.util.spec_from_file_location("against_dune", BENCH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


bench = load()


@pytest.fixture(scope="module")
def dune():
    return bench.recorded()


@pytest.fixture(scope="module")
def ours():
    return bench.flown(load_plan(bench.PLAN))


def test_maneuvers_and_modes_follow_each_other_as_in_dune(ours, dune):
    assert ours["plan"] == dune["plan"]
    assert ours["vehicle"] == dune["vehicle"]


def test_each_leg_takes_as_long(ours, dune):
    for (name, mine), (_, theirs) in zip(ours["legs"], dune["legs"], strict=True):
        assert mine == pytest.approx(theirs, rel=0.1), name


@pytest.mark.parametrize("leg", LEGS)
def test_the_track_is_that_of_dune(ours, dune, leg):
    assert bench.across(ours, dune, leg) < 3.0
    assert bench.across(dune, ours, leg) < 3.0
    assert bench.of_leg(ours, leg)[-1, 1:3] == pytest.approx(bench.of_leg(dune, leg)[-1, 1:3], abs=3.0)


def test_it_dives_as_dune_does(ours, dune):
    mine, theirs = (bench.of_leg(flight, 0) for flight in (ours, dune))
    diving = np.arange(0.0, 14.0, 0.5)  # then the bottom is too close
    depths = [np.interp(diving, rows[:, 0], rows[:, 3]) for rows in (mine, theirs)]
    assert depths[0] == pytest.approx(depths[1], abs=0.15)


@pytest.mark.parametrize("leg", SURFACED)
def test_the_depth_is_that_of_dune_at_the_surface(ours, dune, leg):
    assert np.abs(bench.depths_apart(ours, dune, leg)).max() < 0.1


@pytest.mark.parametrize("leg", SHALLOW)
def test_the_depth_is_that_of_dune_above_the_bottom(ours, dune, leg):
    apart = np.abs(bench.depths_apart(ours, dune, leg))
    assert math.sqrt((apart**2).mean()) < 0.25
    assert apart.max() < 0.5
