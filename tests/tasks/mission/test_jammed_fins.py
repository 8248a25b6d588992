"""An AUV whose horizontal fins jam in a dive, although the servos report what they are told."""

import math
from functools import cache

import pytest
from flying import goto, plan_of
from lean import BLIND

from tests.tasks.mission.lies import DEEP, FAULT, Flight, Mode
from tests.tasks.mission.underway import underway

pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def fly():
    state = cache(lambda: underway("lauv-noptilus-1", plan_of(goto(400, 0, 10.0)), FAULT, DEEP, BLIND))
    return lambda folder, inject, seconds: Flight(state(), folder, inject, seconds)


def jam(degrees):
    def inject(vehicle):
        craft = vehicle.task("Simulators.VSIM").craft
        deflect = craft.set_deflection
        craft.set_deflection = lambda fin, angle: deflect(fin, math.radians(degrees) if fin in (1, 2) else angle)

    return inject


@pytest.mark.parametrize("degrees", [-20.0, -8.0, 4.0, 8.0, 20.0])
def test_a_pitch_that_does_not_follow_its_reference_ends_the_plan(degrees, fly, tmp_path):
    flight = fly(tmp_path, jam(degrees), FAULT + 60.0)
    assert flight.errors[0] == "Attitude: pitch does not follow its reference"

    assert flight.failed < 15.0
    assert max(flight.depths) < 20.0
    assert Mode.MANEUVER not in flight.modes[flight.modes.index(Mode.ERROR) :]
    assert flight.depths[-1] < flight.depths[-1000] - 0.3 or flight.depths[-1] < 0.3
