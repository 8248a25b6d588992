"""Simulators.IMU: kinematics, noise, edges."""

import math

import numpy as np
import pytest

import imc
from runtime import ParameterError, Task
from runtime.testing import START, simulate
from support.rotations import rotation, to_body
from tasks.simulators.estimated_state import EstimatedState
from tasks.simulators.imu import IMU
from world.bodies import LegsPattern, PatternMotion, lawn_mower_corners
from world.sensors import IMU_PARTS

G = 9.80665


def rest(seconds, rate=100, **fields):
    return [imc.SimulatedState(timestamp=k / rate, **fields) for k in range(round(seconds * rate) + 1)]


def test_at_rest_it_feels_gravity():
    run = simulate(IMU, feed=rest(0.1), generate_noise=False)
    assert len(run.of(imc.Acceleration)) == len(run.of(imc.AngularVelocity)) == len(run.of(imc.EulerAngles)) == 10
    for m in run.of(imc.Acceleration):
        assert (m.x, m.y, m.z) == pytest.approx((0.0, 0.0, -G))
        assert m.time == m.timestamp
    pitched = simulate(IMU, feed=rest(0.1, theta=0.3, phi=0.2), generate_noise=False).of(imc.Acceleration)[-1]
    assert (pitched.x, pitched.y, pitched.z) == pytest.approx(
        (G * math.sin(0.3), -G * math.cos(0.3) * math.sin(0.2), -G * math.cos(0.3) * math.cos(0.2)), abs=1e-5
    )


def test_in_free_fall_it_feels_nothing():
    fall = [imc.SimulatedState(timestamp=k / 100, w=G * k / 100) for k in range(10)]
    m = simulate(IMU, feed=fall, generate_noise=False).of(imc.Acceleration)[-1]
    assert (m.x, m.y, m.z) == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)


def test_a_changing_stream_is_felt():
    feed = [imc.SimulatedState(timestamp=k / 100, psi=math.pi / 2, svx=0.5 * k / 100) for k in range(10)]
    m = simulate(IMU, feed=feed, generate_noise=False).of(imc.Acceleration)[-1]
    assert (m.x, m.y, m.z) == pytest.approx((0.0, -0.5, -G), abs=1e-4)


@pytest.mark.heavy
def test_force_agrees_with_the_motion():
    """The error stays ten times below the noise of one sample (2.4e-2 m/s²), dives and turns included."""
    run = simulate(
        [
            (EstimatedState, {"pattern": "Lawn-mower", "leg_length": 20.0, "current_north": 0.3, "depth": 6.0}),
            (IMU, {"generate_noise": False}),
        ],
        seconds=60,
    )
    exact = PatternMotion(
        LegsPattern(lawn_mower_corners(20.0, 10.0, 4, 0.0), 1.5 / math.radians(15.0), 7.5), 0.0, (0.3, 0.0), 10.0
    )
    exact.speed, exact.depth_target = 1.5, 6.0
    velocities, attitudes = [(exact.vn, exact.ve, exact.vd)], [(0.0, 0.0, 0.0)]
    for _ in range(6000):
        exact.advance(0.01)
        velocities.append((exact.vn, exact.ve, exact.vd))
        attitudes.append((exact.phi, exact.theta, exact.psi))
    accelerations = np.gradient(np.array(velocities), 0.01, axis=0) - (0.0, 0.0, G)
    forces = run.of(imc.Acceleration)
    for k, m in enumerate(forces[:-1], start=1):
        expected = to_body(rotation(*attitudes[k]), tuple(accelerations[k]))
        assert (m.x, m.y, m.z) == pytest.approx(expected, abs=2.4e-3)
    turning = run.of(imc.AngularVelocity)[4000]
    assert turning.z != 0.0


def collect(run, kind):
    return np.array([(m.x, m.y, m.z) for m in run.of(kind)])


