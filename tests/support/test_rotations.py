"""Rotations compared with their definitions."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.rotations import (
    body_rates,
    down_axis,
    euler_from_quaternion,
    matrix_from_quaternion,
    quaternion_from_euler,
    quaternion_from_matrix,
    rotate_to_body,
    rotate_to_ned,
    rotation,
    to_body,
    to_ned,
    wrap,
)

ANGLES = st.floats(-4.0, 4.0)


def test_bow_right_and_keel():
    r = rotation(0.0, 0.0, math.pi / 2)
    assert to_ned(r, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-15)
    assert to_ned(rotation(0.0, 0.1, 0.0), (1.0, 0.0, 0.0))[2] < 0.0  # bow up
    assert to_ned(rotation(0.1, 0.0, 0.0), (0.0, 1.0, 0.0))[2] > 0.0  # starboard down


@given(ANGLES, ANGLES, ANGLES, st.tuples(*[st.floats(-10, 10)] * 3))
def test_back_and_forth(phi, theta, psi, v):
    r = rotation(phi, theta, psi)
    assert to_body(r, to_ned(r, v)) == pytest.approx(v, abs=1e-12)


@given(ANGLES, ANGLES, ANGLES, st.tuples(*[st.floats(-10, 10)] * 3))
def test_a_single_vector_is_rotated_to_the_same_bits(phi, theta, psi, v):
    r = rotation(phi, theta, psi)
    assert down_axis(phi, theta) == r[2]
    assert rotate_to_ned(phi, theta, psi, v) == to_ned(r, v)
    assert rotate_to_body(phi, theta, psi, v) == to_body(r, v)


@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), ANGLES, st.tuples(*[st.floats(-1, 1)] * 3))
def test_body_rates_turn_the_rotation(phi, theta, psi, rates):
    h = 1e-6
    a = rotation(phi - h * rates[0], theta - h * rates[1], psi - h * rates[2])
    b = rotation(phi + h * rates[0], theta + h * rates[1], psi + h * rates[2])
    p, q, r = body_rates(phi, theta, *rates)
    # the columns of R^T dR/dt are the cross products of omega with the axes
    for axis, expected in (((1.0, 0.0, 0.0), (0.0, r, -q)), ((0.0, 1.0, 0.0), (-r, 0.0, p))):
        moved = [(y - x) / (2 * h) for x, y in zip(to_ned(a, axis), to_ned(b, axis), strict=True)]
        assert to_body(rotation(phi, theta, psi), tuple(moved)) == pytest.approx(expected, abs=1e-8)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_quaternions_are_the_same_rotation(phi, theta, psi):
    quaternion, matrix = quaternion_from_euler(phi, theta, psi), rotation(phi, theta, psi)
    for row, same in zip(matrix_from_quaternion(quaternion), matrix, strict=True):
        assert row == pytest.approx(same, abs=1e-12)
    sign = math.copysign(1.0, quaternion[0])
    assert quaternion_from_matrix(matrix) == pytest.approx([sign * part for part in quaternion], abs=1e-7)
    assert euler_from_quaternion(quaternion) == pytest.approx((phi, theta, psi), abs=1e-7)


@given(st.floats(-1e6, 1e6))
def test_wrap(angle):
    wrapped = wrap(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-9)
