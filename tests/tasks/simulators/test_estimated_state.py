"""Simulators.EstimatedState on a bus: rates, conventions, limits, bad parameters."""

import math

import pytest

import imc
from runtime import ParameterError
from runtime.testing import simulate
from support.rotations import rotation, to_ned
from tasks.simulators.estimated_state import EstimatedState


def test_rates_start_and_reference_point():
    run = simulate(EstimatedState, seconds=10, start_latitude=41.0, start_longitude=-8.0, estimated_state_rate=30.0)
    truths, estimates = run.of(imc.SimulatedState), run.of(imc.EstimatedState)
    assert (len(truths), len(estimates)) == (1000, 300)
    first = estimates[0]
    assert (first.x, first.y, first.z, first.depth, first.alt) == (0.0, 0.0, 0.0, 0.0, 13.0)
    assert (first.u, first.vx) == (0.0, 0.0)
    assert {(m.lat, m.lon, m.height) for m in (*truths, *estimates)} == {(math.radians(41.0), math.radians(-8.0), 0.0)}
    assert run.of(imc.EntityState)[0].state == imc.EntityState.State.NORMAL


def test_truth_and_estimate_of_one_instant_agree():
    run = simulate(EstimatedState, seconds=40, current_north=0.3, current_east=-0.2, depth=5.0)
    truths = {m.timestamp: m for m in run.of(imc.SimulatedState)}
    pairs = [(truths[m.timestamp], m) for m in run.of(imc.EstimatedState)]
    for truth, estimate in pairs:
        for field in ("lat", "lon", "x", "y", "z", "phi", "theta", "psi", "p", "q", "r"):
            assert getattr(truth, field) == getattr(estimate, field)
        r = rotation(truth.phi, truth.theta, truth.psi)
        water = to_ned(r, (truth.u, truth.v, truth.w))
        ground = to_ned(r, (estimate.u, estimate.v, estimate.w))
        stream = (truth.svx, truth.svy, truth.svz)
        velocity = (estimate.vx, estimate.vy, estimate.vz)
        assert [w + s for w, s in zip(water, stream, strict=True)] == pytest.approx(velocity, abs=1e-6)
        assert ground == pytest.approx(velocity, abs=1e-6)
        assert estimate.depth == estimate.z
        assert estimate.depth + estimate.alt == pytest.approx(13.0, abs=1e-5)
    assert pairs[-1][1].depth == 5.0
    assert (pairs[0][0].svx, pairs[0][0].svy) == pytest.approx((0.3, -0.2))


@pytest.mark.parametrize("pattern", ["Hover", "Line", "Circle", "Lawn-mower", "Waypoints"])
def test_every_pattern_stays_between_surface_and_bottom(pattern):
    run = simulate(
        EstimatedState,
        seconds=85,
        pattern=pattern,
        waypoints=["30 0 13", "30 30 0"],
        vertical_mode="Altitude",
        altitude=1.5,
        simulated_state_rate=20.0,
    )
    states = run.of(imc.EstimatedState)
    assert min(m.depth for m in states) == 0.0
    assert max(m.depth for m in states) <= 13.0
    assert min(m.alt for m in states) >= 0.0
    assert pattern == "Waypoints" or states[-1].alt == 1.5


def test_unknown_bottom_gives_invalid_altitude():
    run = simulate(EstimatedState, seconds=1, bottom_depth=-1.0)
    assert {m.alt for m in run.of(imc.EstimatedState)} == {-1.0}


def test_runs_are_equal():
    parameters = {"seconds": 20, "pattern": "Lawn-mower", "current_east": 0.2}
    assert simulate(EstimatedState, **parameters).packets == simulate(EstimatedState, **parameters).packets


@pytest.mark.parametrize(
    ("parameters", "name", "reason"),
    [
        ({"depth": 14.0}, "Depth", "below the bottom"),
        ({"depth": -1.0}, "Depth", "below the minimum"),
        ({"vertical_mode": "Altitude", "altitude": 14.0}, "Altitude", "above the surface"),
        ({"vertical_mode": "Altitude", "bottom_depth": -1.0}, "Altitude", "needs a Bottom Depth"),
        ({"pattern": "Spiral"}, "Pattern", "not one of"),
        ({"speed": 0.0}, "Speed", "at least"),
        ({"speed": 0.5, "current_north": 0.45}, "Speed", "too slow"),
        ({"circle_radius": 3.0}, "Circle Radius", "less than the .* that the turn rate allows"),
        ({"pattern": "Waypoints"}, "Waypoints", "needs a point"),
        ({"pattern": "Waypoints", "waypoints": ["10 x"]}, "Waypoints", "10 x"),
        ({"pattern": "Waypoints", "waypoints": ["10 0", "10 0.5"]}, "Waypoints", "less than 1 m"),
        ({"pattern": "Waypoints", "waypoints": ["10 0 20"]}, "Waypoints", "below the bottom"),
        ({"pattern": "Waypoints", "waypoints": ["10 0 -2"]}, "Waypoints", "above the surface"),
        ({"pattern": "Waypoints", "waypoints": ["0.1 0"]}, "Waypoints", "less than 1 m"),
    ],
)
def test_bad_parameters(parameters, name, reason):
    with pytest.raises(ParameterError, match=reason) as caught:
        simulate(EstimatedState, **parameters)
    assert caught.value.name == name


def test_a_hovering_vehicle_may_have_no_speed():
    run = simulate(EstimatedState, seconds=30, pattern="Hover", speed=0.0, depth=2.0)
    assert run.of(imc.EstimatedState)[-1].depth == 2.0


def test_closed_waypoints_need_no_return():
    run = simulate(EstimatedState, seconds=60, pattern="Waypoints", waypoints=["20 0", "20 20", "0 0 2"], depth=1.0)
    assert 2.0 in {m.depth for m in run.of(imc.EstimatedState)}
