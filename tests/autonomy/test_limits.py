"""The limits within which a vehicle operates."""

import math

import imc
from autonomy.limits import OperatingLimits

Bits = imc.OpLimitsMask


def test_limits_are_those_of_the_profile_and_none_where_it_has_none():
    options = {"Absolute Maximum Depth": 50.0, "Maximum Absolute Speed": 2.0}
    limits = OperatingLimits.from_options(options.get, deepest=math.inf, lowest=0.0)
    assert limits == OperatingLimits(deepest=50.0, lowest=0.0)
    assert limits.fastest == math.inf, "not asked for"


def test_a_message_makes_limits_stricter_but_never_looser():
    limits = OperatingLimits(50.0, 2.0, 100.0, 3.0)
    every = Bits.MAX_DEPTH | Bits.MIN_ALT | Bits.MAX_ALT | Bits.MAX_SPEED
    strict = imc.OperationalLimits(mask=every, max_depth=10.0, min_altitude=5.0, max_altitude=20.0, max_speed=1.0)
    assert limits.tightened(strict) == OperatingLimits(10.0, 5.0, 20.0, 1.0)
    assert limits.tightened(strict.replace(mask=Bits.MAX_DEPTH)) == OperatingLimits(10.0, 2.0, 100.0, 3.0)
    loose = imc.OperationalLimits(mask=every, max_depth=90.0, min_altitude=1.0, max_altitude=200.0, max_speed=9.0)
    assert limits.tightened(loose) == limits
    nonsense = imc.OperationalLimits(
        mask=every, max_depth=math.nan, min_altitude=math.inf, max_altitude=math.nan, max_speed=-math.inf
    )
    assert limits.tightened(nonsense) == limits
