"""Fences that stations upload, read back and clear, without a socket."""

import pytest

import imc
from tests.mavlink.vehicle.mission_console import (
    ACCEPTED,
    DENIED,
    ERROR,
    FENCE,
    INVALID,
    LAT,
    LON,
    Console,
    read,
    waypoint,
)


def test_a_fence_is_the_area_of_the_operational_limits(afloat):
    console = Console(afloat)
    places = ((0, 0), (9000, 0), (9000, 9000), (0, 9000))
    corners = [
        dict(waypoint(n), frame=0, command=5001, param1=4.0, x=LAT + x, y=LON + y, z=0.0)
        for n, (x, y) in enumerate(places)
    ]
    assert console.upload(corners, FENCE) == ({**console.upload(corners, FENCE)[0]}, [])
    limits = afloat.endpoint.model.latest.get(imc.OperationalLimits)
    assert limits.mask & imc.OpLimitsMask.AREA
    assert console.download(FENCE)[0]["count"] == 4
    assert console.current()["fence_id"] != 0
    ack, texts = console.upload(corners[:3], FENCE)
    assert ack["type"] == INVALID
    assert texts
    assert console.say("MISSION_CLEAR_ALL", mission_type=FENCE)[0].values["type"] == ACCEPTED
    assert console.download(FENCE)[0]["count"] == 0


CORNERS = [
    dict(waypoint(n), frame=0, command=5001, param1=4.0, x=LAT + x, y=LON + y, z=0.0)
    for n, (x, y) in enumerate(((9000, 9000), (0, 9000), (0, 0), (9000, 0)))
]


def test_a_fence_is_returned_in_the_order_in_which_it_came(afloat):
    console = Console(afloat)
    assert console.upload(CORNERS, FENCE)[0]["type"] == ACCEPTED
    found = console.download(FENCE)[1]
    assert [(m["x"], m["y"]) for m in found] == [(c["x"], c["y"]) for c in CORNERS]
    other = afloat.endpoint.model.latest.get(imc.OperationalLimits)
    afloat.endpoint.update_state(other.replace(length=other.length + 50.0), "Limits", afloat.now)
    found = console.download(FENCE)[1]
    assert [(m["x"], m["y"]) for m in found] != [(c["x"], c["y"]) for c in CORNERS], "somebody else has set another"


@pytest.mark.parametrize("after", [0.4, 9.0])
def test_a_fence_is_acknowledged_when_it_can_be_read_back(afloat, monkeypatch, after):
    console, asked = Console(afloat), []
    monkeypatch.setattr(afloat, "publish", asked.append)
    said = console.say("MISSION_COUNT", count=4, mission_type=FENCE)
    for corner in CORNERS:
        said = console.say("MISSION_ITEM_INT", **corner, mission_type=FENCE)
    assert said == [], "the vehicle has not taken it yet"
    assert console.say("MISSION_CLEAR_ALL", mission_type=FENCE)[0].values["type"] == DENIED
    transfer = afloat.endpoint.mission_transfer
    assert transfer.next_deadline == afloat.now + 3.0
    afloat.now += after
    if after < 3.0:
        afloat.endpoint.update_state(asked[0], "Limits", afloat.now)
    transfer.poll(afloat.now)
    said = console.heard()
    assert [m.values["type"] for m in said if m.name == "MISSION_ACK"] == [ACCEPTED if after < 3.0 else ERROR]
    assert console.download(FENCE)[0]["count"] == (4 if after < 3.0 else 0)
    assert read(said) == ([] if after < 3.0 else ["Fence rejected: the operational limits do not take it"])
    if after < 3.0:
        assert console.say("MISSION_CLEAR_ALL", mission_type=FENCE) == []
        afloat.endpoint.update_state(asked[1], "Limits", afloat.now)
        transfer.poll(afloat.now)
        assert [m.values["type"] for m in console.heard()] == [ACCEPTED]


def test_a_clearing_that_a_new_fence_overtakes_is_answered(afloat, monkeypatch):
    console, asked = Console(afloat), []
    assert console.upload(CORNERS, FENCE)[0]["type"] == ACCEPTED
    monkeypatch.setattr(afloat, "publish", asked.append)
    assert console.say("MISSION_CLEAR_ALL", mission_type=FENCE) == [], "the vehicle has not forgotten it yet"
    other = [dict(corner, x=corner["x"] + 1000) for corner in CORNERS]
    said = console.say("MISSION_COUNT", count=4, mission_type=FENCE)
    for corner in other:
        said += console.say("MISSION_ITEM_INT", **corner, mission_type=FENCE)
    assert [m.values["type"] for m in said if m.name == "MISSION_ACK"] == [ERROR], "that of the clearing"
    afloat.endpoint.update_state(asked[-1], "Limits", afloat.now)
    afloat.endpoint.mission_transfer.poll(afloat.now)
    assert [m.values["type"] for m in console.heard()] == [ACCEPTED]
    assert [m["x"] for m in console.download(FENCE)[1]] == [corner["x"] for corner in other]
