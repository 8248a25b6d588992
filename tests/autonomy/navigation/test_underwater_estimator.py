"""The parts of underwater navigation together, without a task or a vehicle."""

import math

import pytest

import imc
from autonomy.navigation import EAST, NORTH, SensorChecks, SensorInputs, UnderwaterEstimator, UnderwaterSettings

FIX = imc.GpsFix(validity=0x1FF, lat=0.7, lon=-0.15, height=50.0, hacc=2.0, hdop=0.9, sog=0.0)


class Log:
    def __init__(self):
        self.texts = []

    def warning(self, text):
        self.texts.append(text)


class Vehicle:
    """Navigation that moves ahead at 1 m/s at a depth of 1 m, after a fix at the surface."""

    def __init__(self, depth=0.0, **settings):
        self.log, self.now = Log(), 0.0
        self.inputs = SensorInputs(UnderwaterSettings(**settings))
        self.inputs.restart(self.now)
        self.estimator = UnderwaterEstimator(self.inputs)
        self.checks = SensorChecks(self.inputs, self.estimator, self.log, self.now)
        self.step(depth)
        self.estimator.begin(FIX)

    def step(self, depth, heading=0.3, surge=1.0):
        self.now += 0.05
        self.inputs.receive_attitude(self.now, 0.0, 0.0, heading)
        self.inputs.receive_rates(self.now, 0.0, 0.0, 0.0)
        self.inputs.receive_depth(self.now, depth)
        self.inputs.receive_velocity(self.now, imc.GroundVelocity(validity=7, x=surge))
        self.estimator.vertical.predict(0.05)
        new_rates, new_attitude = self.inputs.rates.update(), self.checks.update_attitude(self.now)
        self.checks.update_depth(self.now, 0.05)
        if self.estimator.position is not None:
            self.estimator.advance(self.estimator.position, self.now, 0.05, new_attitude, new_rates)


def test_the_position_follows_the_velocity_over_ground():
    vehicle = Vehicle()
    for _ in range(400):
        vehicle.step(1.0)
    x = vehicle.estimator.position.filter.x
    assert (x[NORTH], x[EAST]) == pytest.approx((20.0 * math.cos(0.3), 20.0 * math.sin(0.3)), abs=0.5)
    assert vehicle.estimator.vertical.depth == pytest.approx(1.0, abs=0.05)
    assert vehicle.checks.fault(vehicle.now) == ""
    assert vehicle.checks.status(vehicle.now) == "active without altitude"


def test_a_heading_that_jumps_is_rejected_until_it_stays():
    vehicle = Vehicle()
    for _ in range(20):
        vehicle.step(1.0)
    vehicle.step(1.0, heading=1.5)
    assert vehicle.inputs.euler.value[2] == pytest.approx(0.3)
    for _ in range(30):
        vehicle.step(1.0, heading=1.5)
    assert vehicle.inputs.euler.value[2] == pytest.approx(1.5)
    assert vehicle.log.texts == ["the attitude has jumped and stays there"]


def test_a_velocity_beyond_the_settings_is_rejected_with_a_reason():
    inputs = SensorInputs(UnderwaterSettings(dvl_largest=(2.0, 1.0)))
    rejection = inputs.receive_velocity(1.0, imc.GroundVelocity(validity=7, x=3.0))
    assert (rejection.reason, rejection.value) == (imc.DvlRejection.Reason.ABS_THRESHOLD_X, 3.0)
    inputs.apply_settings(UnderwaterSettings())
    assert inputs.receive_velocity(1.1, imc.GroundVelocity(validity=7, x=3.0)) is None


def test_a_missing_sensor_is_a_fault():
    vehicle = Vehicle(depth_timeout=5.0)
    assert vehicle.checks.fault(vehicle.now + 4.0) == ""
    assert vehicle.checks.fault(vehicle.now + 6.0) == "depth is missing"


def drifting(rate, seconds, vehicle=None, **settings):
    """The fault after `seconds` at 1 m/s with a depth that drifts by `rate` (m/s), and when it began (s)."""
    vehicle, since = vehicle or Vehicle(10.0, **settings), math.inf
    for tick in range(round(20.0 * seconds)):
        vehicle.step(10.0 + rate * 0.05 * tick)
        if vehicle.checks.fault(vehicle.now):
            since = min(since, vehicle.now)
    return vehicle.checks.fault(vehicle.now), since


@pytest.mark.heavy
@pytest.mark.computing
def test_a_slow_drift_of_the_depth_adds_up_and_a_misaligned_velocity_log_does_not():
    for rate in (0.03, -0.03, 0.06):
        fault, since = drifting(rate, 120.0)
        assert fault == "depth drifts away from the vertical speed"
        assert since * (abs(rate) - 0.011) == pytest.approx(2.0, abs=0.15)
    assert drifting(0.008, 600.0) == ("", math.inf)
    assert drifting(0.03, 300.0, dvl_misalignment=math.radians(2.0)) == ("", math.inf)


def test_a_fix_at_the_surface_ends_a_drift_and_a_depth_above_the_surface_is_a_fault():
    vehicle = Vehicle(10.0)
    assert drifting(0.05, 60.0, vehicle)[0] == "depth drifts away from the vertical speed"
    assert vehicle.checks.evaluate_fix(vehicle.now, FIX, submerged=False)
    for _ in range(240):
        vehicle.step(13.0)
    assert vehicle.checks.fault(vehicle.now) == ""
    vehicle = Vehicle(-2.0)
    for _ in range(120):
        vehicle.step(-2.0)
    assert vehicle.checks.fault(vehicle.now) == "depth is above the surface"
