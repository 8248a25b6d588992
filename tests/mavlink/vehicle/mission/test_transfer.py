"""The mission protocol with one or two ground stations, without a socket."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from mavlink import encode, split
from tests.mavlink.vehicle.mission_console import (
    ACCEPTED,
    ALL,
    BAD_FRAME,
    BAD_SEQUENCE,
    CANCELLED,
    DENIED,
    DIALECT,
    INVALID_5,
    INVALID_7,
    LAT,
    NO_SPACE,
    RALLY,
    UNSUPPORTED,
    Console,
    waypoint,
)

NAMES = {
    *("MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_ACK", "MISSION_CLEAR_ALL"),
    *("MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_SET_CURRENT"),
}


def same(sent, got):
    """Whether an item came back bit by bit."""
    pack = DIALECT.by_name["MISSION_ITEM_INT"].pack
    plain = {"target_system": 0, "target_component": 0}
    return pack({**sent, **plain}) == pack({**got, **plain})


def test_what_was_uploaded_comes_back_bit_by_bit_with_its_id(afloat):
    console = Console(afloat)
    items = [waypoint(0), waypoint(1, frame=3, param1=20.0, param4=0.0), waypoint(2, frame=11, z=3.0)]
    ack, texts = console.upload(items)
    assert (ack["type"], texts) == (ACCEPTED, [])
    count, found = console.download()
    assert count["opaque_id"] == ack["opaque_id"] == console.current()["mission_id"] != 0
    assert all(same(sent, got) for sent, got in zip(items, found, strict=True))
    legacy = console.download(name="MISSION_REQUEST")[1]
    assert [m["x"] for m in legacy] == pytest.approx([item["x"] / 1e7 for item in items], abs=1e-5)
    (stored,) = [r for r in afloat.requests if isinstance(r, imc.PlanDB)]
    assert (stored.op, stored.plan_id, len(stored.arg.maneuvers)) == (imc.PlanDB.Op.SET, "mavlink", 4)


def test_stations_of_two_flavors_see_one_mission(afloat):
    px4, ardupilot = Console(afloat), Console(afloat, "ardupilot", 254)
    home = waypoint(0, frame=0, z=0.0, x=LAT, param4=0.0)
    assert ardupilot.upload([home, waypoint(1), waypoint(2)])[0]["type"] == ACCEPTED
    _, found = px4.download()
    assert [(m["seq"], m["x"]) for m in found] == [(0, LAT + 1000), (1, LAT + 2000)]
    assert (px4.current()["total"], ardupilot.current()["total"]) == (2, 2)
    assert px4.upload([waypoint(0)])[0]["type"] == ACCEPTED
    _, found = ardupilot.download()
    assert [m["x"] for m in found] == [pytest.approx(401_000_000, abs=2), LAT]


def test_item_0_of_ardupilot_is_the_home_of_the_vehicle_whatever_was_sent(afloat):
    station = Console(afloat, "ardupilot", 254)
    elsewhere = waypoint(0, frame=3, z=7.0, x=LAT + 5000, param4=0.0)
    assert station.upload([elsewhere, waypoint(1)])[0]["type"] == ACCEPTED
    home, _ = station.download()[1]
    assert (home["frame"], home["command"], home["x"], home["z"]) == (0, 16, pytest.approx(LAT, abs=2), 0.0)
    ack, texts = station.upload([{**elsewhere, "x": 2_000_000_000}, waypoint(1)])
    assert ack["type"] == INVALID_5
    assert "item 0" in texts[0]
    assert station.download()[0]["count"] == 2, "the mission before it stays"


def test_lost_doubled_and_reordered_items(afloat):
    console = Console(afloat)
    console.say("MISSION_COUNT", count=3)
    (again,) = console.say("MISSION_ITEM_INT", **waypoint(2))
    assert (again.name, again.values["seq"]) == ("MISSION_REQUEST_INT", 0)
    console.say("MISSION_ITEM_INT", **waypoint(0))
    assert console.say("MISSION_ITEM_INT", **waypoint(0)) == []
    afloat.now += 0.3
    afloat.endpoint.mission_transfer.poll(afloat.now)
    (again,) = console.heard()
    assert (again.name, again.values["seq"]) == ("MISSION_REQUEST_INT", 1)
    console.say("MISSION_ITEM_INT", **waypoint(1))
    (ack,) = console.say("MISSION_ITEM_INT", **waypoint(2))
    (same_ack,) = console.say("MISSION_ITEM_INT", **waypoint(2))
    assert same_ack.values == ack.values
    assert console.say("MISSION_ITEM_INT", **waypoint(1)) == [], "overtaken; an answer would end the next transfer"
    assert len([r for r in afloat.requests if isinstance(r, imc.PlanDB)]) == 1
    afloat.now += 11.0
    assert console.say("MISSION_ITEM_INT", **waypoint(2))[0].values["type"] == BAD_SEQUENCE


def test_a_station_that_vanishes_in_mid_upload_leaves_the_old_mission(afloat):
    console = Console(afloat)
    console.upload([waypoint(0)])
    before = console.current()["mission_id"]
    console.say("MISSION_COUNT", count=3)
    for _ in range(7):
        afloat.now += 0.3
        afloat.endpoint.mission_transfer.poll(afloat.now)
    said = console.heard()
    assert [m.values["seq"] for m in said if m.name == "MISSION_REQUEST_INT"] == [0] * 5
    assert [m.values["type"] for m in said if m.name == "MISSION_ACK"] == [CANCELLED]
    assert afloat.endpoint.mission_transfer.next_deadline is None
    assert console.current()["mission_id"] == before
    assert console.upload([waypoint(0), waypoint(1)])[0]["type"] == ACCEPTED


def test_a_station_that_always_sends_another_item_ends_its_upload(afloat):
    console = Console(afloat)
    console.say("MISSION_COUNT", count=2)
    said = []
    for _ in range(20):
        afloat.now += 0.1
        said += console.say("MISSION_ITEM_INT", **waypoint(1))
        afloat.endpoint.mission_transfer.poll(afloat.now)
        said += console.heard()
    names = [m.name for m in said if m.name.startswith("MISSION")]
    assert names[:7] == ["MISSION_REQUEST_INT"] * 6 + ["MISSION_ACK"]
    assert next(m for m in said if m.name == "MISSION_ACK").values["type"] == CANCELLED


def test_a_second_station_is_denied_while_one_uploads(afloat):
    first, second = Console(afloat), Console(afloat, system=254)
    first.say("MISSION_COUNT", count=2)
    (ack,) = second.say("MISSION_COUNT", count=2)
    assert (ack.name, ack.values["type"]) == ("MISSION_ACK", DENIED)
    assert second.say("MISSION_ITEM_INT", **waypoint(0)) == []
    assert second.say("MISSION_CLEAR_ALL")[0].values["type"] == DENIED
    other = Console(afloat)  # another program behind the same address
    other.session, other.system = first.session, 250
    other.frames = first.frames
    assert other.say("MISSION_COUNT", count=1)[0].values["type"] == DENIED
    (restart,) = first.say("MISSION_COUNT", count=1)
    assert (restart.name, restart.values["seq"]) == ("MISSION_REQUEST_INT", 0)
    (ack,) = first.say("MISSION_ITEM_INT", **waypoint(0))
    assert ack.values["type"] == ACCEPTED


def test_where_frames_are_lost_the_answer_is_repeated_until_the_station_goes_on(afloat):
    console = Console(afloat)

    def later():
        said = []
        for _ in range(30):
            afloat.now += 0.1
            afloat.endpoint.mission_transfer.poll(afloat.now)
            said += console.heard()
        return [(m.name, m.values["type"], m.values["opaque_id"]) for m in said]

    console.upload([waypoint(0)])
    assert later() == [], "no frames were lost"
    for number in (1, 2, 4):
        (beat,), _ = split(encode(DIALECT.by_name["HEARTBEAT"], b"\6", number, 255, 190), DIALECT)
        console.session.received.receive(beat)
    ack, _ = console.upload([waypoint(0, z=-3.0)])
    assert later() == [("MISSION_ACK", ACCEPTED, ack["opaque_id"])] * 2
    console.upload([waypoint(0, z=-4.0)])
    console.download()
    assert later() == []
    assert afloat.endpoint.mission_transfer.next_deadline is None


def test_a_station_can_cancel_its_upload(afloat):
    console = Console(afloat)
    console.say("MISSION_COUNT", count=2)
    assert console.say("MISSION_ACK", type=CANCELLED) == []
    assert console.say("MISSION_ITEM_INT", **waypoint(0))[0].values["type"] == BAD_SEQUENCE


@pytest.mark.parametrize(
    ("wrong", "result", "words"),
    [
        (dict(z=5.0), INVALID_7, "above the surface"),
        (dict(command=177), UNSUPPORTED, "DO_JUMP"),
        (dict(frame=1), BAD_FRAME, "frame 1"),
        (dict(z=math.nan), INVALID_7, "not a number"),
        (dict(x=2**31 - 1), 10, "latitude"),
    ],
)
def test_an_item_that_cannot_be_is_refused_with_its_number(afloat, wrong, result, words):
    console = Console(afloat)
    console.upload([waypoint(0)])
    before = console.current()["mission_id"]
    ack, texts = console.upload([waypoint(0), waypoint(1, **wrong)])
    assert ack["type"] == result
    assert "item 1" in texts[0]
    assert words in texts[0]
    assert console.current()["mission_id"] == before


def test_too_many_items_other_types_and_no_items(afloat):
    console = Console(afloat)
    ack, text = console.say("MISSION_COUNT", count=65535)
    assert (ack.values["type"], text.name) == (NO_SPACE, "STATUSTEXT")
    for kind in (RALLY, 7, ALL):
        assert console.say("MISSION_COUNT", count=2, mission_type=kind)[0].values["type"] == UNSUPPORTED
    assert console.say("MISSION_COUNT", count=0, mission_type=RALLY)[0].values["type"] == ACCEPTED
    assert console.download(RALLY)[0]["count"] == 0
    assert console.say("MISSION_REQUEST_LIST", mission_type=9)[0].values["type"] == UNSUPPORTED
    console.upload([waypoint(0)])
    assert console.upload([])[0]["type"] == ACCEPTED
    current = console.current()
    assert (current["total"], current["mission_id"], current["mission_state"]) == (0xFFFF, 0, 1)


def test_clear_deletes_the_plan_that_was_uploaded_and_no_other(afloat):
    console = Console(afloat)
    console.upload([waypoint(0)])
    assert console.say("MISSION_CLEAR_ALL", mission_type=ALL)[0].values["type"] == ACCEPTED
    assert afloat.requests[-1].op == imc.PlanDB.Op.DEL
    afloat.plans["survey"] = imc.PlanSpecification(
        plan_id="survey", start_man_id="a", maneuvers=(imc.PlanManeuver(maneuver_id="a", data=imc.Goto(lat=0.7)),)
    )
    afloat.endpoint.mission.on_plan_db(
        imc.PlanDB(type=imc.PlanDB.Type.SUCCESS, op=imc.PlanDB.Op.SET, plan_id="survey"), afloat.now
    )
    assert console.current()["total"] == 1
    assert console.say("MISSION_CLEAR_ALL")[0].values["type"] == ACCEPTED
    assert afloat.requests[-1].op == imc.PlanDB.Op.GET
    assert console.current()["mission_state"] == 1


def test_a_part_of_a_mission_is_replaced(afloat):
    console = Console(afloat)
    console.upload([waypoint(0), waypoint(1), waypoint(2)])
    (request,) = console.say("MISSION_WRITE_PARTIAL_LIST", start_index=1, end_index=1)
    assert request.values["seq"] == 1
    (ack,) = console.say("MISSION_ITEM_INT", **waypoint(1, z=-4.0))
    assert ack.values["type"] == ACCEPTED
    assert [m["z"] for m in console.download()[1]] == [-10.0, -4.0, -10.0]
    for begin, end in ((2, 3), (-2, 0), (2, 1)):
        assert (
            console.say("MISSION_WRITE_PARTIAL_LIST", start_index=begin, end_index=end)[0].values["type"]
            == BAD_SEQUENCE
        )


@settings(max_examples=150)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(sorted(NAMES)),
            st.binary(max_size=40),
            st.integers(0, 1),
        ),
        max_size=30,
    )
)
def test_no_sequence_of_messages_raises_or_stays_open(open_desk, messages):
    desk = open_desk()
    desk.locate()
    consoles = [Console(desk), Console(desk, "ardupilot", 254)]
    for name, payload, who in messages:
        definition = DIALECT.by_name[name]
        packet = encode(definition, definition.pad_payload(payload), 0, consoles[who].system, 190)
        (message,), _ = split(packet, DIALECT)
        desk.endpoint.dispatch(consoles[who].session, message, desk.now)
        desk.now += 0.05
        desk.endpoint.mission_transfer.poll(desk.now)
    for _ in range(20):
        desk.now += 0.3
        desk.endpoint.mission_transfer.poll(desk.now)
    assert desk.endpoint.mission_transfer.next_deadline is None
