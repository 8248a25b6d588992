"""Sensors of the profile hexa-00 whose messages come late in the air, alone and with another fault."""

from dataclasses import replace
from functools import cache

import pytest

import imc
from tests.repeats import repeat
from tests.tasks.mission.lies import AHRS, BAROMETER, GPS, Flight, all_of, before, late, lies
from tests.tasks.mission.underway import say

pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def fly():
    """Flies hexa-00 on from FAULT for 200 s or until it has landed, with the same flight before."""
    state = cache(before)
    return lambda folder, inject: Flight(state("hexa-00"), folder, inject, 200.0)


def lose_load(seconds, kilograms=0.5):
    """A load is lost some time after FAULT."""

    def inject(vehicle):
        def lose():
            craft = vehicle.task("Simulators.UAV").craft
            craft.airframe = replace(craft.airframe, mass=craft.airframe.mass - kilograms)

        vehicle.kernel.after(seconds, lose)

    return inject


@pytest.mark.parametrize(
    "fault",
    [
        repeat(late(AHRS, 0.7)),
        late(AHRS, 1.5),
        repeat(late(AHRS, 4.0)),
        repeat(late(BAROMETER, 0.7)),
        repeat(late(BAROMETER, 1.5)),
        late(BAROMETER, 4.0),
        all_of(late(AHRS, 1.5), lose_load(4.0)),
        all_of(late(BAROMETER, 4.0), lies(AHRS, imc.EulerAngles, ("theta", lambda angle, t: 0.001 * angle))),
        all_of(late(BAROMETER, 1.5), lies(BAROMETER, imc.Pressure, ("value", lambda value, t: value - 0.05 * t))),
    ],
    ids=[
        *(f"attitude and accelerations {seconds} s late" for seconds in (0.7, 1.5, 4.0)),
        *(f"barometer {seconds} s late" for seconds in (0.7, 1.5, 4.0)),
        "attitude late, a load lost",
        "barometer late, pitch in wrong units",
        "barometer late and drifting",
    ],
)
def test_a_multirotor_whose_sensors_come_late_lands_softly(fault, fly, tmp_path):
    flight = fly(tmp_path, fault)
    assert -min(flight.depths) < 25.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown <= 2.5


@pytest.mark.parametrize(("seconds", "after"), [(1.5, 5.0), repeat((1.5, 8.0)), (4.0, 5.0)])
def test_a_multirotor_whose_attitude_becomes_late_near_the_ground_lands_softly(seconds, after, fly, tmp_path):
    def inject(vehicle):
        say(vehicle, imc.Abort(dst=vehicle.system))
        vehicle.kernel.after(after, late(AHRS, seconds), vehicle)

    flight = fly(tmp_path, inject)
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown < 2.0


@pytest.mark.parametrize(
    ("seconds", "since"), [(1.5, 9.0), repeat((1.0, 13.0)), repeat((1.5, 13.0)), repeat((2.0, 11.0))]
)
def test_late_pressures_and_heights_by_gps_in_another_unit_end_in_a_soft_landing(seconds, since, fly, tmp_path):
    low = lies(GPS, imc.GpsFix, ("height", lambda height, t: 0.3048 * height))
    flight = fly(tmp_path, all_of(late(BAROMETER, seconds), lambda vehicle: vehicle.kernel.after(since, low, vehicle)))
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown <= 2.5