def test_noise_has_the_sigmas_of_the_rate():
    run = simulate(IMU, feed=rest(30.0), seed=3)
    n = len(run.of(imc.Acceleration))
    tolerance = 4.0 / math.sqrt(2 * 3 * n)
    assert collect(run, imc.Acceleration).std(axis=0).mean() == pytest.approx(2.354e-2, rel=tolerance)
    assert collect(run, imc.AngularVelocity).std(axis=0).mean() == pytest.approx(8.727e-4, rel=tolerance)
    angles = np.array([(m.phi, m.theta, m.psi) for m in run.of(imc.EulerAngles)])
    assert angles.std(axis=0).mean() == pytest.approx(math.radians(0.05), rel=tolerance)


def test_noise_depends_on_the_seed_alone():
    feed = rest(1.0)
    assert simulate(IMU, feed=feed, seed=1).packets == simulate(IMU, feed=feed, seed=1).packets
    assert simulate(IMU, feed=feed, seed=1).packets != simulate(IMU, feed=feed, seed=2).packets


def test_heading_and_rates_of_a_worse_one():
    quiet = {"angular_random_walk": 0.0, "gyro_bias_stability": 0.0, "euler_angles_noise": 0.0}
    run = simulate(IMU, feed=rest(60.0), seed=2, angular_velocity_noise=0.05, gyro_rate_bias=60.0, **quiet)
    rates = collect(run, imc.AngularVelocity)
    assert np.degrees(rates.std(axis=0)) == pytest.approx(0.05, rel=4 / math.sqrt(2 * len(rates)))
    angles = run.of(imc.EulerAngles)
    assert {m.psi_magnetic for m in angles} == {0.0}
    assert math.degrees(angles[-1].psi - angles[0].psi) == pytest.approx(1.0, rel=1e-3)
    offsets: list[float] = []
    for seed in range(60):
        first, *_ = simulate(IMU, feed=rest(0.05), seed=seed, heading_offset=2.0, **quiet).of(imc.EulerAngles)
        offsets.append(math.degrees(first.psi - first.psi_magnetic))
    assert np.std(offsets) == pytest.approx(2.0, rel=4 / math.sqrt(2 * len(offsets)))


def test_it_samples_at_its_own_rate():
    run = simulate(IMU, feed=rest(2.0), sampling_rate=25.0)
    times = [m.timestamp for m in run.of(imc.Acceleration)]
    assert len(times) == 50
    assert np.diff(times) == pytest.approx(0.04, abs=1e-6)


@pytest.mark.parametrize(("states", "rate"), [(10, 100), (100, 1000), (100, 40), (100, 30)])
def test_it_samples_at_any_rate_whatever_that_of_the_states(states, rate):
    run = simulate(IMU, feed=rest(2.0, rate=states, p=0.1), sampling_rate=rate, generate_noise=False)
    times = [m.time for m in run.of(imc.Acceleration)]
    assert len(times) == 2 * rate
    assert np.diff(times) == pytest.approx(1.0 / rate, abs=2e-6)
    assert [m.x for m in run.of(imc.AngularVelocity)] == pytest.approx([0.1] * 2 * rate)


def test_a_sample_is_the_mean_since_the_one_before():
    feed = [imc.SimulatedState(timestamp=k / 100, u=1.0 if k % 10 > 4 else 0.0, q=k / 100) for k in range(201)]
    run = simulate(IMU, feed=feed, sampling_rate=10.0, generate_noise=False)
    assert [m.x for m in run.of(imc.Acceleration)][1:] == pytest.approx([0.0] * 19, abs=1e-5)
    assert [m.y for m in run.of(imc.AngularVelocity)] == pytest.approx([0.1 * k - 0.05 for k in range(1, 21)], abs=1e-6)


def test_after_a_long_silence_it_starts_again():
    feed = [*rest(0.5), *(imc.SimulatedState(timestamp=60 + k / 100) for k in range(51))]
    times = [m.time for m in simulate(IMU, feed=feed).of(imc.Acceleration)]
    assert len(times) == 101
    assert max(np.diff(times)) == pytest.approx(59.5), "it measures as soon as there is a state"


