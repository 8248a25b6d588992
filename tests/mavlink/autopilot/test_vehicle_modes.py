"""Which mode of an autopilot ends a flight, and which one if it is rejected."""

import pytest

from mavlink.autopilot.vehicle_modes import COPTER, FIXED_WING, VESSEL, steered_vehicle

PX4, QUADROTOR = 12, 2
PX4_COPTER = steered_vehicle(PX4, QUADROTOR)


@pytest.mark.parametrize(
    ("vehicle", "ending", "modes"),
    [
        (COPTER, "hold", (COPTER.hold, COPTER.land)),
        (COPTER, "return", (COPTER.back, COPTER.land)),
        (COPTER, "land", (COPTER.land, None)),
        (COPTER, "disarm", (COPTER.land, None)),
        (PX4_COPTER, "return", (PX4_COPTER.back, PX4_COPTER.land)),
        (FIXED_WING, "hold", (FIXED_WING.hold, None)),
        (FIXED_WING, "land", (FIXED_WING.back, None)),
        (FIXED_WING, "disarm", (FIXED_WING.back, None)),
        (VESSEL, "land", (VESSEL.hold, VESSEL.instead)),
        (VESSEL, "return", (VESSEL.back, None)),
    ],
)
def test_a_flight_ends_in_a_mode_that_the_vehicle_has(vehicle, ending, modes):
    assert vehicle.ending_modes(ending) == modes
