"""An AUV whose horizontal fins jam in a dive, although the servos report what they are told."""

import math
from dataclasses import replace
from functools import cache

import pytest
from flying import goto, plan_of
from lean import BLIND

from tests.repeats import all_but
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


@pytest.mark.parametrize("degrees", all_but([-20.0, 4.0], [-20.0, -8.0, 4.0, 8.0, 20.0]))
def test_a_pitch_that_does_not_follow_its_reference_ends_the_plan(degrees, fly, tmp_path):
    flight = fly(tmp_path, jam(degrees), FAULT + 60.0)
    assert flight.errors[0] == "Attitude: pitch does not follow its reference"

    assert flight.failed < 15.0
    assert max(flight.depths) < 20.0
    assert Mode.MANEUVER not in flight.modes[flight.modes.index(Mode.ERROR) :]
    assert flight.depths[-1] < flight.depths[-1000] - 0.3 or flight.depths[-1] < 0.3


def test_a_heavy_vehicle_whose_fins_jam_in_a_dive_does_not_stay_on_the_bottom(tmp_path):
    """It leaves it astern while its bow is down: later, at rest and level, neither motor nor fins lift it."""

    def inject(vehicle):
        craft = vehicle.task("Simulators.VSIM").craft
        craft.model = replace(craft.model, mass=craft.model.mass + 0.6)
        jam(20.0)(vehicle)

    shallow = ("Bathymetry:Data=", "World:Out Of Bounds Depth=6")
    state = underway("lauv-noptilus-1", plan_of(goto(400, 0, 3.0)), FAULT, *shallow, BLIND)
    flight = Flight(state, tmp_path, inject, FAULT + 100.0)
    assert max(flight.depths) > 5.5
    assert min(flight.depths[500:2000]) < 0.3
    assert max(flight.depths[-1000:]) < 1.6, flight.depths[::500]
