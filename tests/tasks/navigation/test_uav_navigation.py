"""Navigation of a UAV with hand-made sensor data, and with simulated sensors for several seeds."""

import math

import numpy as np
import pytest

import imc
from autonomy.navigation import pressure_altitude
from runtime import State, Task
from runtime.testing import simulate
from support.wgs84 import displacement
from tasks.navigation.uav.navigation import GRAVITY, Navigation
from tasks.simulators.barometer import Barometer
from tasks.simulators.gps import GPS
from tasks.simulators.imu import IMU
from tasks.simulators.uav import UAV
from world.bodies import Airframe

LAT, LON = math.radians(41.185), math.radians(-8.7062)
FIX = imc.GpsFix(validity=0x1FF, lat=LAT, lon=LON, height=60.0, hacc=0.85, type=imc.GpsFix.Type.STANDALONE)
ANY = {"ahrs": "", "barometer": ""}


def sensors(seconds, *, fix=FIX, attitude=True, pressure=1000.0, force=(0.0, 0.0, -GRAVITY), start=0.0):
    for tick in range(round(start * 20), round((start + seconds) * 20)):
        time = tick * 0.05 + 0.01
        if attitude:
            yield imc.EulerAngles(timestamp=time, psi=1.0)
            yield imc.AngularVelocity(timestamp=time, z=0.1)
            yield imc.Acceleration(timestamp=time, x=force[0], y=force[1], z=force[2])
        if pressure is not None:
            yield imc.Pressure(timestamp=time, value=pressure)
        if fix is not None and tick % 4 == 0:
            yield fix.replace(timestamp=time)


class Bursts(Task):
    """Rolls to and fro, and publishes what it has sampled since the last time, as on a busy computer."""

    def start(self):
        self.sampled = self.now
        self.after(0.1, self.catch_up)

    def catch_up(self):
        while self.sampled < self.now:
            self.sampled += 0.01
            turn = math.tau * 0.9
            roll, rate = (0.35 * math.sin(turn * self.sampled), 0.35 * turn * math.cos(turn * self.sampled))
            for sample in (
                imc.AngularVelocity(timestamp=self.sampled, x=rate),
                imc.EulerAngles(timestamp=self.sampled, phi=roll, psi=1.0),
            ):
                self.publish(sample, keep_time=True)
        self.after(self.random.uniform(0.05, 0.19), self.catch_up)


def test_samples_that_come_in_bursts_are_compared_by_their_own_time():
    feed = sensors(30.0, attitude=False)
    run = simulate([Bursts, (Navigation, ANY)], feed=feed)
    assert not [s.description for s in run.of(imc.EntityState) if "turn rate" in s.description]


def test_it_begins_with_the_mean_of_the_first_fixes():
    run = simulate(Navigation, feed=sensors(3.0), **ANY)
    last = run.of(imc.EstimatedState)[-1]
    assert (last.lat, last.lon, last.height) == (pytest.approx(LAT, abs=1e-12), pytest.approx(LON, abs=1e-12), 60.0)
    assert (last.x, last.y, last.z) == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert (last.psi, last.r, last.depth) == pytest.approx((1.0, 0.1, -1.0))
    assert run.of(imc.EstimatedState)[0].timestamp - run.vehicle.start_time > 1.7
    assert run.task.entity.state is State.NORMAL


def test_the_mean_of_longitudes_at_the_date_line_is_there():
    def both_sides(message):
        if not isinstance(message, imc.GpsFix):
            return message
        return message.replace(lon=math.copysign(math.pi - 1e-8, 1.0 - message.timestamp))

    last = simulate(Navigation, feed=map(both_sides, sensors(3.0)), **ANY).of(imc.EstimatedState)[-1]
    assert abs(last.lon) == pytest.approx(math.pi, abs=1.1e-8)
    assert math.hypot(last.x, last.y) < 0.2


def test_the_reference_is_of_the_last_fixes_where_the_rest_comes_later():
    moved = FIX.replace(lat=LAT + 1e-6)
    feed = [*sensors(4.0, attitude=False), *sensors(4.0, start=4.0, fix=moved, attitude=False)]
    run = simulate(Navigation, feed=[*feed, *sensors(1.0, start=8.0, fix=moved)], **ANY)
    assert run.of(imc.EstimatedState)[0].lat == pytest.approx(LAT + 1e-6, abs=1e-12)


