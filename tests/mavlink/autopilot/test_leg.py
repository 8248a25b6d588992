"""Legs: heights, paths that are refused, circles."""

import math

import pytest

import imc
from mavlink.autopilot.leg import ArrivalTolerance, Leg, ReportedPosition, path_height_above_home
from support.wgs84 import displace, displacement

HERE = ReportedPosition(lat=0.7188, lon=-0.1519, amsl=40.0, above_home=10.0)
Units = imc.ZUnits


def path(**values):
    return imc.DesiredPath(
        **{"end_lat": HERE.lat, "end_lon": HERE.lon, "end_z": 10.0, "end_z_units": Units.ALTITUDE, "speed": 3.0,
           "speed_units": imc.SpeedUnits.METERS_PS, **values}
    )  # fmt: skip


@pytest.mark.parametrize(
    ("values", "flies", "dives", "height"),
    [
        ({"end_z": 25.0}, True, False, 25.0),
        ({"end_z": 25.0, "end_z_units": Units.NONE}, True, False, 10.0),
        ({"end_z": 104.6, "end_z_units": Units.HEIGHT}, True, False, 20.0),
        ({"end_z": 4.0, "end_z_units": Units.DEPTH}, False, True, -4.0),
        ({"end_z": 0.0, "end_z_units": Units.DEPTH}, False, False, 0.0),
        ({"end_z": 4.0, "end_z_units": Units.DEPTH}, False, False, "cannot dive"),
        ({"end_z": 4.0, "end_z_units": Units.DEPTH}, True, False, "cannot go to a depth"),
        ({"end_z": 4.0}, False, True, "cannot go to an altitude"),
    ],
)
def test_heights(values, flies, dives, height):
    if isinstance(height, str):
        with pytest.raises(ValueError, match=height):
            path_height_above_home(path(**values), HERE, 54.6, flies=flies, dives=dives)
    else:
        assert path_height_above_home(path(**values), HERE, 54.6, flies=flies, dives=dives) == pytest.approx(height)


@pytest.mark.parametrize(
    "wrong",
    [{"speed": 0.0}, {"speed_units": imc.SpeedUnits.RPM}, {"end_lat": math.nan}, {"end_lat": 2.0}, {"end_lon": 0.5}],
)
def test_a_leg_that_cannot_be_followed_is_refused(wrong):
    with pytest.raises(ValueError, match=r"speed|position|longer"):
        Leg(path(**wrong), HERE, 10.0)


@pytest.mark.parametrize("flags", [0, imc.DesiredPath.Flags.CCLOCKW])
@pytest.mark.parametrize("away", [2.0, 20.0, 60.0])
def test_who_heads_for_the_target_ends_on_the_circle(flags, away):
    leg = Leg(path(lradius=20.0, flags=flags), HERE, 10.0)
    north, east, turned = away, 0.0, 0.0
    for _ in range(1200):
        lat, lon, _ = displace(HERE.lat, HERE.lon, 0.0, north, east)
        to = displacement(lat, lon, 0.0, *leg.steering_target(ReportedPosition(lat, lon, 40.0, 10.0)), 0.0)
        before, length = math.atan2(east, north), math.hypot(*to[:2])
        north, east = north + 0.3 * to[0] / length, east + 0.3 * to[1] / length
        turned += math.remainder(math.atan2(east, north) - before, math.tau)
    assert math.hypot(north, east) == pytest.approx(20.0, abs=0.3)
    assert turned * (-1.0 if flags else 1.0) > 6.0
    assert leg.update_arrival(ReportedPosition(lat, lon, 40.0, 10.0), ArrivalTolerance(2.0, 0.4))
    assert leg.loitering
