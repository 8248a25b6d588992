"""A plan that DUNE flew, flown by Shoal: states, modes, track, times and depth against what is kept of DUNE's log.

DUNE's bottom tracker replaced the depths of the first two legs by an altitude of 2.5 m; Shoal has none, so that its
depth there is held against the plan, and against DUNE's with a plan that asks for this altitude.
"""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from runtime.plans import load_plan

BENCH = Path(__file__).parents[1] / "bench" / "against_dune.py"
LEGS = range(4)
SURFACED = (2, 3)
ASKED = {0: 3.0, 1: 5.0, 2: 0.0, 3: 0.0}  # m


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


@pytest.fixture(scope="module")
def above_bottom():
    return bench.flown(bench.at_altitude(load_plan(bench.PLAN)))


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


@pytest.mark.parametrize("leg", LEGS)
def test_the_depth_is_that_of_the_plan(ours, leg):
    rows = bench.of_leg(ours, leg)
    assert rows[rows[:, 0] > 25.0, 3] == pytest.approx(ASKED[leg], abs=0.3)


def test_it_dives_as_dune_does(ours, dune):
    mine, theirs = (bench.of_leg(flight, 0) for flight in (ours, dune))
    diving = np.arange(0.0, 14.0, 0.5)  # then DUNE's bottom tracker steps in
    depths = [np.interp(diving, rows[:, 0], rows[:, 3]) for rows in (mine, theirs)]
    assert depths[0] == pytest.approx(depths[1], abs=0.15)


@pytest.mark.parametrize("leg", SURFACED)
def test_the_depth_is_that_of_dune_at_the_surface(ours, dune, leg):
    assert bench.depth_apart(ours, dune, leg, 25.0) < 0.1


@pytest.mark.parametrize("leg", LEGS)
def test_the_depth_is_that_of_dune_above_the_bottom(above_bottom, dune, leg):
    assert bench.depth_apart(above_bottom, dune, leg, 40.0) < 0.5
