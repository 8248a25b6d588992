"""The pitch for a depth or an altitude."""

import math

import pytest

import imc
from autonomy.control import DepthController, DepthGains, PIDGains
from autonomy.limits import OperatingLimits

STEEPEST = math.radians(15.0)
DEPTH = PIDGains(0.5, 0.0, 0.0, limit=STEEPEST)
STILL = imc.EstimatedState(depth=3.0, alt=-1.0)


def depth(value):
    return imc.DesiredZ(value=value, z_units=imc.ZUnits.DEPTH)


def altitude(value):
    return imc.DesiredZ(value=value, z_units=imc.ZUnits.ALTITUDE)


def over(alt, state=STILL, **gains):
    """A controller that has seen the bottom."""
    law = DepthController(DepthGains(**({"depth": DEPTH} | gains)))
    law.bottom.update(alt, state.depth, 0.0)
    return law


def test_a_vehicle_at_its_depth_is_level_and_else_pitches_as_far_as_it_may():
    law = over(-1.0)
    assert law.step(STILL, depth(3.0), 0.05) == 0.0
    assert law.step(STILL, depth(3.1), 0.05) == pytest.approx(-0.05)
    assert law.step(STILL, depth(30.0), 0.05) == -STEEPEST
    assert law.step(STILL, depth(0.0), 0.05) == STEEPEST


def test_a_vehicle_that_sinks_is_braked():
    law = over(-1.0, depth=PIDGains(0.5, 0.0, 0.7, limit=STEEPEST))
    assert law.step(STILL.replace(w=0.1), depth(3.0), 0.05) == pytest.approx(0.07)
    sinking = STILL.replace(u=1.0, theta=-0.1)
    assert law.step(sinking, depth(3.0), 0.05) == pytest.approx(0.7 * math.sin(0.1))


def test_the_integral_stays_within_its_limit_and_is_forgotten():
    law = over(-1.0, depth=PIDGains(0.0, 1.0, 0.0, 0.1, STEEPEST))
    for _ in range(100):
        pitch = law.step(STILL, depth(4.0), 0.1)
    assert pitch == pytest.approx(-0.1)
    law.reset()
    assert law.step(STILL, depth(4.0), 0.1) == 0.0


def test_without_a_reference_it_is_level_and_a_pitch_is_taken_as_it_is():
    assert over(-1.0).step(STILL, None, 0.05) == 0.0
    assert over(-1.0).step(STILL, 0.2, 0.05) == 0.2


def test_an_altitude_is_kept_with_its_own_gains_or_with_those_of_depth():
    assert over(5.0).step(STILL, altitude(4.9), 0.05) == pytest.approx(-0.05)
    own = over(5.0, altitude=PIDGains(2.0, 0.0, 0.0, limit=STEEPEST))
    assert own.step(STILL, altitude(4.9), 0.05) == pytest.approx(-0.2)
    assert own.altitude.p == pytest.approx(0.2)


def test_without_altitude_the_depth_is_kept():
    law = over(-1.0)
    assert law.step(STILL, altitude(2.0), 0.05) == 0.0
    assert law.lacks_altitude
    assert law.step(STILL.replace(depth=3.1), altitude(2.0), 0.05) == pytest.approx(0.05)
    law.bottom.update(2.0, 3.0, 0.05)
    assert law.step(STILL, altitude(2.0), 0.05) == 0.0
    assert not law.lacks_altitude


def test_references_and_vehicle_stay_within_the_limits():
    law = over(-1.0, altitude_margin=0.2)
    law.limits = OperatingLimits(deepest=10.0, lowest=1.0)
    assert [law.clamp_to_limits(depth(z)) for z in (-1.0, 5.0, 9.5)] == [0.0, 5.0, 9.0]
    assert [law.clamp_to_limits(altitude(z)) for z in (0.5, 3.0)] == [1.2, 3.0]
    assert law.step(STILL.replace(depth=9.6), -0.2, 0.05) == pytest.approx(0.05)
    assert law.held == "maximum depth"
    assert law.step(STILL.replace(depth=30.0), -0.2, 0.05) == STEEPEST
    assert law.step(STILL, 0.1, 0.05) == 0.1
    assert law.held == ""


def test_a_vehicle_is_held_off_the_bottom_also_off_one_seen_last():
    law = over(2.0)
    law.limits = OperatingLimits(lowest=2.0)
    assert law.step(STILL.replace(depth=3.2), -0.2, 0.05) == pytest.approx(0.1)
    assert (law.held, law.lacks_altitude) == ("bottom", False)
    law.bottom.update(-1.0, 3.2, 0.05)
    assert law.step(STILL.replace(depth=3.2), -0.2, 0.05) == pytest.approx(0.1)
    assert (law.held, law.lacks_altitude) == ("bottom", True)


def test_at_the_surface_a_pitch_may_be_held():
    law = over(-1.0, surface_pitch=0.05)
    assert law.step(STILL.replace(depth=0.1), depth(0.0), 0.05) == 0.05
    assert law.step(STILL.replace(depth=0.4), depth(0.0), 0.05) == pytest.approx(0.2)
    assert law.step(STILL.replace(depth=0.4), depth(0.35), 0.05) == pytest.approx(0.025)


def test_other_gains_begin_anew_but_keep_the_depth():
    law = over(-1.0)
    law.step(STILL, altitude(2.0), 0.05)
    law.set_gains(DepthGains(PIDGains(1.0, 0.0, 0.0, limit=STEEPEST)))
    assert law.step(STILL.replace(depth=3.1), altitude(2.0), 0.05) == pytest.approx(0.1)