@pytest.mark.parametrize(
    ("missing", "description"),
    [({"fix": None}, "waiting for GPS fix"), ({"attitude": False}, "waiting for attitude and pressure")],
)
def test_it_waits_and_says_for_what(missing, description):
    run = simulate(Navigation, feed=sensors(4.0, **missing), **ANY)
    assert run.of(imc.EstimatedState) == []
    assert (run.task.entity.state, run.task.entity.description) == (State.BOOT, description)


@pytest.mark.parametrize(
    ("missing", "seconds", "description"),
    [
        ({"fix": None}, 6.0, "GPS fixes are missing"),
        ({"pressure": None}, 3.0, "pressure is missing"),
        ({"attitude": False}, 2.0, "attitude is missing"),
    ],
)
def test_a_sensor_that_falls_silent_is_an_error(missing, seconds, description):
    run = simulate(Navigation, feed=[*sensors(3.0), *sensors(seconds, start=3.0, **missing)], **ANY)
    assert (run.task.entity.state, run.task.entity.description) == (State.ERROR, description)
    if "attitude" in missing:
        assert run.of(imc.EstimatedState)[-1].timestamp - run.vehicle.start_time < 4.1


def test_accelerations_move_it_between_fixes():
    thrust = [*sensors(3.0), *sensors(2.0, start=3.0, fix=None, force=(1.0, 0.0, -GRAVITY))]
    last = simulate(Navigation, feed=thrust, **ANY).of(imc.EstimatedState)[-1]
    assert (last.u, last.v) == pytest.approx((2.0, 0.0), abs=0.1)
    assert (last.vx, last.vy) == pytest.approx((2.0 * math.cos(1.0), 2.0 * math.sin(1.0)), abs=0.1)
    assert math.hypot(last.x, last.y) == pytest.approx(2.0, abs=0.2)


def test_a_lower_pressure_is_a_height():
    assert pressure_altitude(1013.25) == 0.0
    assert pressure_altitude(898.74) == pytest.approx(1000.0, abs=0.2)
    climb = pressure_altitude(998.8) - pressure_altitude(1000.0)
    higher = FIX.replace(height=FIX.height + climb)
    feed = [*sensors(3.0), *sensors(30.0, start=3.0, pressure=998.8, fix=higher)]
    last = simulate(Navigation, feed=feed, **ANY).of(imc.EstimatedState)[-1]
    assert last.z == pytest.approx(-climb, abs=0.1)
    assert last.alt == pytest.approx(-last.z)


def test_a_pressure_that_jumps_while_gps_does_not_keeps_the_height():
    run = simulate(Navigation, feed=[*sensors(3.0), *sensors(30.0, start=3.0, pressure=998.8)], **ANY)
    assert run.of(imc.EstimatedState)[-1].z == pytest.approx(0.0, abs=0.3)
    assert "pressure has jumped by -10 m" in run.log


def test_fixes_that_contradict_are_believed_when_they_go_on():
    def run(count):
        far = FIX.replace(lat=LAT + 1e-5)
        return simulate(Navigation, feed=[*sensors(3.0), *sensors(0.2 * count, start=3.0, fix=far)], **ANY)

    assert run(3).of(imc.EstimatedState)[-1].x == pytest.approx(0.0, abs=0.1)
    moved = run(6)
    assert moved.of(imc.EstimatedState)[-1].x == pytest.approx(63.6, abs=0.5)
    assert any("is reset to theirs" in text for text in moved.log)


