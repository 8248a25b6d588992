"""Simulators.GPS and Simulators.DepthSensor against DUNE's sensor models."""

import math

import numpy as np
import pytest

import imc
from imc import coordinates
from runtime import ParameterError
from runtime.testing import simulate
from tasks.simulators.depth_sensor import DepthSensor
from tasks.simulators.gps import GPS

LAT, LON = 0.7188, -0.1519


def at(time, z, **fields):
    return imc.SimulatedState(timestamp=time, lat=LAT, lon=LON, z=z, **fields)


def test_a_fix_on_the_surface():
    truth = at(0.5, 0.05, height=10.0, x=100.0, y=-50.0, u=1.2, v=0.5, psi=-0.7)
    run = simulate(GPS, feed=[truth], seconds=1.5, start=1_767_225_600 + 3661)
    (fix,) = run.of(imc.GpsFix)
    lat, lon, height = coordinates.displace(LAT, LON, 10.0, 100.0, -50.0, 0.05)
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


def test_under_water_it_gets_worse_and_recovers():
    feed = [at(0.5, 0.0), at(1.5, 0.21), at(4.5, 0.19)]
    fixes = simulate(GPS, feed=feed, seconds=5.5).of(imc.GpsFix)
    assert [(m.validity, m.satellites) for m in fixes] == [(0x1FF, 8), (0, 0), (0, 0), (0, 0), (0x1FF, 8)]
    assert [m.hdop for m in fixes] == pytest.approx([0.9, 1.9, 2.9, 3.9, 0.9])
    assert [m.hacc for m in fixes] == pytest.approx([2.0, 3.0, 4.0, 5.0, 2.0])
    assert [m.sog for m in fixes[1:4]] == [0.0, 0.0, 0.0]
    assert fixes[2].lat == fixes[0].lat


def test_manual_fix_at_the_start_on_demand():
    (fix,) = simulate(GPS, initial_position=[41.185, -8.7062], seconds=1).of(imc.GpsFix)
    assert fix.type == imc.GpsFix.Type.MANUAL_INPUT
    assert (fix.lat, fix.lon) == pytest.approx((math.radians(41.185), math.radians(-8.7062)))


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


def test_seeds():
    feed = [at(k / 20, 5.0) for k in range(20)]
    assert simulate(DepthSensor, feed=feed, seed=1).packets == simulate(DepthSensor, feed=feed, seed=1).packets
    assert simulate(DepthSensor, feed=feed, seed=1).packets != simulate(DepthSensor, feed=feed, seed=2).packets


def test_bad_depth_parameters():
    with pytest.raises(ParameterError, match="Standard Deviation"):
        simulate(DepthSensor, standard_deviation=-1.0)
