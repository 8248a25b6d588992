"""The page's data of a vehicle, also of one whose messages have no numbers."""

import json
import math

import pytest

import imc
from shoal.console.page_feed import encode
from shoal.console.vehicle_view import ArrivalTimes, changed_items, vehicle_view
from shoal.network import NetworkSystem


def view_of(*messages, name="lauv", times=None):
    system = NetworkSystem(name)
    for message in messages:
        system.store_latest(message)
    return vehicle_view(system, times or ArrivalTimes())


def test_what_is_unknown_is_null():
    view = view_of()
    assert view["state"] == {}
    assert (view["system"]["battery"], view["plan"]["mode"], view["plan"]["motors"]) == (None, None, None)
    state = view_of(imc.EstimatedState(depth=-1.0, alt=-1.0))["state"]
    assert (state["depth"], state["altitude"], state["uncertainty"]) == (None, None, None)


def test_units_are_degrees_and_meters():
    state = imc.EstimatedState(
        lat=math.radians(41.0), lon=math.radians(-8.0), psi=-math.pi / 2, vx=3.0, vy=4.0, depth=2.0
    )
    shown = view_of(state, imc.NavigationUncertainty(x=4.0, y=9.0))["state"]
    assert (shown["lat"], shown["lon"], shown["heading"], shown["speed"]) == (41.0, -8.0, 270.0, 5.0)
    assert (shown["depth"], shown["uncertainty"]) == (2.0, 3.0)


def test_entities_are_sorted_by_severity_and_keep_when_it_began():
    now = [100.0]
    times, kinds = ArrivalTimes(lambda: now[0]), imc.EntityState.State
    first = view_of(
        imc.EntityState(timestamp=5.0, src_ent=1, state=kinds.NORMAL),
        imc.EntityState(timestamp=6.0, src_ent=2, state=kinds.ERROR, description="no data"),
        times=times,
    )
    shown = [(each["entity"], each["state"]) for each in first["health"]["entities"]]
    assert shown == [("2", "error"), ("1", "normal")]
    now[0] = 103.0
    later = view_of(imc.EntityState(timestamp=9.0, src_ent=2, state=kinds.ERROR), times=times)
    assert later["health"]["entities"][0]["since"] == 100.0
    over = view_of(imc.EntityState(timestamp=12.0, src_ent=2, state=kinds.NORMAL), times=times)
    assert over["health"]["entities"][0]["since"] == 103.0


def test_the_age_of_a_position_is_by_the_clock_of_the_console():
    now = [100.0]
    times, state = ArrivalTimes(lambda: now[0]), imc.EstimatedState(timestamp=5.0, lat=0.7)
    assert view_of(state, times=times)["state"]["time"] == 100.0
    now[0] = 160.0
    assert view_of(state, times=times)["state"]["time"] == 100.0
    assert view_of(state.replace(timestamp=6.0), times=times)["state"]["time"] == 160.0


def test_a_vehicle_without_a_position_has_none():
    for state in (imc.EstimatedState(depth=1.0), imc.EstimatedState(lat=9.0)):
        assert (view_of(state)["state"]["lat"], view_of(state)["state"]["lon"]) == (None, None)


def test_an_old_speed_of_a_motor_says_nothing():
    rpm = imc.Rpm(timestamp=10.0, value=900.0)
    assert view_of(rpm, imc.VehicleState(timestamp=11.0))["plan"]["motors"] == "turning"
    assert view_of(rpm, imc.VehicleState(timestamp=60.0))["plan"]["motors"] is None


@pytest.mark.parametrize(
    "message",
    [
        *(
            imc.EstimatedState(**{name: bad})
            for name in ("lat", "x", "psi", "vx", "alt", "depth", "height", "timestamp")
            for bad in (math.nan, math.inf, -1e300)
        ),
        imc.EntityState(timestamp=math.nan, state=200, description="\udc80<b>"),
        imc.EntityState(timestamp=math.inf),
        imc.FuelLevel(value=math.nan),
        imc.NavigationUncertainty(x=math.nan, y=-5.0),
        imc.PlanControlState(plan_progress=math.nan, state=1, plan_id="\udcff"),
        imc.Announce(sys_type=99),
        imc.VehicleState(op_mode=77, last_error="\udc80"),
    ],
    ids=repr,
)
def test_no_message_keeps_the_page_from_its_frames(message):
    assert json.loads(encode({"a\udc80": view_of(message, name="a\udc80")}))


def test_only_changed_sections_are_sent():
    before = view_of(imc.FuelLevel(value=50.0))
    after = view_of(imc.FuelLevel(value=49.0))
    assert set(changed_items(before, after)) == {"system"}
