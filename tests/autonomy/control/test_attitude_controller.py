"""The torques that turn an underwater vehicle."""

import math

import pytest

import imc
from autonomy.control import AttitudeController, AttitudeGains, AttitudeReference, PIDGains

GAINS = AttitudeGains(
    heading=PIDGains(1.5, 0.0, 0.0, limit=0.5),
    heading_rate=PIDGains(2.0, 0.0, 0.0, limit=0.4),
    pitch=PIDGains(1.5, 0.5, 1.0, integral_limit=0.1, limit=0.4),
    roll=PIDGains(1.0, 0.0, 0.2, limit=0.4),
)
STILL = imc.EstimatedState()


def torques(state=STILL, dt=0.05, gains=GAINS, **reference):
    return AttitudeController(gains).step(state, AttitudeReference(**reference), dt)


def test_a_vehicle_at_its_attitude_needs_no_torque():
    state = imc.EstimatedState(theta=0.2, psi=1.0)
    assert torques(state, pitch=0.2, heading=1.0) == (0.0, 0.0, 0.0)
    assert torques(imc.EstimatedState(psi=1.0, r=0.3, q=0.0), heading_rate=0.3)[2] == 0.0


def test_each_axis_turns_towards_its_reference_as_far_as_it_may():
    assert torques(pitch=0.1)[1] == pytest.approx(0.15)
    assert torques(heading=0.1)[2] == pytest.approx(0.3)
    assert torques(heading_rate=0.1)[2] == pytest.approx(0.2)
    assert torques(imc.EstimatedState(phi=0.1))[0] == pytest.approx(-0.1)
    assert torques(imc.EstimatedState(phi=-2.0, theta=-2.0), heading=1.0) == (0.4, 0.4, 0.4)


def test_headings_turn_the_short_way():
    state = imc.EstimatedState(psi=math.radians(175.0))
    law = AttitudeController(GAINS)
    law.step(state, AttitudeReference(heading=math.radians(-175.0)), 0.05)
    assert law.rate == pytest.approx(1.5 * math.radians(10.0))


def test_what_is_missing_is_not_controlled_and_a_rate_comes_first():
    assert torques(imc.EstimatedState(psi=1.0, r=0.5))[2] == 0.0
    assert torques(heading=1.0, heading_rate=-0.1)[2] == pytest.approx(-0.2)
    assert (
        torques(imc.EstimatedState(phi=0.1), gains=AttitudeGains(*[PIDGains(1.0, 0.0, 0.0)] * 4, levels=False))[0] == 0
    )


def test_a_rolled_vehicle_turns_with_its_pitch_rate():
    rolled = imc.EstimatedState(phi=0.5 * math.pi, q=0.1)
    law = AttitudeController(AttitudeGains(*[PIDGains(0.0, 0.0, 1.0)] * 4))
    law.step(rolled, AttitudeReference(heading=0.0), 0.05)
    assert law.rate == pytest.approx(-0.1)
    steep = imc.EstimatedState(theta=0.5 * math.pi, r=0.1)
    law.step(steep, AttitudeReference(heading=0.0), 0.05)
    assert law.rate == pytest.approx(-1.0), "Euler rates are bounded where they are singular"


def test_a_pitch_that_changes_is_followed_ahead_but_not_at_the_first_step():
    law = AttitudeController(GAINS)
    assert law.step(STILL, AttitudeReference(0.1), 0.1)[1] == pytest.approx(0.15)
    law.step(STILL, AttitudeReference(0.11), 0.1)
    assert law.pitch.d == pytest.approx(0.1)
    law.reset_pitch()
    law.step(STILL, AttitudeReference(0.2), 0.1)
    assert (law.pitch.i, law.pitch.d) == (0.0, 0.0)


def test_the_integral_stays_within_its_limit():
    law = AttitudeController(GAINS)
    for _ in range(200):
        law.step(STILL, AttitudeReference(0.1), 0.1)
    assert law.pitch.i == pytest.approx(0.1)
    law.set_gains(GAINS)
    law.step(STILL, AttitudeReference(0.1), 0.1)
    assert law.pitch.i == 0.0