def test_original_gives_true_attitude_and_writes_the_articles_block():
    run = simulate(IMU, feed=rest(0.5, psi=1.0), fidelity="Original", seed=1)
    assert {m.phi for m in run.of(imc.EulerAngles)} == {0.0}
    assert collect(run, imc.Acceleration).std() > 1e-2
    assert "acc_n: 1.4885e-02" in run.log[0]
    assert "g_norm: 9.81007" in run.log[0]


def test_bad_states_give_no_sample_and_are_counted():
    good = rest(0.05)
    bad = [
        imc.SimulatedState(timestamp=0.021, u=math.nan),
        imc.SimulatedState(timestamp=0.022, phi=math.inf),
        imc.SimulatedState(timestamp=0.03),
    ]
    run = simulate(IMU, feed=[*good, *bad], generate_noise=False, seconds=0.2)
    assert len(run.of(imc.Acceleration)) == 5
    assert run.task.dropped == 2
    states = [m.state for m in run.of(imc.EntityState)]
    assert imc.EntityState.State.FAULT in states
    assert states[-1] == imc.EntityState.State.NORMAL
    assert all(math.isfinite(m.x) for m in run.of(imc.Acceleration))


def test_ranges_saturate():
    feed = [imc.SimulatedState(timestamp=k / 100, r=1.0) for k in range(5)]
    run = simulate(IMU, feed=feed, generate_noise=False, gyro_range=30.0, accel_range=0.5)
    assert run.of(imc.AngularVelocity)[-1].z == pytest.approx(math.radians(30.0))
    assert run.of(imc.Acceleration)[-1].z == pytest.approx(-0.5 * G)


@pytest.mark.parametrize(
    ("parameters", "name"),
    [
        ({"angular_random_walk": -1.0}, "Angular Random Walk"),
        ({"gyro_bias_stability_tau": 0.0}, "Gyro Bias Stability Tau"),
        ({"sampling_rate": 0.0}, "Sampling Rate"),
        ({"fidelity": "Exact"}, "Fidelity"),
        ({"velocity_random_walk": math.nan}, "Velocity Random Walk"),
        ({"device_position": [1.0, 2.0]}, "Device Position"),
        ({"part": "BMI088", "gyro_range": 500.0}, "Gyro Range"),
        ({"part": "BMI088", "accel_bias_stability_tau": 10.0}, "Accel Bias Stability Tau"),
        ({"part": "BMI880"}, "Part"),
    ],
)
def test_bad_parameters(parameters, name):
    with pytest.raises(ParameterError) as caught:
        simulate(IMU, **parameters)
    assert caught.value.name == name


def test_it_feels_the_motion_of_its_place():
    """On a turntable, and while that starts to turn: centripetal and tangential acceleration at 0.5 m forward."""
    turning = [imc.SimulatedState(timestamp=k / 100, psi=2.0 * k / 100, r=2.0) for k in range(301)]
    off = {"generate_noise": False, "device_position": [0.5, 0.0, 0.0]}
    forces = collect(simulate(IMU, feed=turning, **off), imc.Acceleration)
    assert forces == pytest.approx(np.tile([-0.5 * 4.0, 0.0, -G], (300, 1)), abs=2e-3)
    starting = [imc.SimulatedState(timestamp=k / 100, r=0.1 * k / 100) for k in range(11)]
    assert collect(simulate(IMU, feed=starting, **off), imc.Acceleration)[:, 1] == pytest.approx(0.05, abs=1e-4)


