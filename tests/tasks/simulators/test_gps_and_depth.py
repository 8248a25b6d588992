"""Simulators.GPS and Simulators.DepthSensor against DUNE's sensor models."""

import math

import numpy as np
import pytest

import imc
from runtime import ParameterError, Task, periodic
from runtime.testing import simulate
from support import wgs84
from tasks.simulators.depth_sensor import DepthSensor
from tasks.simulators.gps import GPS

LAT, LON = 0.7188, -0.1519
START = 1_767_225_600
FAULT = imc.EntityState.State.FAULT


def at(time, z, **fields):
    return imc.SimulatedState(timestamp=time, lat=LAT, lon=LON, z=z, **fields)


def held(feed, seconds):
    """The states, each again every half second until the next."""
    found = []
    for state, end in zip(feed, [*(later.timestamp for later in feed[1:]), seconds], strict=True):
        times = np.arange(state.timestamp, end, 0.5)
        found += [state.replace(timestamp=time) for time in times.tolist()]
    return found


def test_a_fix_on_the_surface():
    truth = at(0.5, 0.05, height=10.0, x=100.0, y=-50.0, u=1.2, v=0.5, psi=-0.7)
    run = simulate(GPS, feed=[truth], seconds=1.5, start=1_767_225_600 + 3661)
    (fix,) = run.of(imc.GpsFix)
    lat, lon, height = wgs84.displace(LAT, LON, 10.0, 100.0, -50.0, 0.05)
    assert (fix.lat, fix.lon, fix.height) == pytest.approx((lat, lon, height), rel=1e-6)
    assert (fix.validity, fix.type, fix.satellites) == (0x1FF, imc.GpsFix.Type.STANDALONE, 8)
    assert (fix.sog, fix.cog, fix.hdop, fix.hacc) == pytest.approx((1.3, math.atan2(0.5, 1.2) - 0.7, 0.9, 2.0))
    assert (fix.utc_year, fix.utc_month, fix.utc_day) == (2026, 1, 1)
    assert fix.utc_time == pytest.approx(3662.0)
    states = [m.state for m in run.of(imc.EntityState)]
    assert (states[0], states[-1]) == (imc.EntityState.State.BOOT, imc.EntityState.State.NORMAL)


def test_speed_and_course_are_over_ground():
    truth = at(0.5, 0.05, u=1.0, psi=0.5 * math.pi, svx=1.0)
    (fix,) = simulate(GPS, feed=[truth], seconds=1.5).of(imc.GpsFix)
    assert (fix.sog, fix.cog) == pytest.approx((math.sqrt(2.0), 0.25 * math.pi))
    (fix,) = simulate(GPS, feed=[at(0.5, 0.05, u=0.01, v=0.01, psi=2.0)], seconds=1.5).of(imc.GpsFix)
    assert (fix.sog, fix.cog) == pytest.approx((0.01414, 2.0), rel=1e-3)


def test_velocity_and_heading_on_demand():
    truth = at(0.5, 0.05, u=1.0, w=0.1, psi=0.5 * math.pi, svx=0.5)
    run = simulate(GPS, feed=[truth], seconds=1.5, report_ground_velocity=True, report_yaw=True)
    (velocity,), (angles,) = run.of(imc.GroundVelocity), run.of(imc.EulerAngles)
    assert (velocity.validity, velocity.x, velocity.y, velocity.z) == pytest.approx((7, 1.0, -0.5, 0.1), abs=1e-6)
    assert (angles.psi, angles.phi) == pytest.approx((0.5 * math.pi, 0.0))
    assert simulate(GPS, feed=[truth], seconds=1.5).of(imc.GroundVelocity) == []


def test_only_a_state_that_a_fix_needs_is_checked():
    """100 states a second come for one fix."""
    run = simulate(GPS, feed=[at(0.5, math.nan), at(0.6, 0.05)], seconds=1.5)
    assert len(run.of(imc.GpsFix)) == 1
    assert FAULT not in [m.state for m in run.of(imc.EntityState)]


def test_under_water_it_gets_worse_and_recovers():
    feed = [at(0.5, 0.0), at(1.5, 0.21), at(4.5, 0.19)]
    fixes = simulate(GPS, feed=held(feed, 5.5), seconds=5.5).of(imc.GpsFix)
    assert [(m.validity, m.satellites) for m in fixes] == [(0x1FF, 8), (0, 0), (0, 0), (0, 0), (0x1FF, 8)]
    assert [m.hdop for m in fixes] == pytest.approx([0.9, 1.9, 2.9, 3.9, 0.9])
    assert [m.hacc for m in fixes] == pytest.approx([2.0, 3.0, 4.0, 5.0, 2.0])
    assert [m.sog for m in fixes[1:4]] == [0.0, 0.0, 0.0]
    assert fixes[2].lat == fixes[0].lat


