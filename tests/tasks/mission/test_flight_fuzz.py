"""Random flights in random wind, some with an abort: they stay below the limit and land softly."""

import math
from itertools import pairwise

import pytest
from aloft import CCU, OWN, START, Flight
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc
from support.wgs84 import displace

UP = imc.ZUnits.ALTITUDE
HIGHEST, MARGIN = 40.0, 2.0  # m
SOFT = 1.2  # m/s
LIMIT = f"Monitors.OperationalLimits:Initial Setting - Maximum Altitude={HIGHEST:g}"
Form, Direction = imc.Loiter.Type, imc.Loiter.Direction


def at(north, east, altitude, speed):
    lat, lon, _ = displace(math.radians(41.185), math.radians(-8.7062), 0.0, north, east)
    return {"lat": lat, "lon": lon, "z": altitude, "z_units": UP, "speed": speed}


places = st.builds(at, st.floats(-60, 60), st.floats(-60, 60), st.floats(3, HIGHEST), st.sampled_from((1.0, 5.0, 12.0)))
points = st.builds(imc.PathPoint, x=st.floats(-20, 20), y=st.floats(-20, 20), z=st.just(0.0))
maneuvers = st.one_of(
    st.builds(lambda p: imc.Goto(**p), places),
    st.builds(
        lambda p, form, radius, way: imc.Loiter(**p, type=form, radius=radius, direction=way, duration=8),
        places, st.sampled_from((Form.CIRCULAR, Form.HOVER)), st.floats(1, 30), st.sampled_from(tuple(Direction)),
    ),
    st.builds(lambda p: imc.StationKeeping(**p, duration=5), places),
    st.builds(lambda p, through: imc.FollowPath(**p, points=through), places, st.lists(points, min_size=1, max_size=3)),
    st.just(imc.IdleManeuver(duration=3)),
)  # fmt: skip


@st.composite
def plans(draw):
    ends = [imc.Takeoff(z=draw(st.floats(2, HIGHEST)), z_units=UP, speed=2.0), imc.Land(speed=3.0)]
    chosen = [ends[0], *draw(st.lists(maneuvers, max_size=3)), ends[1]]
    names = [f"m{number}" for number in range(len(chosen))]
    return imc.PlanSpecification(
        plan_id="random",
        start_man_id="m0",
        maneuvers=[imc.PlanManeuver(maneuver_id=n, data=m) for n, m in zip(names, chosen, strict=True)],
        transitions=[
            imc.PlanTransition(source_man=a, dest_man=b, conditions="ManeuverIsDone") for a, b in pairwise(names)
        ],
    )


@pytest.mark.heavy
@pytest.mark.computing
@settings(max_examples=4, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(plan=plans(), north=st.floats(-8, 8), east=st.floats(-5, 5), abort=st.none() | st.floats(START, 60))
def test_every_flight_ends_softly_on_the_ground(tmp_path, plan, north, east, abort):
    wind = [f"Simulators.StreamVelocity:Default Speed {way}={v:.2f}" for way, v in (("North", north), ("East", east))]
    events = [] if abort is None else [(abort, imc.Abort(src=CCU, dst=OWN))]
    flight = Flight(tmp_path, *events, seconds=400.0, overrides=[LIMIT, *wind], plan=plan, until_down=True)
    assert max(-truth.z for truth in flight.truths) < HIGHEST + MARGIN
    assert flight.end.z == 0.0
    assert flight.modes[-1] == "GROUND"
    if len(flight.modes) > 1:
        assert flight.touchdown < SOFT
    if abort is None:
        assert "plan completed" in " ".join(flight.log), flight.log