def test_it_measures_along_its_own_axes():
    feed = rest(0.1, p=0.1, phi=0.0)
    run = simulate(IMU, feed=feed, generate_noise=False, device_orientation=[0.0, 90.0, 0.0])
    assert collect(run, imc.Acceleration)[-1] == pytest.approx((G, 0.0, 0.0), abs=1e-5)
    assert collect(run, imc.AngularVelocity)[-1] == pytest.approx((0.0, 0.0, 0.1), abs=1e-6)
    assert run.of(imc.EulerAngles)[-1].theta == 0.0


@pytest.mark.parametrize("part", ["MPU-6000", "ADIS16448", "BMI088"])
def test_a_part_has_the_noise_steps_and_range_of_its_data_sheet(part):
    fast = rest(40.0, r=math.radians(2500.0))
    run = simulate(IMU, feed=fast, part=part, seed=4)
    grade = IMU_PARTS[part]
    for kind, triad in ((imc.AngularVelocity, grade.gyroscope), (imc.Acceleration, grade.accelerometer)):
        values = collect(run, kind)
        steps = values / triad.resolution
        clipped = np.isclose(np.abs(values), triad.limit)
        assert np.abs(steps - np.round(steps))[~clipped].max() < 1e-3
        sigma = math.hypot(triad.density.white * 10.0, triad.resolution / math.sqrt(12.0))
        assert values[:, 0].std() == pytest.approx(sigma, rel=0.1)
    assert np.median(collect(run, imc.AngularVelocity)[:, 2]) == pytest.approx(grade.gyroscope.limit)


def test_devices_of_a_kind_differ_as_told():
    quiet = dict.fromkeys(("angular_random_walk", "gyro_bias_stability"), 0.0)
    spread = {"gyro_scale_error": 1.0, "gyro_misalignment": 0.5, "gyro_offset": 0.2}
    found = []
    for seed in range(80):
        run = simulate(IMU, feed=rest(0.05, r=1.0), seed=seed, **quiet, **spread)
        found.append(collect(run, imc.AngularVelocity)[-1])
        assert "gyroscopes (rad/s): scale" in run.log[0]
    offset = math.radians(0.2)
    sigmas = [math.hypot(math.radians(0.5), offset)] * 2 + [math.hypot(0.01, offset)]
    assert np.std(found, axis=0) == pytest.approx(sigmas, rel=4 / math.sqrt(2 * len(found)))
    assert np.mean(found, axis=0) == pytest.approx((0.0, 0.0, 1.0), abs=4 * max(sigmas) / math.sqrt(len(found)))
    exact = simulate(IMU, feed=rest(0.05, r=1.0), seed=1, generate_noise=False, **spread)
    assert collect(exact, imc.AngularVelocity)[-1] == pytest.approx((0.0, 0.0, 1.0))


def test_a_device_without_noise_has_no_errors_of_the_heading():
    run = simulate(IMU, feed=rest(1.0, psi=0.3), generate_noise=False, heading_offset=5.0, gyro_rate_bias=1e5)
    assert [m.psi for m in run.of(imc.EulerAngles)] == pytest.approx([0.3] * 100, abs=1e-6)


def test_no_sample_is_lost_when_a_parameter_changes():
    class Operator(Task):
        def start(self):
            self.after(0.505, self.choose)

        def choose(self):
            noise = imc.EntityParameter(name="Standard Deviation - Angular Velocity", value="0.1")
            self.publish(imc.SetEntityParameters(name="AHRS", params=(noise,)))

    run = simulate([(IMU, {"entity_label": "AHRS"}), (Operator, {})], feed=rest(1.0))
    assert run.task.angular_velocity_noise == 0.1
    assert len(run.of(imc.Acceleration)) == 100
    fixed = ("Part", "Generate Noise", "Standard Deviation - Heading Offset", "Gyro Offset", "Accel Scale Error")
    assert not any(IMU.parameters()[name].editable for name in fixed)


