"""Gates: which measurements are accepted, and which are rejected."""

import math

import pytest

import imc
from autonomy.navigation import FixGate, VelocityGate

Valid = imc.GpsFix.Validity
Reason = imc.GpsFixRejection.Reason
Dvl = imc.DvlRejection.Reason


def gate():
    return FixGate(factor=1.8, samples=7, maximum_hacc=20.0, maximum_hdop=4.0)


def fix(**fields):
    return imc.GpsFix(validity=Valid.VALID_POS | Valid.VALID_HACC, hdop=0.9).replace(**fields)


def test_a_good_fix_is_believed():
    assert gate().reject_reason(fix(hacc=2.0)) is None


def test_a_fix_needs_a_position():
    assert gate().reject_reason(fix(validity=0)) is Reason.LOST_VAL_BIT
    assert gate().reject_reason(fix(lat=math.nan)) is Reason.LOST_VAL_BIT


@pytest.mark.parametrize("position", [{"lat": 1.6}, {"lat": -1.6}, {"lon": 3.2}, {"lon": -41.0}])
def test_a_fix_that_is_nowhere_is_refused_and_no_measure_for_others(position):
    tested = gate()
    assert [tested.reject_reason(fix(hacc=0.5, **position)) for _ in range(5)] == [Reason.INVALID] * 5
    assert tested.reject_reason(fix(hacc=5.0, lat=-0.5 * math.pi, lon=math.pi)) is None


def test_a_fix_that_is_much_worse_than_the_last_ones_is_refused_until_they_are_alike():
    tested = gate()
    assert [tested.reject_reason(fix(hacc=2.0)) for _ in range(3)] == [None, None, None]
    answers = [tested.reject_reason(fix(hacc=5.0)) for _ in range(7)]
    assert answers[0] is Reason.ABOVE_THRESHOLD
    assert answers[-1] is None


def test_a_fix_that_claims_too_little_is_refused():
    assert gate().reject_reason(fix(hacc=25.0)) is Reason.ABOVE_MAX_HACC
    assert gate().reject_reason(fix(validity=Valid.VALID_POS, hdop=5.0)) is Reason.ABOVE_MAX_HDOP


def test_velocities_may_not_jump_or_be_too_large():
    tested = VelocityGate(jump=(1.5, 0.6), largest=(5.0, 1.5), window=0.5)
    assert tested.reject_reason(0.0, 1.0, 0.0) is None
    assert tested.reject_reason(0.2, 3.0, 0.0) == (Dvl.INNOV_THRESHOLD_X, 2.0)
    assert tested.reject_reason(0.4, 1.0, 0.7) == (Dvl.INNOV_THRESHOLD_Y, 0.7)
    assert tested.reject_reason(0.8, 3.0, 0.7) is None
    assert tested.reject_reason(2.0, -6.0, 0.0) == (Dvl.ABS_THRESHOLD_X, 6.0)
    assert tested.reject_reason(3.0, 1.0, 2.0) == (Dvl.ABS_THRESHOLD_Y, 2.0)
