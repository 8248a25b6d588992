"""Items of missions as bytes: nothing is lost, and the numbers are MAVLink's."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mission_samples import GARBAGE, X, Y, waypoint
from pymavlink.dialects.v20 import ardupilotmega

from mavlink import load_dialect
from mavlink.missions import BadItem, Item, MissionCommand, MissionResult, MissionType, opaque_id

DIALECT = load_dialect()
SENT, LEGACY = DIALECT.by_name["MISSION_ITEM_INT"], DIALECT.by_name["MISSION_ITEM"]


def test_commands_results_and_types_are_those_of_mavlink():
    def theirs(enumeration, prefix):
        return {value: entry.name.removeprefix(prefix) for value, entry in ardupilotmega.enums[enumeration].items()}

    for ours, names in (
        (MissionCommand, theirs("MAV_CMD", "MAV_CMD_")),
        (MissionResult, theirs("MAV_MISSION_RESULT", "MAV_MISSION_")),
        (MissionType, theirs("MAV_MISSION_TYPE", "MAV_MISSION_TYPE_")),
    ):
        assert {member.name: member.value for member in ours} == {names[member]: member.value for member in ours}


@given(GARBAGE)
def test_items_come_back_bit_by_bit(item):
    payload = SENT.pack({**item.fields(7), "target_system": 1, "target_component": 1})
    values = SENT.unpack(payload)
    again = Item.of(values)
    assert again.pack() == item.pack()
    assert SENT.pack({**again.fields(7), "target_system": 1, "target_component": 1}) == payload
    assert values["seq"] == 7


def test_a_quiet_nan_keeps_its_bits():
    bits = struct.pack("<I", 0x7FC12345)
    payload = bytearray(SENT.pack(waypoint(1).fields(0)))
    payload[0:4] = bits
    assert Item.of(SENT.unpack(bytes(payload))).pack()[:4] == bits


def test_an_old_item_has_its_position_in_degrees():
    item = Item.of_legacy(LEGACY.unpack(LEGACY.pack({"frame": 3, "command": 16, "x": 41.185, "y": -8.7062, "z": 20.0})))
    assert (item.x, item.y) == (pytest.approx(X, abs=20), pytest.approx(Y, abs=5))  # a float has 7 digits
    assert (item.frame, item.z) == (3, 20.0)
    again = LEGACY.unpack(LEGACY.pack(item.legacy_fields(3)))
    assert (again["x"], again["y"], again["seq"]) == (pytest.approx(41.185), pytest.approx(-8.7062), 3)
    speed = Item.of_legacy(LEGACY.unpack(LEGACY.pack({"frame": 2, "command": 178, "param2": 1.5, "x": math.nan})))
    assert (speed.param2, speed.x) == (1.5, 0)
    assert Item.of_legacy({**speed.legacy_fields(0), "x": 7.0}).x == 7  # a parameter, not degrees


@pytest.mark.parametrize(
    ("fields", "result", "text"),
    [
        ({"x": math.nan}, MissionResult.INVALID_PARAM5_X, "item 4 (NAV_WAYPOINT): x nan is no number of degrees"),
        ({"y": math.inf}, MissionResult.INVALID_PARAM6_Y, "item 4 (NAV_WAYPOINT): y inf is no number of degrees"),
        ({"x": 300.0}, MissionResult.INVALID_PARAM5_X, "item 4 (NAV_WAYPOINT): x 300 is no number of degrees"),
    ],
)
def test_an_old_item_without_a_position_is_refused(fields, result, text):
    with pytest.raises(BadItem) as refusal:
        Item.of_legacy({**waypoint(0).legacy_fields(4), **fields})
    assert (refusal.value.seq, refusal.value.result, str(refusal.value)) == (4, result, text)


@given(GARBAGE)
def test_an_old_item_is_an_item_or_refused(item):
    values = {**item.fields(0), "x": item.param1, "y": item.param2}
    try:
        result = type(Item.of_legacy(values).x)
    except BadItem as bad:
        result = bad.result
    assert result in (int, MissionResult.INVALID_PARAM5_X, MissionResult.INVALID_PARAM6_Y)


@given(st.lists(GARBAGE, max_size=4))
def test_opaque_ids_are_32_bits_and_never_0(items):
    assert 0 < opaque_id(items) < 1 << 32
    assert opaque_id([item._replace(current=3) for item in items]) == opaque_id(items)


def test_any_change_of_a_mission_changes_its_opaque_id():
    items = [waypoint(0), waypoint(10)]
    changed = [
        items[::-1], items[:1], [*items, items[0]], [items[0]._replace(frame=3), items[1]],
        [items[0]._replace(x=X + 1), items[1]], [items[0]._replace(param4=math.nan), items[1]],
    ]  # fmt: skip
    assert len({opaque_id(mission) for mission in (items, *changed)}) == 7
    assert opaque_id(items) == opaque_id(list(items))


@pytest.mark.parametrize("fields", [{"x": 10**30}, {"command": -5}, {"param1": 1e300}, {"frame": 999}])
def test_what_no_item_can_hold_has_an_id_too(fields):
    assert opaque_id([waypoint(0)._replace(**fields)])
