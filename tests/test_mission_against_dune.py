"""A plan that DUNE flew, flown by Shoal: states, modes, track, times and depth compared with DUNE's log.

On the first two legs the water is too shallow for the plan: both keep 2.5 m above the bottom, measured by altimeter.
"""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from shoal import fly
from shoal.missions import load_plan

pytestmark = [pytest.mark.heavy, pytest.mark.computing]
BENCH = Path(__file__).parents[1] / "bench" / "against_dune.py"
LEGS = range(4)
DUNE_SECONDS = (58.8, 46.4, 69.6, 57.9)  # of the same plan in its original log
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
def flown(tmp_path_factory):
    """The report of our flight, and its log."""
    folder, plan = tmp_path_factory.mktemp("flown"), load_plan(bench.PLAN)
    report = fly(plan, limit=900, log_root=folder)
    (log,) = folder.glob(f"*/*/*_{plan.plan_id}")
    return report, log


@pytest.fixture(scope="module")
def ours(flown):
    return bench.reduce(flown[1])


def test_the_recorded_plan_completes_as_it_did_in_dune(flown):
    report, _ = flown
    assert report.completed
    short = "plan completed; Goto1: depth 1.3 m instead of 3 m; Goto2: depth 1.4 m instead of 5 m"
    assert report.reason == short  # the water is too shallow, and the altitude is kept
    assert report.maneuvers == ["Goto1", "Goto2", "Goto3", "SK1"]
    assert [leg.seconds for leg in report.legs] == pytest.approx(DUNE_SECONDS, rel=0.1)
    assert report.cross_track < 5.0
    assert report.depth_error < 0.6
    assert 0.8 < report.deepest < 5.5
    assert report.distance == pytest.approx(255.0, abs=15.0)
    assert report.states[-3:] == ["INITIALIZING", "EXECUTING", "READY"]


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
