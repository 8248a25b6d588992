"""One list of who may command, for all networks: systems, ground stations, addresses."""

import pytest

import imc
from imc.console_acl import ANSWERS, CONTEXT, OVER_ZENOH, ConsoleAcl, OrderRefusals

NAMES = {"neptus": 0x4001}.get
LISTED = ConsoleAcl(
    ["neptus", "0x4101@10.0.0.5", "0x4102@zenoh", "mavlink:255@10.0.0.7", "mavlink:250", "mavlink:9@/dev/ttyUSB0"],
    NAMES,
)
ORDER, REPORT = imc.PlanControl.ID, imc.EstimatedState.ID


@pytest.mark.parametrize(
    ("system", "place", "may"),
    [
        (0x4001, "10.0.0.9", True),
        (0x4001, OVER_ZENOH, True),
        (0x4101, "10.0.0.5", True),
        (0x4101, "10.0.0.9", False),
        (0x4101, OVER_ZENOH, False),
        (0x4102, OVER_ZENOH, True),
        (0x4102, "10.0.0.9", False),
        (0x4103, OVER_ZENOH, False),
        (255, "10.0.0.7", False),
    ],
)
def test_a_system_commands_from_where_the_list_says_and_reports_from_anywhere(system, place, may):
    assert LISTED.allows(system, place, ORDER) is may
    assert LISTED.allows(system, place, REPORT)


@pytest.mark.parametrize(
    ("system", "place", "may"),
    [
        (250, "10.0.0.9", True),
        (255, "10.0.0.7", True),
        (255, "10.0.0.9", False),
        (9, "/dev/ttyUSB0", True),
        (9, "/dev/ttyUSB1", False),
        (1, "10.0.0.7", False),
    ],
)
def test_a_ground_station_commands_by_its_mavlink_id_and_place(system, place, may):
    assert LISTED.allows_station(system, place) is may


def test_clients_without_an_id_need_an_address_in_the_list():
    assert [LISTED.allows_address(place) for place in ("10.0.0.5", "10.0.0.7", "10.0.0.9")] == [True, True, False]


def test_one_item_closes_all_entrances_and_none_leaves_them_open():
    stations = ConsoleAcl(["mavlink:255"], NAMES)
    assert not stations.allows(0x4001, "10.0.0.9", ORDER)
    consoles = ConsoleAcl(["neptus"], NAMES)
    assert not consoles.allows_station(255, "10.0.0.9")
    assert not consoles.allows_address("10.0.0.9")
    anybody = ConsoleAcl([" ", ""], NAMES)
    assert anybody.allows(0x4001, "10.0.0.9", ORDER)
    assert anybody.allows_station(255, "10.0.0.9")
    assert anybody.allows_address("10.0.0.9")


@pytest.mark.parametrize(
    ("item", "reason"),
    [
        ("mavlink:0", "not a MAVLink system id"),
        ("mavlink:256", "not a MAVLink system id"),
        ("mavlink:qgc", "not a MAVLink system id"),
        ("mavlink:255@pc", "neither an address nor a serial device"),
        ("neptus@pc", "not an IPv4 address"),
        ("neptune", "not in \\[IMC Addresses\\]"),
    ],
)
def test_an_item_that_means_nothing_is_an_error(item, reason):
    with pytest.raises(ValueError, match=reason):
        ConsoleAcl([item], NAMES)


def test_answers_name_the_order_and_are_not_sent_for_each_of_a_thousand():
    refusals = OrderRefusals("otter", 0x0999)
    packet = imc.encode(imc.PlanControl(src=0x4042, src_ent=7, dst=0x0999))
    answers = [answer for n in range(1000) if (answer := refusals.answer(packet, 1000.0 + n * 0.001))]
    assert len(answers) == ANSWERS
    first = imc.decode(answers[0])
    assert isinstance(first, imc.LogBookEntry)
    assert first.context == CONTEXT
    assert first.text == "PlanControl of 0x4042 rejected: not in [General] Consoles of otter"
    assert (first.src, first.dst, first.dst_ent) == (0x0999, 0x4042, 7)
    assert refusals.answer(packet, 1002.5)
    for system in range(0x4100, 0x4200):  # a flood of ids is bounded, and each still gets its first answer
        assert refusals.answer(imc.encode(imc.Abort(src=system)), 1003.0)
    assert refusals.answer(imc.encode(imc.Abort(src=0xFFFF)), 1003.0) is None
