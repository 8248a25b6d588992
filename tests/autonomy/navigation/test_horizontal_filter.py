"""The errors of the filter match its covariance."""

import math

import numpy as np
import pytest

from autonomy.navigation.horizontal_filter import EAST, NORTH, PSI, PSI_BIAS, R_BIAS, SIZE, HorizontalFilter, K, R, U, V

DT = 0.05
PROCESS = (1e-6, 1e-6, 1e-6, 1e-3, 1e-4, 1e-4, 1e-10, 5e-11, 1e-12)
INITIAL = (2.0, 2.0, 1e-4, 1e-4, 1.0, 1.0, 1e-4, 1e-4, 1.6e-8)
SURGE, SWAY, HEADING, RATE, FIX = 1e-4, 1e-4, 1e-4, 1e-4, 2.0
SURFACE, DIVE, AFTER = 20.0, 100.0, 20.0  # s


def fly(seed):
    """Squared Mahalanobis distances of the position at the end of a dive and at the end, and the errors there (m)."""
    random = np.random.default_rng(seed)
    state = HorizontalFilter(INITIAL, PROCESS, 1.0e-3)
    truth = np.zeros(SIZE)
    truth[[NORTH, EAST]] = random.normal(0.0, math.sqrt(2.0), 2)
    truth[[R_BIAS, PSI_BIAS]] = random.normal(0.0, 0.01, 2)
    noise = random.normal(size=(round((SURFACE + DIVE + AFTER) / DT), 10)).tolist()
    found = []
    for step, draws in enumerate(noise):
        time = step * DT
        psi, r, u, v = truth[2:6].tolist()
        wanted = 0.3 if 20.0 <= time % 40.0 < 25.0 else 0.0
        middle = psi + 0.5 * DT * r
        truth[NORTH] += DT * (u * math.cos(middle) - v * math.sin(middle))
        truth[EAST] += DT * (u * math.sin(middle) + v * math.cos(middle))
        truth[PSI] += DT * r
        truth[R] += 0.3 * (wanted - r) + 0.01 * draws[0]
        truth[U] += 0.02 * (1.5 - u) + 0.005 * draws[1]
        truth[V] += -0.1 * v + 0.01 * draws[2]
        state.predict(DT, 0.0, 0.0, 0.0)
        psi, r = truth[PSI] + truth[PSI_BIAS] + 0.01 * draws[3], truth[R] + truth[R_BIAS] + 0.01 * draws[4]
        state.update(psi - state.x[PSI] - state.x[PSI_BIAS], HEADING, (PSI, 1.0), (PSI_BIAS, 1.0))
        state.update(r - state.x[R] - state.x[R_BIAS], RATE, (R, 1.0), (R_BIAS, 1.0))
        if step % 4 == 0:
            state.update(truth[U] + 0.01 * draws[5] - state.x[U], SURGE, (U, 1.0))
            state.update(truth[V] + 0.01 * draws[6] - state.x[V], SWAY, (V, 1.0))
        if step % 20 == 0 and not SURFACE <= time < SURFACE + DIVE:
            state.update(truth[NORTH] + math.sqrt(FIX) * draws[7] - state.x[NORTH], FIX, (NORTH, 1.0))
            state.update(truth[EAST] + math.sqrt(FIX) * draws[8] - state.x[EAST], FIX, (EAST, 1.0))
        if step + 1 in (round((SURFACE + DIVE) / DT), len(noise)):
            error = truth[:2] - np.array(state.x[:2])
            covariance = np.array([row[:2] for row in state.p[:2]])
            found.append((float(error @ np.linalg.solve(covariance, error)), float(np.linalg.norm(error))))
    return found


@pytest.mark.heavy
def test_the_errors_are_those_that_the_covariance_promises():
    """The mean of twelve distances, each of two degrees of freedom, is from 1.03 to 3.28 in 95 of 100 cases."""
    flights = [fly(seed) for seed in range(12)]
    for moment in (0, 1):
        distances = [flight[moment][0] for flight in flights]
        assert 1.03 < sum(distances) / len(distances) < 3.28, distances
    denied = sum(flight[0][1] for flight in flights)
    assert sum(flight[1][1] for flight in flights) < denied