def test_after_a_gap_sampling_begins_again():
    feed = [imc.SimulatedState(timestamp=time) for time in (0.0, 0.05, 9.9, 9.95)]
    assert len(simulate(IMU, feed=feed, seconds=10.0, sampling_rate=1000.0).of(imc.Acceleration)) == 101
    slow = [imc.SimulatedState(timestamp=float(k)) for k in range(5)]
    assert len(simulate(IMU, feed=slow, seconds=5.0, sampling_rate=10.0).of(imc.Acceleration)) == 40


def test_states_that_come_seconds_apart_give_a_sample_each():
    """As on a computer that stands still again and again: attitude and rates are those of the state."""
    feed = [imc.SimulatedState(timestamp=1.5 * k, psi=0.3 * k, r=0.2, u=0.1 * k) for k in range(5)]
    run = simulate(IMU, feed=feed, sampling_rate=10.0, generate_noise=False)
    assert [m.time - START for m in run.of(imc.EulerAngles)] == pytest.approx([1.5, 3.0, 4.5, 6.0], abs=1e-6)
    assert [m.psi for m in run.of(imc.EulerAngles)] == pytest.approx([0.3, 0.6, 0.9, 1.2], abs=1e-6)
    assert [m.z for m in run.of(imc.AngularVelocity)] == pytest.approx([0.2] * 4, abs=1e-6)


FIELD = {"magnetic_field_strength": 0.45, "magnetic_inclination": 60.0, "hard_iron": [0.03, -0.02, 0.01]}


def test_it_measures_the_magnetic_field_at_its_own_rate():
    run = simulate(IMU, feed=rest(1.0), magnetic_field_noise=0.0, **FIELD)
    fields = run.of(imc.MagneticField)
    assert len(fields) == 10
    assert len(run.of(imc.Acceleration)) == 100
    for m in fields:
        vertical = 0.45 * math.sin(math.radians(60.0))
        assert (m.x, m.y, m.z) == pytest.approx((0.225 + 0.03, -0.02, vertical + 0.01), abs=1e-6)
        assert m.time == m.timestamp
    assert not simulate(IMU, feed=rest(0.5)).of(imc.MagneticField)


def test_a_magnetometer_leaves_the_noise_of_the_other_sensors_alone():
    without, with_field = (
        simulate(IMU, feed=rest(2.0)),
        simulate(IMU, feed=rest(2.0), magnetic_field_noise=2.0, **FIELD),
    )
    for kind in (imc.Acceleration, imc.AngularVelocity, imc.EulerAngles):
        assert with_field.of(kind) == without.of(kind)
    spread = np.std([m.x for m in with_field.of(imc.MagneticField)])
    assert 0.0005 < spread < 0.004


def test_it_subtracts_what_a_calibration_has_found_and_nothing_else():
    class Calibration(Task):
        """Sends a result to the compass, and others that are none of it."""

        def start(self):
            own = self.vehicle.entities.find("IMU")
            found = {"x": 0.03, "y": -0.02, "dst": self.system}
            self.after(0.5, self.publish, imc.MagneticField(**found, dst_ent=own.id))
            self.after(0.6, self.publish, imc.MagneticField(**found, dst_ent=self.entity.id))
            self.after(0.6, self.publish, imc.MagneticField(x=math.nan, dst=self.system, dst_ent=own.id))

    run = simulate([(IMU, {"magnetic_field_noise": 0.0, **FIELD}), Calibration], feed=rest(1.0))
    own = run.vehicle.entities.find("IMU").id
    measured = [(m.x, m.y) for m in run.of(imc.MagneticField) if m.src_ent == own]
    assert measured[0] == pytest.approx((0.255, -0.02), abs=1e-6)
    assert measured[-1] == pytest.approx((0.225, 0.0), abs=1e-6)


@pytest.mark.parametrize(("option", "size"), [("hard_iron", 2), ("soft_iron", 4)])
def test_iron_has_a_number_for_each_axis(option, size):
    with pytest.raises(ParameterError, match=f"has {size} numbers instead of"):
        simulate(IMU, feed=rest(0.1), **{option: [0.1] * size})
