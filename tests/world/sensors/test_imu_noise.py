"""The noise model compared with the vectors, the Allan variance and the articles' block."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from world.sensors import (
    IMU_PARTS,
    STANDARD_GRAVITY,
    NoiseDensity,
    NoisyTriad,
    StandardNormals,
    specific_force,
    vins_parameters,
)

G = STANDARD_GRAVITY
DATA = Path(__file__).parents[2] / "data" / "sensors"
GYROSCOPE = NoiseDensity.from_gyroscope_datasheet(0.3, 4.6, 500.0)
ACCELEROMETER = NoiseDensity.from_accelerometer_datasheet(0.24, 36.0, 800.0)


def rows(name):
    return json.loads((DATA / f"{name}.json").read_text())


def matrix(w, x, y, z):
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


@pytest.mark.parametrize("row", rows("imu_specific_force"))
def test_specific_force(row):
    given = row["in"]
    got = specific_force(matrix(*given["q_nb"]), tuple(given["a_ned"]), given["g"])
    assert got == pytest.approx(row["specific_force_body"], abs=1e-9, rel=1e-9)


@pytest.mark.parametrize("row", rows("imu_sigmas"))
def test_sigmas_per_sample(row):
    assert GYROSCOPE.sample_sigmas(row["dt"]) == pytest.approx((row["gyro"], row["gyro_bias_step"]), rel=1e-9)
    assert ACCELEROMETER.sample_sigmas(row["dt"]) == pytest.approx((row["acc"], row["acc_bias_step"]), rel=1e-9)


def test_shortest_interval_bounds_the_noise():
    assert GYROSCOPE.sample_sigmas(0.0) == GYROSCOPE.sample_sigmas(1e-3)


def record(density, seconds, rate, seed):
    triad, draws = NoisyTriad(density), StandardNormals(np.random.default_rng(seed), 6)
    return np.array([triad.add_noise((0.0, 0.0, 0.0), 1.0 / rate, next(draws)) for _ in range(seconds * rate)])


def allan(samples, rate, tau):
    """Overlapping Allan deviation of each column (IEEE Std 952-1997, annex C)."""
    m = round(tau * rate)
    angle = np.vstack([np.zeros((1, samples.shape[1])), np.cumsum(samples, axis=0) / rate])
    second = angle[2 * m :] - 2.0 * angle[m:-m] + angle[: -2 * m]
    return np.sqrt(np.mean(second**2, axis=0) / (2.0 * tau**2))


SHEETS = {  # °/√h, °/h; mg/√Hz, µg
    "MPU-6000": (0.3, 4.6, 0.4, 36.0),
    "ADIS16448": (0.66, 14.5, 0.187, 250.0),
    "BMI088": (0.84, 2.0, 0.175, 36.0),
}


def test_each_part_has_a_sheet():
    assert SHEETS.keys() == IMU_PARTS.keys()


@pytest.mark.heavy
@pytest.mark.parametrize("part", SHEETS)
def test_the_allan_deviation_of_a_part_has_its_minimum_at_the_stability_of_the_data_sheet(part):
    arw, drift, vrw, wander = SHEETS[part]
    for triad, white, stability in (
        (IMU_PARTS[part].gyroscope, math.radians(arw) / 60.0, math.radians(drift) / 3600.0),
        (IMU_PARTS[part].accelerometer, vrw * 1e-3 * G, wander * 1e-6 * G),
    ):
        middle, count = triad.density.settling_time, 80_000
        rate = 40.0 / middle  # so that few samples tell; the noise is the same at any rate
        noisy, draws = NoisyTriad(triad.density), StandardNormals(np.random.default_rng(5), 6)
        samples = np.array([noisy.add_noise((0.0, 0.0, 0.0), 1.0 / rate, next(draws)) for _ in range(count)])
        curve = {tau: math.sqrt(np.mean(allan(samples, rate, tau) ** 2)) for tau in middle * 2.0 ** np.arange(-3, 3)}
        assert min(curve.values()) == pytest.approx(stability, rel=0.05)
        assert triad.density.white == pytest.approx(white)
        for tau, measured in curve.items():
            assert measured == pytest.approx(triad.density.allan_deviation(tau), rel=0.08)
        least = triad.density.allan_deviation(middle)
        assert least == pytest.approx(stability)
        assert all(triad.density.allan_deviation(middle * r) > least for r in (0.3, 0.7, 0.95, 1.05, 1.5, 5.0))


@pytest.mark.parametrize("part", SHEETS)
@pytest.mark.parametrize("hours", [1.0, 10.0])
def test_the_bias_of_a_part_stays_within_twice_the_stability_of_the_data_sheet(part, hours):
    _, drift, _, wander = SHEETS[part]
    for triad, stability in (
        (IMU_PARTS[part].gyroscope, math.radians(drift) / 3600.0),
        (IMU_PARTS[part].accelerometer, wander * 1e-6 * G),
    ):
        steps, random = 60, np.random.default_rng(3)
        after = []
        for _ in range(60):
            noisy = NoisyTriad(triad.density)
            for draws in random.standard_normal((steps, 6)).tolist():
                noisy.add_noise((0.0, 0.0, 0.0), 3600.0 * hours / steps, draws)
            after.extend(noisy.add_noise((0.0, 0.0, 0.0), 1.0, [0.0] * 6))
        assert np.std(after) < 2.0 * stability
        assert np.std(after) > 0.5 * stability


def test_a_sensor_without_bias_instability_has_white_noise_only():
    density = NoiseDensity.from_bias_stability(1e-3, 0.0)
    assert density == NoiseDensity(1e-3, 0.0)
    assert (density.settling_time, density.sample_sigmas(0.01)) == (math.inf, pytest.approx((0.01, 0.0)))


def test_the_bias_keeps_its_spread_at_any_interval():
    """Steps of the exact discrete process: a hundred short ones spread as much as one long one."""
    density = IMU_PARTS["ADIS16448"].gyroscope.density
    long = density.memory
    kept, spread = 1.0, 0.0
    for _ in range(100):
        share, (_, step) = density.share_kept(long / 100), density.sample_sigmas(long / 100)
        kept, spread = kept * share, spread * share**2 + step**2
    assert kept == pytest.approx(density.share_kept(long))
    assert math.sqrt(spread) == pytest.approx(density.sample_sigmas(long)[1])
    assert density.sample_sigmas(1e-3)[1] == pytest.approx(density.walk * math.sqrt(1e-3), rel=1e-4)


@pytest.mark.heavy
@pytest.mark.parametrize(("density", "column"), [(GYROSCOPE, "gyro"), (ACCELEROMETER, "acc")])
def test_allan_deviation(density, column):
    seconds, rate = 3600, 100
    samples = record(density, seconds, rate, seed=7)
    for row in rows("imu_allan"):
        tau = row["tau"]
        measured = math.sqrt(np.mean(allan(samples, rate, tau) ** 2))
        assert abs(measured / row[column] - 1.0) <= 4.0 / math.sqrt(6.0 * seconds / tau)
    for tau in (30.0, 100.0):
        expected = math.sqrt(density.white**2 / tau + density.walk**2 * tau / 3.0)
        measured = math.sqrt(np.mean(allan(samples, rate, tau) ** 2))
        assert abs(measured / expected - 1.0) <= 4.0 / math.sqrt(6.0 * seconds / tau)
    white = np.diff(samples, axis=0)[::2]
    correlation = np.corrcoef(white.T)[np.triu_indices(3, 1)]
    assert np.all(np.abs(correlation) < 4.0 / math.sqrt(len(white)))
    kurtosis = np.mean(white**4) / np.mean(white**2) ** 2
    assert abs(kurtosis - 3.0) < 0.05


def test_first_sample_has_the_bias_of_before_its_step():
    triad = NoisyTriad(NoiseDensity(0.0, 2.0))
    assert triad.add_noise((1.0, 2.0, 3.0), 4.0, [9.0, 9.0, 9.0, 1.0, 1.0, 1.0]) == (1.0, 2.0, 3.0)
    assert triad.add_noise((1.0, 2.0, 3.0), 4.0, [9.0] * 6) == (5.0, 6.0, 7.0)


def test_vins_block_is_the_articles():
    assert vins_parameters(GYROSCOPE, ACCELEROMETER, 0.025).splitlines() == [
        "acc_n: 1.4885e-02",
        "gyr_n: 5.5192e-04",
        "acc_w: 1.9736e-06",
        "gyr_w: 1.5769e-07",
        "g_norm: 9.81007",
    ]