def test_manual_fix_at_the_start_on_demand():
    (fix,) = simulate(GPS, initial_position=[41.185, -8.7062], seconds=1).of(imc.GpsFix)
    assert fix.type == imc.GpsFix.Type.MANUAL_INPUT
    assert (fix.lat, fix.lon) == pytest.approx((math.radians(41.185), math.radians(-8.7062)))


def north_of(fix):
    return wgs84.displacement(LAT, LON, 0.0, fix.lat, fix.lon, fix.height)[0]


def test_a_fix_is_as_old_as_the_latency():
    feed = [at(k / 10, 0.0, x=float(k)) for k in range(41)]
    run = simulate(GPS, feed=feed, seconds=4.05, latency=0.25, execution_frequency=2.0)
    fixes = run.of(imc.GpsFix)
    assert [north_of(fix) for fix in fixes] == pytest.approx([2, 7, 12, 17, 22, 27, 32, 37], abs=0.01)
    assert fixes[1].timestamp - run.vehicle.start_time == pytest.approx(1.0, abs=1e-3)
    assert fixes[2].utc_time - fixes[1].utc_time == pytest.approx(0.5, abs=1e-3)
    assert run.vehicle.start_time % 86400.0 + 0.75 == pytest.approx(fixes[1].utc_time, abs=1e-3)


class Jumping(Task):
    """The truth of a simulator whose clock is an hour fast until it is set after two seconds."""

    @periodic(10.0)
    def tick(self):
        late = self.now - self.vehicle.start_time > 2.0
        time = self.now if late else self.now + 3600.0
        self.publish(at(time, 0.0, x=2.0 if late else 1.0), keep_time=True)


def test_states_of_before_a_clock_was_set_back_are_forgotten():
    run = simulate([Jumping, (GPS, {"latency": 0.2})], seconds=5.5)
    assert [round(north_of(fix)) for fix in run.of(imc.GpsFix)] == [2, 2, 2]


def test_satellites_take_time_at_the_start_and_after_a_dive():
    feed = [at(0.5, 0.0), at(4.5, 1.0), at(6.5, 0.0)]
    run = simulate(GPS, feed=held(feed, 10.5), seconds=10.5, start_up_time=2.5, reacquisition_time=2.0)
    assert [m.validity != 0 for m in run.of(imc.GpsFix)] == [False, False, True, True] + [False] * 3 + [True] * 3
    assert "waiting for satellites" in [m.description for m in run.of(imc.EntityState)]


@pytest.mark.heavy
def test_the_position_wanders_as_told():
    feed = [at(0.5, 0.0)]
    drifting = {"position_drift": 5.0, "height_drift": 8.0, "drift_time": 20.0, "execution_frequency": 1.0}
    fixes = simulate(GPS, feed=held(feed, 6000.0), seconds=6000, seed=5, **drifting).of(imc.GpsFix)
    errors = np.array([wgs84.displacement(LAT, LON, 0.0, m.lat, m.lon, m.height) for m in fixes])
    independent = 6000 / 40.0
    assert errors.std(axis=0) == pytest.approx([5.0, 5.0, 8.0], rel=4 / math.sqrt(2 * independent))
    later = np.array([np.corrcoef(column[:-20], column[20:])[0, 1] for column in errors.T])
    assert later == pytest.approx(math.exp(-1.0), abs=4 / math.sqrt(independent))


def test_the_antenna_is_where_it_is_mounted():
    raised = {"device_position": [0.0, 0.0, -0.5], "report_ground_velocity": True}
    assert simulate(GPS, feed=[at(0.5, 0.6)], seconds=1.5, **raised).of(imc.GpsFix)[0].validity == 0x1FF
    rolling = at(0.5, 0.6, phi=0.5 * math.pi, p=0.1)
    run = simulate(GPS, feed=[rolling.replace(z=0.0)], seconds=1.5, **raised)
    (fix,) = run.of(imc.GpsFix)
    assert wgs84.displacement(LAT, LON, 0.0, fix.lat, fix.lon, fix.height) == pytest.approx((0.0, 0.5, 0.0), abs=1e-3)
    assert run.of(imc.GroundVelocity)[0].y == pytest.approx(0.05, abs=1e-6)


@pytest.mark.parametrize("position", [[41.0], [91.0, 0.0], [0.0, 181.0]])
def test_bad_initial_position(position):
    with pytest.raises(ParameterError) as caught:
        simulate(GPS, initial_position=position)
    assert caught.value.name == "Initial Position"


def test_without_truth_there_is_no_fix():
    run = simulate(GPS, feed=[at(0.5, math.nan)], seconds=3)
    assert run.of(imc.GpsFix) == []
    assert run.of(imc.EntityState)[-1].state == imc.EntityState.State.FAULT


