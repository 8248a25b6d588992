"""The speed of a boat."""

import math

import pytest

import imc
from autonomy.control import SpeedController

MPS = imc.SpeedUnits.METERS_PS


def test_an_error_is_integrated_but_not_on_the_way_nor_at_a_limit():
    controller = SpeedController((0.0, 100.0, 0.0), math.inf, 500.0, (0.0, 900.0), 100.0, 1000.0)
    controller.set_desired(imc.DesiredSpeed(value=1.0, speed_units=MPS))
    shares = [controller.actuation(0.0, 0.05) for _ in range(2000)]
    assert shares[90] == pytest.approx(0.455, abs=1e-6)
    assert shares[-1] == pytest.approx(0.9)
    back = [controller.actuation(1.5, 0.05) for _ in range(20)]
    assert back[-1] < 0.89


def test_a_gain_on_the_rate_of_the_speed_damps_it():
    def shares(derivative):
        controller = SpeedController((0.0, 0.0, derivative), math.inf, 400.0, (0.0, 900.0), 1e6, 1000.0)
        controller.set_desired(imc.DesiredSpeed(value=1.0, speed_units=MPS))
        return [controller.actuation(u, 0.1) for u in (0.5, 0.55, 0.55, 0.5)]

    assert shares(200.0) == pytest.approx([0.4, 0.3, 0.4, 0.5])
    assert shares(0.0) == pytest.approx([0.4] * 4)


def test_a_motor_may_brake():
    controller = SpeedController((200.0, 0.0, 0.0), math.inf, 100.0, (-300.0, 900.0), 1e6, 1000.0)
    controller.set_desired(imc.DesiredSpeed(value=0.2, speed_units=MPS))
    assert controller.actuation(1.2, 0.05) == pytest.approx(-0.18)
