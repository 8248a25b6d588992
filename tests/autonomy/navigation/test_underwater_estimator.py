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

    def __init__(self, **settings):
        self.log, self.now = Log(), 0.0
        self.inputs = SensorInputs(UnderwaterSettings(**settings))
        self.inputs.restart(self.now)
        self.estimator = UnderwaterEstimator(self.inputs)
        self.checks = SensorChecks(self.inputs, self.estimator, self.log, self.now)
        self.step(0.0)
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
