"""Simulators.MUGDetectionCamera on a bus: messages and their times, errors, faults, fidelities."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import imc
from runtime import ParameterError, State
from runtime.testing import simulate
from support import wgs84
from tasks.simulators.estimated_state import EstimatedState
from tasks.simulators.mug_detection_camera import MUGDetectionCamera

DATA = Path(__file__).parents[2] / "data" / "sensors"
LAT, LON = 0.7188, -0.1519


def still(count, rate=20, alt=10.0, **fields):
    """A vehicle that stays where it is."""
    return [
        imc.EstimatedState(timestamp=k / rate, lat=LAT, lon=LON, alt=alt, depth=3.0, z=3.0, **fields)
        for k in range(count)
    ]


def detections(feed, **parameters):
    return simulate(MUGDetectionCamera, feed=feed, **parameters).of(imc.EstimatedMugState)


def test_default_glider_is_seen_ten_times_a_second():
    seen = detections(still(41), error_model="None")
    assert len(seen) == 21
    for m in seen:
        assert m.id == 1
        assert (m.x, m.y) == pytest.approx((1.0, 0.3), abs=0.02)


def test_every_state_is_looked_at_on_demand_and_by_the_originals():
    assert len(detections(still(41), detection_rate=0.0)) == 41
    assert len(detections(still(41), fidelity="Original")) == 41
    assert len(detections(still(41), detection_rate=15.0)) == 31


def test_gliders_stay_where_they_are():
    parameters = {"error_model": "None", "mugs": ["2.0 -1.0", "50 0", "-1 3"]}
    feed = [
        imc.EstimatedState(timestamp=0.0, lat=LAT, lon=LON, x=5.0, y=5.0, alt=10.0),
        imc.EstimatedState(timestamp=1.0, lat=LAT, lon=LON, x=6.0, y=4.0, psi=1.0, alt=10.0),
    ]
    first, second = (detections(feed[:n], **parameters)[-2:] for n in (1, 2))
    assert [m.id for m in first] == [m.id for m in second] == [1, 3]
    assert [v for m in first for v in (m.x, m.y)] == pytest.approx([2.0, -1.0, -1.0, 3.0], abs=0.02)
    assert [v for m in second for v in (m.x, m.y)] == pytest.approx([1.0, 0.0, -2.0, 4.0], abs=0.02)


def test_a_new_reference_point_moves_nothing():
    lat, lon, _ = wgs84.displace(LAT, LON, 0.0, 300.0, -200.0, 0.0)
    feed = [
        imc.EstimatedState(timestamp=0.0, lat=LAT, lon=LON, x=300.0, y=-200.0, alt=10.0),
        imc.EstimatedState(timestamp=1.0, lat=lat, lon=lon, alt=10.0),
        imc.EstimatedState(timestamp=2.0, lat=LAT, lon=LON, x=300.5, y=-200.0, alt=10.0),
    ]
    seen = detections(feed, error_model="None")
    assert [(m.x, m.y) for m in seen] == [pytest.approx(p, abs=0.03) for p in ((1.0, 0.3), (1.0, 0.3), (0.5, 0.3))]


def test_target_planes():
    aircraft = [imc.EstimatedState(lat=LAT, lon=LON, z=-20.0, depth=-1.0, alt=-1.0)]
    assert len(detections(aircraft, target_plane="Surface")) == 1
    assert detections(aircraft, target_plane="Seabed") == []
    assert len(detections(still(1, alt=-1.0), target_plane="Depth", target_depth=13.0)) == 1
    assert len(detections(still(1), target_plane="Surface")) == 1  # from below, it looks up
    assert detections(still(1), target_plane="Surface", mount_orientation=[0.0, 0.0, 0.0]) == []


@pytest.mark.heavy
def test_uniform_error_is_within_half_a_metre_at_ten():
    for alt in (10.0, 30.0):
        seen = np.array([(m.x, m.y) for m in detections(still(3000, alt=alt), detection_rate=0.0, seed=5)])
        exact = detections(still(1, alt=alt), error_model="None")[0]
        errors = (seen - (exact.x, exact.y)) / (0.05 * alt)
        n = len(errors)
        assert np.abs(errors).max() <= 1.0 + 1e-5
        assert np.all(np.abs(errors.mean(axis=0)) < 4.0 / math.sqrt(3.0 * n))
        assert abs(np.corrcoef(errors.T)[0, 1]) < 4.0 / math.sqrt(n)
        for column in np.sort(errors.T):  # Kolmogorov and Smirnov, p = 1e-3
            distance = np.abs((column + 1.0) / 2.0 - (np.arange(n) + 0.5) / n).max() + 0.5 / n
            assert distance < 1.95 / math.sqrt(n)


def test_gsd_error_has_its_sigma():
    seen = np.array([(m.x, m.y) for m in detections(still(4000), detection_rate=0.0, error_model="GSD", seed=2)])
    sigma = math.hypot(0.5 * 20 * math.tan(math.radians(46.4)) / 1280, math.radians(0.2) * 10 * 1.0109, 0.1 * 0.10440)
    assert seen.std(axis=0) == pytest.approx([sigma, sigma], rel=4.0 / math.sqrt(2 * 4000))


def test_errors_depend_on_the_seed_and_not_on_other_gliders():
    feed = still(21)
    assert detections(feed, seed=1) == detections(feed, seed=1)
    assert detections(feed, seed=1) != detections(feed, seed=2)
    far_away = detections(feed, seed=1, mugs=["1.0 0.3", "500 0"])
    near = detections(feed, seed=1, mugs=["1.0 0.3", "0 0"])
    assert far_away == [m for m in near if m.id == 1]


@pytest.mark.parametrize("row", json.loads((DATA / "mug_original.json").read_text())[:12])
def test_original(row):
    given = row["in"]
    feed = [imc.EstimatedState(lat=LAT, lon=LON, psi=given["psi"], alt=given["alt"])]
    seen = detections(
        feed,
        fidelity="Original",
        error_model="None",
        mugs=[f"{given['dN']} {given['dE']}"],
        horizontal_resolution=given["W"],
        vertical_resolution=given["H"],
    )
    assert len(seen) == row["visible"]
    for m in seen:
        assert (m.x, m.y) == pytest.approx(row["ned_from_pixel"], rel=1e-6)


def test_original_code_takes_ten_metres_and_one_error():
    seen = detections(still(5, alt=-1.0), fidelity="Original Code")
    assert len(seen) == 5
    for m in seen:
        assert (m.x, m.y) == pytest.approx((0.990904 - 0.471632, 0.295342 - 0.039696), abs=1e-6)


def test_original_error_grows_with_the_resolution():
    seen = np.array([(m.x, m.y) for m in detections(still(2000), fidelity="Original", seed=1)])
    errors = np.abs(seen - (0.990904, 0.295342))
    assert errors[:, 0].max() == pytest.approx(0.64, abs=0.01)
    assert errors[:, 1].max() == pytest.approx(0.48, abs=0.01)


@pytest.mark.parametrize("fidelity", ["Physical", "Original"])
@pytest.mark.parametrize("alt", [-1.0, 0.0, math.nan, math.inf])
def test_no_altitude_no_detection(alt, fidelity):
    feed = [state.replace(timestamp=state.timestamp + late) for late in (0.0, 3.0) for state in still(5, alt=alt)]
    run = simulate(MUGDetectionCamera, feed=feed, seconds=5.0, fidelity=fidelity)
    assert run.of(imc.EstimatedMugState) == []
    assert run.task.skipped == {"no altitude": 10}
    last = run.of(imc.EntityState)[-1]
    assert last.state == imc.EntityState.State.FAULT
    assert last.description.startswith("no altitude (")


def test_nan_is_skipped_with_one_warning_a_second():
    feed = [m.replace(psi=math.nan) for m in still(50)]
    run = simulate(MUGDetectionCamera, feed=[*feed, *(m.replace(timestamp=3.0) for m in still(1))])
    assert run.task.skipped == {"no position or attitude": 50}
    assert len(run.log) == 3
    assert len(run.of(imc.EstimatedMugState)) == 1
    assert run.of(imc.EntityState)[-1].state == imc.EntityState.State.NORMAL


def test_an_altimeter_may_take_its_time_at_the_start():
    feed = [m.replace(alt=-1.0) for m in still(50)]
    begun = simulate(MUGDetectionCamera, feed=[m for m in feed if m.timestamp < 2.0])
    assert begun.log == []
    assert begun.task.skipped["no altitude"] > 0
    last = begun.of(imc.EntityState)[-1]
    assert (last.state, last.description) == (imc.EntityState.State.BOOT, "waiting for an altitude")
    assert simulate(MUGDetectionCamera, feed=[feed[0].replace(timestamp=2.5)]).log == ["no altitude (1 skipped)"]
    lost = simulate(MUGDetectionCamera, feed=[still(1)[0], feed[0].replace(timestamp=1.0)])
    assert lost.log == ["no altitude (1 skipped)"]


def test_upside_down_nothing_is_seen_and_nothing_is_wrong():
    run = simulate(MUGDetectionCamera, feed=still(5, phi=math.pi))
    assert run.of(imc.EstimatedMugState) == []
    assert run.of(imc.EntityState)[-1].state == imc.EntityState.State.NORMAL


def test_original_ini_keys_are_aliases():
    aliases = {alias for p in MUGDetectionCamera.parameters().values() for alias in p.aliases}
    assert aliases == {
        "Camera - Horizontal FOV",
        "Camera - Vertical FOV",
        "Camera - horizontal resolution",
        "Camera - vertical resolution",
    }


@pytest.mark.parametrize(
    ("parameters", "name"),
    [
        ({"horizontal_field_of_view": 190.0}, "Horizontal Field of View"),
        ({"vertical_field_of_view": -1.0}, "Vertical Field of View"),
        ({"horizontal_resolution": 0}, "Horizontal Resolution"),
        ({"vertical_resolution": -960}, "Vertical Resolution"),
        ({"mugs": ["1.0"]}, "World"),
        ({"mugs": ["a b"]}, "World"),
        ({"mount_orientation": [180.0]}, "Mount Orientation"),
        ({"fidelity": "Exact"}, "Fidelity"),
        ({"error_model": "Gauss"}, "Error Model"),
    ],
)
def test_bad_parameters(parameters, name):
    with pytest.raises(ParameterError) as caught:
        simulate(MUGDetectionCamera, **parameters)
    assert caught.value.name == name


@pytest.mark.parametrize("fidelity", ["Physical", "Original", "Original Code"])
@pytest.mark.parametrize("parameters", [{"horizontal_field_of_view": 0.0}, {"vertical_field_of_view": 180.0}])
def test_a_field_of_view_that_sees_nothing_is_said(parameters, fidelity):
    run = simulate(MUGDetectionCamera, [imc.EstimatedState(alt=10.0, z=3.0)], fidelity=fidelity, **parameters)
    assert run.of(imc.EstimatedMugState) == []
    assert run.task.entity.state is State.FAULT
    assert "field of view" in run.task.entity.description


def test_an_altitude_out_of_range_is_said():
    run = simulate(MUGDetectionCamera, [imc.EstimatedState(alt=5000.0)])
    assert run.of(imc.EstimatedMugState) == []
    assert run.task.entity.description.startswith("altitude out of range")


@pytest.mark.heavy
def test_default_vehicle_sees_its_glider_at_the_start_and_after_each_circle():
    run = simulate([EstimatedState, MUGDetectionCamera], seconds=260, seed=1)
    times = np.array([m.timestamp - run.vehicle.start_time for m in run.of(imc.EstimatedMugState)])
    passes = np.split(times, np.flatnonzero(np.diff(times) > 5.0) + 1)
    assert times[0] == 0.0
    assert len(passes) == 4
    assert all(len(p) > 40 for p in passes)