def test_a_dive_makes_it_less_sure_and_a_fix_surer():
    state = HorizontalFilter(INITIAL, PROCESS, 1.0e-3)
    state.x[U] = 1.5
    before = state.state_variance(EAST)
    for _ in range(400):
        state.predict(DT, 0.0, 0.0, 0.0)
    dived = state.state_variance(EAST)
    state.update(0.0, FIX, (EAST, 1.0))
    assert before < dived
    assert state.state_variance(EAST) < FIX
    assert state.x[NORTH] == pytest.approx(30.0)


def test_prediction_agrees_with_matrices():
    """P = F P Fᵀ + Q with the Jacobian of the motion from differences."""
    random = np.random.default_rng(1)
    state = HorizontalFilter(INITIAL, PROCESS, 1.0e-3)
    root = random.normal(size=(SIZE, SIZE))
    covariance = root @ root.T
    x = random.normal(size=SIZE)
    x[K] = 1.0e-3

    def moved(start):
        copy = HorizontalFilter(INITIAL, PROCESS, 1.0e-3)
        copy.x = list(start)
        copy.predict(DT, 0.2, -0.3, 0.4)
        return np.array(copy.x)

    jacobian = np.column_stack(
        [(moved(x + 1e-6 * unit) - moved(x - 1e-6 * unit)) / 2e-6 for unit in np.eye(SIZE)],
    )
    state.x, state.p = x.tolist(), covariance.tolist()
    state.predict(DT, 0.2, -0.3, 0.4)
    expected = jacobian @ covariance @ jacobian.T + np.diag(PROCESS)
    assert np.array(state.p) == pytest.approx(expected, abs=1e-6)


def test_updates_agree_with_matrices():
    random = np.random.default_rng(2)
    state = HorizontalFilter(INITIAL, PROCESS, 1.0e-3)
    root = random.normal(size=(SIZE, SIZE))
    covariance, x = root @ root.T, random.normal(size=SIZE)
    state.x, state.p = x.tolist(), covariance.tolist()
    h = np.zeros(SIZE)
    h[U], h[K] = 1.0, -1400.0
    state.update(0.7, 0.5, (U, 1.0), (K, -1400.0))
    gain = covariance @ h / (h @ covariance @ h + 0.5)
    assert np.array(state.x) == pytest.approx(x + 0.7 * gain)
    assert np.array(state.p) == pytest.approx(covariance - np.outer(gain, h @ covariance), abs=1e-6)


def test_the_motor_moves_surge_by_the_speed_per_rpm():
    """The same as with the matrix of the motion."""
    random = np.random.default_rng(3)
    state = HorizontalFilter(INITIAL, PROCESS, 1.0e-3)
    root = random.normal(size=(SIZE, SIZE))
    covariance = root @ root.T
    state.p = covariance.tolist()
    state.apply_rpm_change(400.0)
    motion = np.eye(SIZE)
    motion[U, K] = 400.0
    assert state.x[U] == pytest.approx(0.4)
    assert np.array(state.p) == pytest.approx(motion @ covariance @ motion.T)


def test_it_stays_sound_for_hours():
    """Ten thousand steps with every measurement: no variance becomes negative, no covariance asymmetric."""
    state = HorizontalFilter(INITIAL, PROCESS, 1.0e-3)
    for step in range(10000):
        state.predict(DT, 0.0, 0.05, 0.0)
        for index, variance in ((PSI, HEADING), (R, RATE), (U, SURGE), (V, SWAY)):
            state.update(1e-3 * math.sin(step), variance, (index, 1.0))
    covariance = np.array(state.p)
    assert np.abs(covariance - covariance.T).max() < 1e-9
    assert np.linalg.eigvalsh(covariance).min() > -1e-9