def test_depth_has_its_noise_and_the_time_of_the_state():
    feed = [at(k / 20, 5.0) for k in range(4000)]
    depths = simulate(DepthSensor, feed=feed, seed=4, standard_deviation=0.1).of(imc.Depth)
    values = np.array([m.value for m in depths])
    assert len(values) == pytest.approx(2000, abs=2)
    assert values.std() == pytest.approx(0.1, rel=4.0 / math.sqrt(2 * len(values)))
    assert values.mean() == pytest.approx(5.0, abs=4 * 0.1 / math.sqrt(len(values)))
    run = simulate(DepthSensor, feed=[at(0.03, 1.0)], seconds=0.25)
    assert [m.timestamp - run.vehicle.start_time for m in run.of(imc.Depth)] == pytest.approx([0.03] * 2, abs=1e-6)


def test_depth_is_never_negative_nor_nan():
    feed = [at(0.0, 0.0), at(5.05, math.nan), at(6.05, 0.0)]
    depths = simulate(DepthSensor, feed=feed, seconds=10, seed=1).of(imc.Depth)
    assert 89 <= len(depths) <= 90
    assert min(m.value for m in depths) == 0.0
    assert max(m.value for m in depths) > 0.0


def test_pressure_is_that_of_the_water_above_and_of_the_air_with_the_noise_of_depth():
    feed = [at(k / 20, 10.0) for k in range(400)]
    run = simulate(DepthSensor, feed=feed, surface_pressure=1000.0, water_density=1030.0, water_temperature=4.5)
    per_meter = 1030.0 * 9.80665 / 100.0  # hPa
    for depth, pressure in zip(run.of(imc.Depth), run.of(imc.Pressure), strict=True):
        assert pressure.timestamp == depth.timestamp
        assert pressure.value == pytest.approx(1000.0 + per_meter * depth.value, abs=1e-3)
    assert len(run.of(imc.Temperature)) == pytest.approx(20, abs=1)
    assert {m.value for m in run.of(imc.Temperature)} == {4.5}


def test_seeds():
    feed = [at(k / 20, 5.0) for k in range(20)]
    assert simulate(DepthSensor, feed=feed, seed=1).packets == simulate(DepthSensor, feed=feed, seed=1).packets
    assert simulate(DepthSensor, feed=feed, seed=1).packets != simulate(DepthSensor, feed=feed, seed=2).packets


def test_bad_depth_parameters():
    with pytest.raises(ParameterError, match="Standard Deviation"):
        simulate(DepthSensor, standard_deviation=-1.0)


@pytest.mark.parametrize("field", ["lat", "lon", "height", "x", "z", "p", "q", "r", "psi", "u", "svy"])
def test_there_is_no_fix_from_a_state_that_is_not_finite(field):
    feed = [at(0.25 * k, 0.0) for k in range(8)]
    feed += [state.replace(timestamp=2.0 + state.timestamp, **{field: math.nan}) for state in feed]
    run = simulate(GPS, feed=feed, seconds=4.5, execution_frequency=4.0, device_position=[1.0, 0.0, 0.0])
    assert {fix.timestamp < START + 2.1 for fix in run.of(imc.GpsFix)} == {True}
    assert (run.task.entity.state, run.task.entity.description) == (FAULT, "SimulatedState makes no sense")


def test_there_is_no_fix_without_a_recent_state():
    run = simulate(GPS, feed=held([at(0.5, 0.0)], 2.2), seconds=20.0)
    assert [fix.timestamp - START for fix in run.of(imc.GpsFix)] == pytest.approx([1.0, 2.0, 3.0])
    assert (run.task.entity.state, run.task.entity.description) == (FAULT, "no recent SimulatedState")
    again = simulate(GPS, feed=[*held([at(0.5, 0.0)], 2.2), *held([at(8.5, 0.0)], 12.0)], seconds=11.5)
    assert again.of(imc.GpsFix)[-1].validity == 0x1FF
    assert again.task.entity.state == imc.EntityState.State.NORMAL


def test_the_heading_has_the_time_of_its_fix():
    run = simulate(GPS, feed=held([at(0.5, 0.0, psi=0.1)], 6.0), seconds=5.5, latency=2.0, report_yaw=True)
    fixes, angles = run.of(imc.GpsFix), run.of(imc.EulerAngles)
    assert len(fixes) == len(angles) == 3
    for fix, angle in zip(fixes, angles, strict=True):
        assert angle.time % 86400.0 == pytest.approx(fix.utc_time, abs=1e-3)


def test_what_is_drawn_at_the_start_cannot_be_changed_later():
    for name in ("Standard Deviation - Position Drift", "Standard Deviation - Height Drift", "Time Constant - Drift"):
        assert not GPS.parameters()[name].editable
