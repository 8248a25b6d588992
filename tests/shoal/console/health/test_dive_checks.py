"""The checks before a dive: what is unknown, old or no number is never in order."""

import math
import time

import pytest

import imc
from autonomy.plans import PlanEstimate
from shoal.console.health.dive_checks import KINDS, DiveChecks, PlanChoice
from shoal.network import NetworkSystem

NOW = 1000.0
State = imc.EntityState.State
VALID = imc.GpsFix.Validity.VALID_POS | imc.GpsFix.Validity.VALID_HDOP | imc.GpsFix.Validity.VALID_TIME
PLACE = {"lat": math.radians(41.185), "lon": math.radians(-8.706)}
SURE = PlanChoice("near", PlanEstimate(600.0, 5.0, 90.0), stored=["near"])
READY = (
    imc.Announce(sys_type=imc.SystemType.UUV),
    imc.VehicleState(op_mode=imc.VehicleState.OpMode.SERVICE),
    imc.EntityState(src_ent=1, state=State.NORMAL),
    imc.EntityState(src_ent=2, state=State.NORMAL),
    imc.GpsFix(validity=VALID, satellites=9, hdop=1.0, utc_time=NOW, **PLACE),
    imc.EstimatedState(**PLACE),
    imc.NavigationUncertainty(x=1.0, y=1.0),
    imc.FuelLevel(value=90.0),
    imc.OperationalLimits(
        mask=imc.OpLimitsMask.MAX_DEPTH | imc.OpLimitsMask.AREA, max_depth=50.0, width=500.0, length=500.0, **PLACE
    ),
    imc.StorageUsage(available=9000, value=20),
    imc.Calibration(),
)


def colors(*changed, plan=SURE, without=(), is_live=False, silence=0.0):
    """The colors of a vehicle that is ready, but for some messages; by name. It has been silent for a while (s)."""
    system = NetworkSystem("lauv", labels={1: "Navigation", 2: "Leak Sensor - Nose"})
    system.last["udp"] = system.received_at = time.monotonic() - silence
    for message in (*READY, *changed):
        if not isinstance(message, tuple(without) or type(None)):
            system.store_latest(message.replace(timestamp=NOW))
    return {each.name: each.color for each in DiveChecks(system, plan, is_live=is_live).rows()}


def test_a_vehicle_that_is_ready_is_green_only():
    assert set(colors().values()) == {"green"}


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_not_received_is_not_in_order(kind):
    found = colors(without=[kind])
    assert "yellow" in found.values() or "red" in found.values()


def test_without_any_message_nothing_is_in_order():
    checks = DiveChecks(NetworkSystem("lauv"), PlanChoice(trouble="no answer"), is_live=True).rows()
    assert "green" not in {each.color for each in checks}
    assert len(checks) >= 10


@pytest.mark.parametrize(
    ("message", "name", "color"),
    [
        (imc.VehicleState(op_mode=imc.VehicleState.OpMode.ERROR), "Mode", "red"),
        (imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "Mode", "yellow"),
        (imc.EntityState(src_ent=1, state=State.FAULT), "Entities", "yellow"),
        (imc.EntityState(src_ent=1, state=State.FAILURE), "Entities", "red"),
        (imc.EntityState(src_ent=1, state=77), "Entities", "yellow"),
        (imc.EntityState(src_ent=2, state=State.ERROR), "Leaks", "red"),
        (imc.GpsFix(validity=0, satellites=3), "GPS fix", "red"),
        (imc.GpsFix(validity=VALID, hdop=9.0, **PLACE), "GPS fix", "yellow"),
        (imc.GpsFix(validity=VALID, hdop=math.nan, **PLACE), "GPS fix", "yellow"),
        (imc.GpsFix(validity=VALID, hdop=1.0, utc_time=NOW + 30.0, **PLACE), "Clock", "red"),
        (imc.GpsFix(validity=VALID, hdop=1.0, lat=math.inf, lon=math.nan), "Position", "red"),
        (imc.GpsFix(validity=VALID, hdop=1.0, lat=PLACE["lat"] + 1e-4, lon=PLACE["lon"]), "Position", "red"),
        (imc.EstimatedState(lat=math.nan, lon=0.1), "Position", "red"),
        (imc.EstimatedState(lat=PLACE["lat"] + 1e-3, lon=PLACE["lon"]), "Limits and area", "red"),
        (imc.OperationalLimits(), "Limits and area", "yellow"),
        (imc.OperationalLimits(mask=imc.OpLimitsMask.AREA, lat=math.inf, width=9.0), "Limits and area", "red"),
        (imc.FuelLevel(value=14.0), "Battery", "red"),
        (imc.FuelLevel(value=24.0), "Battery", "yellow"),
        (imc.FuelLevel(value=math.nan), "Battery", "red"),
        (imc.StorageUsage(value=97), "Free disk", "red"),
        (imc.StorageUsage(value=88), "Free disk", "yellow"),
    ],
)
def test_each_trouble_has_its_color(message, name, color):
    assert colors(message)[name] == color


@pytest.mark.parametrize(
    ("kind", "name"), [(imc.FuelLevel, "Battery"), (imc.GpsFix, "GPS fix"), (imc.StorageUsage, "Free disk")]
)
def test_what_was_good_long_ago_is_not_in_order(kind, name):
    old = next(each for each in READY if isinstance(each, kind)).replace(timestamp=NOW - 600.0)
    system = NetworkSystem("lauv")
    for message in (imc.VehicleState(timestamp=NOW), old):
        system.store_latest(message)
    check = next(each for each in DiveChecks(system, SURE, is_live=False).rows() if each.name == name)
    assert check.color != "green"
    assert "600 s old" in check.value


@pytest.mark.parametrize(
    ("plan", "color", "words"),
    [
        (SURE, "green", "near would start; 600 s"),
        (PlanChoice("near", PlanEstimate(rejected="depth 500 m is beyond 50 m")), "red", "would be rejected: depth"),
        (PlanChoice("near", None, trouble="no answer", stored=["near"]), "red", "unknown: no answer"),
        (PlanChoice("near", PlanEstimate(), stored=["near"]), "yellow", "not checked while a plan"),
        (PlanChoice(stored=[]), "red", "none is stored"),
        (PlanChoice(stored=["a", "b"]), "yellow", "none is chosen of 2"),
        (PlanChoice(trouble="silence"), "red", "unknown: silence"),
    ],
)
def test_the_plan_is_as_the_vehicle_judges_it(plan, color, words):
    system = NetworkSystem("lauv")
    check = next(each for each in DiveChecks(system, plan, is_live=True).rows() if each.name == "Plan")
    assert (check.color, words in check.value) == (color, True), check


def test_a_battery_that_the_plan_empties_is_red():
    empties = PlanChoice("far", PlanEstimate(6000.0, 85.0, 90.0))
    assert colors(plan=empties)["Battery"] == "red"
    assert colors(plan=PlanChoice("far", PlanEstimate()))["Battery"] == "yellow"


def test_nothing_is_in_order_while_the_vehicle_is_silent():
    assert set(colors(is_live=True, silence=1.0).values()) == {"green"}
    found = colors(is_live=True, silence=4.0)
    assert "green" not in found.values(), found
