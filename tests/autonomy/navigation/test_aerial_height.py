"""The height of an aerial vehicle by barometer, or by GPS, or by neither."""

import numpy as np
import pytest

from autonomy.navigation import AerialHeight, pressure_altitude

PRESSURE = 1000.0
GROUND = pressure_altitude(PRESSURE)


def hovered(*, pressure=lambda t: PRESSURE, gps=lambda t: 0.0, seconds=30.0):
    """At rest at the reference; from 10 s on the sensors measure what is given, None is nothing."""
    height, noise = AerialHeight(0.15, 2.0, (0.06, 0.002)), np.random.default_rng(3)
    height.start(GROUND, 0.0, 0.0, (0.01, 0.01))
    faults = set()
    for step in range(round(20 * seconds)):
        now = 0.05 * step
        measured = pressure(now) if now > 10.0 else PRESSURE
        if measured is not None:
            height.barometer.receive(now, measured + 0.012 * noise.standard_normal())
        faults.add(height.advance(now, 0.05, 0.0))
        above = gps(now) if now > 10.0 else 0.0
        if step % 4 == 0 and above is not None:
            height.correct_by_gps(now, above + 1.2 * noise.standard_normal(), 0.36)
        faults.add(height.fault(now))
    return height, " ".join(sorted(faults - {""}))


@pytest.mark.parametrize(
    ("sensors", "fault"),
    [
        ({}, ""),
        ({"pressure": lambda t: None}, ""),
        ({"gps": lambda t: None}, ""),
        ({"gps": lambda t: 60.0}, "GPS and barometer disagree"),
        ({"gps": lambda t: 3000.0 * (-1.0) ** round(5.0 * t)}, "GPS and barometer disagree"),
        ({"pressure": lambda t: None, "gps": lambda t: -60.0}, "neither barometer nor GPS"),
        ({"pressure": lambda t: None, "gps": lambda t: 3000.0 * (-1.0) ** round(5.0 * t)}, "neither barometer nor GPS"),
        ({"pressure": lambda t: None, "gps": lambda t: None}, "neither barometer nor GPS"),
        ({"pressure": lambda t: PRESSURE + 2.0}, "pressure has jumped by 17 m"),
        ({"pressure": lambda t: 0.75 * PRESSURE}, "pressure has jumped by"),
    ],
)
def test_the_height_stays_and_what_contradicts_it_is_named(sensors, fault):
    height, faults = hovered(**sensors)
    assert fault in faults
    assert bool(faults) is bool(fault)
    assert height.filter.position[0] == pytest.approx(0.0, abs=1.5)


def test_a_jump_of_the_pressure_that_gps_confirms_is_one_of_the_height():
    height, faults = hovered(pressure=lambda t: PRESSURE + 2.0, gps=lambda t: -16.9)
    assert faults.startswith("pressure has jumped by 17 m")
    assert height.filter.position[0] == pytest.approx(16.9, abs=0.5)


def test_a_pressure_in_mmhg_is_not_used_until_it_is_right_again():
    height, faults = hovered(pressure=lambda t: 0.75 * PRESSURE)
    assert faults.count("pressure has jumped") == 1
    assert 30.0 - height.pressed > 15.0
    height, faults = hovered(pressure=lambda t: 0.75 * PRESSURE if t < 20.0 else PRESSURE)
    assert faults.count("pressure has jumped") == 1
    assert 30.0 - height.pressed < 0.1
    assert height.filter.position[0] == pytest.approx(0.0, abs=0.3)
