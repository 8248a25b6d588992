"""The filter of position, velocity and accelerometer bias."""

import numpy as np
import pytest

from autonomy.navigation import InertialFilter


def test_the_filter_is_the_textbook_one():
    f = InertialFilter(1, 0.3, 0.05, (2.0, 1.0, 0.5))
    p, x = np.diag([2.0, 1.0, 0.5]), np.zeros(3)
    for step in range(50):
        dt, a = 0.07, 0.1 * step
        transition = np.array([[1, dt, -dt * dt / 2], [0, 1, -dt], [0, 0, 1]])
        q = 0.09 * dt
        noise = np.array([[q * dt * dt / 3, q * dt / 2, 0], [q * dt / 2, q, 0], [0, 0, 0.0025 * dt]])
        x = transition @ x + np.array([dt * dt / 2, dt, 0]) * a
        p = transition @ p @ transition.T + noise
        f.predict(dt, [a])
        if step % 3 == 0:
            gain = p[:, 0] / (p[0, 0] + 0.7)
            x, p = x + gain * (1.0 - x[0]), p - np.outer(gain, p[0])
            f.correct([1.0], 0.7)
    assert (f.position[0], f.velocity[0], f.bias[0]) == pytest.approx(tuple(x))
    assert f.variances == pytest.approx((p[0, 0], p[1, 1], p[2, 2]))