def test_fixes_that_are_none_are_refused_and_it_is_said():
    odd = [FIX.replace(timestamp=2.5, validity=0), FIX.replace(timestamp=2.6, hacc=50.0)]
    odd += [FIX.replace(timestamp=2.7, lat=math.nan)]
    nowhere = FIX.replace(timestamp=0.0, height=math.inf)
    run = simulate(Navigation, feed=[nowhere, *sensors(2.4), *odd], **ANY)
    reasons = imc.GpsFixRejection.Reason
    found = [m.reason for m in run.of(imc.GpsFixRejection)]
    assert found == [reasons.INVALID, reasons.INVALID, reasons.ABOVE_MAX_HACC, reasons.INVALID]
    state = run.of(imc.EstimatedState)[-1]
    assert (state.x, state.height) == pytest.approx((0.0, FIX.height), abs=0.1)


def test_a_fix_of_unknown_height_corrects_the_position():
    flat = FIX.replace(lat=LAT + 2e-6, height=math.nan)
    run = simulate(Navigation, feed=[*sensors(3.0), *sensors(30.0, start=3.0, fix=flat)], **ANY)
    state = run.of(imc.EstimatedState)[-1]
    assert not run.of(imc.GpsFixRejection)
    assert (state.x, state.z, state.height) == pytest.approx((12.7, 0.0, FIX.height), abs=0.3)


def test_it_waits_for_a_height_before_it_starts():
    flat = FIX.replace(height=math.nan)
    run = simulate(Navigation, feed=sensors(3.0, fix=flat), **ANY)
    assert not run.of(imc.EstimatedState)
    assert (run.task.entity.state, run.task.entity.description) == (State.BOOT, "waiting for GPS height")
    run = simulate(Navigation, feed=[*sensors(3.0, fix=flat), *sensors(3.0, start=3.0)], **ANY)
    assert run.of(imc.EstimatedState)[-1].height == pytest.approx(FIX.height, abs=0.1)


def test_samples_that_are_no_numbers_change_nothing():
    nan = math.nan
    odd = [imc.EulerAngles(phi=nan), imc.AngularVelocity(x=nan), imc.Acceleration(y=nan), imc.Pressure(value=nan)]
    feed = [*sensors(3.0), *(message.replace(timestamp=3.0) for message in odd)]
    last = simulate(Navigation, feed=feed, seconds=3.2, **ANY).of(imc.EstimatedState)[-1]
    assert all(math.isfinite(value) for value in last.to_dict().values() if isinstance(value, float))


def flight(seed):
    """Squared errors of north, east, down over their variances, in a flight to and fro."""
    hover, rng = Airframe().hover_speed, np.random.default_rng(seed)
    feed = [imc.SetThrusterActuation(timestamp=6.0, value=1.05 * hover)]
    for time in range(9, 50, 2):
        roll, pitch = rng.uniform(-0.2, 0.2, 2).tolist()
        rotors = hover / math.sqrt(math.cos(roll) * math.cos(pitch))
        feed += [imc.DesiredRoll(timestamp=time, value=roll), imc.DesiredPitch(timestamp=time, value=pitch)]
        feed += [imc.SetThrusterActuation(timestamp=time, value=rotors)]
    receiver = {"position_noise": 0.6, "height_noise": 1.2, "initial_position": [41.185, -8.7062], "hacc": 0.85}
    gps, imu = (GPS, receiver | {"execution_frequency": 5.0}), (IMU, {"sampling_rate": 50.0})
    frame = UAV, {"command_timeout": 10.0}
    run = simulate([frame, gps, imu, Barometer, (Navigation, ANY)], feed=feed, seconds=50.0, seed=seed)
    truth = {round(m.timestamp, 2): m for m in run.of(imc.SimulatedState)}
    found = []
    for state, sigma in zip(run.of(imc.EstimatedState), run.of(imc.NavigationUncertainty), strict=True):
        true = truth[round(state.timestamp, 2)]
        north, east, _ = displacement(true.lat, true.lon, 0.0, state.lat, state.lon, 0.0)
        error = state.x + north - true.x, state.y + east - true.y, state.z - true.z
        found.append([e * e / s for e, s in zip(error, (sigma.x, sigma.y, sigma.z), strict=True)])
    return np.mean(found[200:], axis=0)


@pytest.mark.heavy
def test_errors_are_as_large_as_it_says():
    north, east, down = np.mean([flight(seed) for seed in range(6)], axis=0)
    assert 0.6 < 0.5 * (north + east) < 1.4
    assert down < 1.5
