"""Where an autopilot is sent: units, signs, and setpoints that move ahead."""

import math

import pytest

import imc
from mavlink.autopilot.leg import Leg, ReportedPosition
from mavlink.autopilot.setpoints import leg_command, offboard_setpoint
from mavlink.autopilot.vehicle_modes import ARDUPILOT, PX4, steered_vehicle
from support.wgs84 import displacement

HERE = ReportedPosition(0.7188, -0.1519, amsl=40.0, above_home=10.0)


def path(**values):
    usual = {"end_lat": HERE.lat, "end_lon": HERE.lon, "speed": 3.0, "speed_units": imc.SpeedUnits.METERS_PS}
    return imc.DesiredPath(**{**usual, **values})


def test_arduplane_gets_its_side_apart_from_the_radius_and_px4_with_it():
    leg = Leg(path(lradius=70.0, flags=imc.DesiredPath.Flags.CCLOCKW), HERE, 50.0)
    plane, px4 = (leg_command(steered_vehicle(kind, 1), leg, HERE).fields for kind in (ARDUPILOT, PX4))
    assert (plane["param3"], plane["param4"], plane["z"]) == (70.0, 1.0, 80.0)
    assert px4["param3"] == -70.0
    assert math.isnan(px4["param4"])


def test_offboard_setpoints_move_ahead_at_the_speed_of_the_leg():
    leg = Leg(path(end_lat=HERE.lat + 100.0 / 6.37e6, speed=4.0), HERE, 10.0)
    north = 0.0
    for _ in range(100):  # PX4 approaches by 0.95/s of the distance
        lat = HERE.lat + north / 6.3596e6
        fields = offboard_setpoint(leg, ReportedPosition(lat, HERE.lon, 40.0, 10.0))
        away = displacement(lat, HERE.lon, 0.0, math.radians(fields["lat_int"] / 1e7), HERE.lon, 0.0)[0]
        north += 0.1 * 0.95 * away
    assert north == pytest.approx(40.0, rel=0.02)
    here = offboard_setpoint(None, HERE)
    assert (here["lat_int"], here["alt"]) == (round(math.degrees(HERE.lat) * 1e7), 10.0)
