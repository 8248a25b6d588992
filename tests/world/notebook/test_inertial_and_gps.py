"""Accelerometer, gyroscope and GPS of the notebook, against exact motions and their noise."""

import numpy as np
import pytest

from support.rotations import rotation
from world.notebook import GPS, Accelerometer, Quadrotor, RateGyro

G = 9.80665


def column(*numbers):
    return np.array([numbers], dtype=float).T


def test_at_rest_it_feels_the_ground():
    sensor = Accelerometer("ideal")
    level, upside_down = Quadrotor(), Quadrotor(Phi=column(np.pi, 0, 0))
    for n in range(3):
        np.testing.assert_allclose(sensor.read(level, n, 0.01), column(0, 0, -G), atol=1e-12)
    np.testing.assert_allclose(Accelerometer("ideal").read(upside_down, 0, 0.01), column(0, 0, G), atol=1e-12)


def test_free_fall_feels_nothing():
    sensor, Ts = Accelerometer("ideal"), 0.01
    falling = [Quadrotor(v=column(0, 0, G * n * Ts)) for n in range(5)]
    readings = [sensor.read(quad, n, Ts) for n, quad in enumerate(falling)]
    np.testing.assert_allclose(readings[1:], np.zeros((4, 3, 1)), atol=1e-9)


def test_a_turn_presses_outwards_and_a_lever_arm_adds_to_it():
    Ts, r, u = 0.001, 0.5, 4.0
    for t, outward in (((0, 0, 0), r * u), ((0, 2.0, 0), r * u - r * r * 2.0)):
        sensor = Accelerometer("ideal", t=t)
        for n in range(1, 100):
            turning = Quadrotor(v=column(u, 0, 0), Phi=column(0, 0, r * n * Ts), omega=column(0, 0, r))
            reading = sensor.read(turning, n, Ts)
        np.testing.assert_allclose(reading, column(0, outward, -G), atol=2e-3)


def test_skipped_steps_are_measured_over():
    sensor = Accelerometer("ideal")
    sensor.read(Quadrotor(), 0, 0.01)
    np.testing.assert_allclose(sensor.read(Quadrotor(v=column(1, 0, 0)), 50, 0.01), column(2, 0, -G), atol=1e-9)
    np.testing.assert_allclose(sensor.read(Quadrotor(v=column(9, 0, 0)), 3, 0.01), column(0, 0, -G), atol=1e-9)


def test_rates_along_turned_axes():
    gyro = RateGyro("ideal", angles=(0, 0, np.pi / 2))
    quad = Quadrotor(omega=column(0.1, 0.2, 0.3))
    np.testing.assert_allclose(gyro.read(quad, 0, 0.01), column(0.2, -0.1, 0.3), atol=1e-12)


@pytest.mark.parametrize(
    ("sensor", "Ts", "sigma"),
    [
        (Accelerometer(), 0.01, 2.354e-2),
        (RateGyro(), 0.025, 5.519e-4),
        (Accelerometer("beard"), 0.01, 0.0025 * G),
        (Accelerometer("beard"), 1e-4, 0.0025 * G),
        (RateGyro("beard"), 0.25, np.radians(0.13)),
    ],
)
def test_noise_per_reading(sensor, Ts, sigma):
    readings = np.array([sensor.read(Quadrotor(), n, Ts) for n in range(4000)])
    assert np.std(np.diff(readings, axis=0)) / np.sqrt(2) == pytest.approx(sigma, rel=0.03)


def test_a_part_has_its_range_and_steps():
    sensor = Accelerometer("MPU-6000")
    sensor.read(Quadrotor(), 0, 0.01)
    reading = sensor.read(Quadrotor(v=column(100, 0, 0)), 1, 0.01)
    assert reading[0] == pytest.approx(16 * G)
    np.testing.assert_allclose(np.rint(reading * 2048 / G), reading * 2048 / G, atol=1e-6)


def test_one_seed_is_one_sensor():
    def readings(seed):
        return [Accelerometer(seed=seed).read(Quadrotor(), 0, 0.01).tolist(), GPS(seed=seed).read(Quadrotor(), 0, 0.01)]

    assert str(readings(3)) == str(readings(3)) != str(readings(4))


@pytest.mark.parametrize("sensor", [Accelerometer, RateGyro, GPS])
def test_unknown_parts(sensor):
    with pytest.raises(ValueError, match="'best' is not one of"):
        sensor("best")


@pytest.mark.parametrize("Ts", [0.0, -0.1, np.nan, np.inf])
def test_steps_have_a_length(Ts):
    with pytest.raises(ValueError, match="no length"):
        Accelerometer().read(Quadrotor(), 0, Ts)


def test_ideal_gps_with_an_antenna():
    quad = Quadrotor(column(10, 20, -5), column(3, 0, 0), column(0.1, 0.2, 1.0), column(0, 0, 0.5))
    reading = GPS("ideal", t=(0, 1, 0)).read(quad, 0, 0.01)
    r = np.array(rotation(0.1, 0.2, 1.0))
    np.testing.assert_allclose(reading.position, quad.r + r @ column(0, 1, 0))
    np.testing.assert_allclose(reading.velocity, r @ column(2.5, 0, 0), atol=1e-12)
    assert reading.fix == 3


@pytest.mark.heavy
def test_beard_reads_once_a_second_and_wanders():
    gps = GPS("beard")
    readings = [gps.read(Quadrotor(), n, 0.1) for n in range(21)]
    assert len({id(reading) for reading in readings}) == 3
    gps = GPS("beard")
    places = np.array([gps.read(Quadrotor(), n, 1.0).position.ravel() for n in range(20_000)])
    np.testing.assert_allclose(np.std(np.diff(places, axis=0), axis=0), [0.21, 0.21, 0.40], rtol=0.03)
    np.testing.assert_allclose(np.std(places, axis=0), [4.93, 4.93, 9.38], rtol=0.5)


def test_airsim_is_late_and_converges():
    gps, Ts = GPS("airsim"), 0.02
    readings = [gps.read(Quadrotor(r=column(n * Ts, 0, 0)), n, Ts) for n in range(400)]
    assert next(n * Ts for n, reading in enumerate(readings) if reading) == pytest.approx(1.0)
    assert readings[300].position[0] == pytest.approx(300 * Ts - 0.2)
    fixes = [reading.fix for reading in readings if reading]
    assert fixes == sorted(fixes)
    assert set(fixes) == {0, 2, 3}
    assert readings[-1].eph < 0.13


def test_no_fix_under_water():
    reading = GPS("ideal", max_depth=0.2).read(Quadrotor(r=column(0, 0, 0.3)), 0, 0.1)
    assert reading.fix == 0
    assert np.isnan(reading.position).all()
    assert GPS("ideal").read(Quadrotor(r=column(0, 0, 0.1)), 0, 0.1).fix == 3
