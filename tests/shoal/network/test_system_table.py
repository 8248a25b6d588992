"""Which of several links to a system is heard."""

import time

import pytest

import imc
from shoal.network import UDPLink, ZenohLink
from shoal.network.system_table import FORGOTTEN, FRESH, NetworkSystem, NetworkSystemTable


def test_the_link_that_brings_all_messages_is_received_while_it_brings_any() -> None:
    udp, zenoh, system = UDPLink(), ZenohLink([]), NetworkSystem("lauv-noptilus-1")
    system.links = {"udp": udp, "zenoh": zenoh}
    now = time.monotonic()
    system.last = {"udp": now}
    assert (system.accepts_link(udp), system.accepts_link(zenoh)) == (True, True)
    system.last["zenoh"] = now
    assert (system.accepts_link(udp), system.accepts_link(zenoh)) == (False, True)
    system.last["zenoh"] = now - FRESH - 1.0
    assert system.accepts_link(udp)


def test_a_second_vehicle_of_one_name_counts_as_long_as_it_is_received() -> None:
    systems = NetworkSystemTable()
    otter = systems.find_or_add("otter")
    assert otter is not None
    for number in (3, 4):
        systems.assign_id(otter, number, f"at 10.0.0.{number}")
    assert (otter.id, otter.others) == (3, {4: "at 10.0.0.4"})
    otter.seen[4] -= FORGOTTEN
    systems.assign_id(otter, 3, "")
    assert (otter.ids, otter.conflict_text) == ([3], "")
    systems.assign_id(otter, 4, "")
    assert "with the ids 0x0003, 0x0004" in otter.conflict_text
    otter.seen[3] -= FORGOTTEN
    systems.assign_id(otter, 4, "")
    assert (otter.id, otter.ids, otter.conflict_text) == (4, [4], "")


def running(systems: NetworkSystemTable, link: UDPLink, part: str) -> NetworkSystem:
    systems.add_process(link, "otter", part, "", 3)
    system = systems["otter"]
    for message in (imc.Announce(sys_name="otter"), imc.VehicleState(), imc.EntityList(op=0, list="GPS=1")):
        system.update(link, message.replace(src=3), "", is_received=True)
        system.store_latest(message.replace(src=3))
    return system


def test_nothing_that_a_vehicle_has_sent_before_its_restart_is_taken_for_the_present() -> None:
    systems, udp = NetworkSystemTable(), UDPLink()
    otter = running(systems, udp, "run 1")
    systems.remove_process(udp, "otter", "run 1", is_reported=True)
    assert otter.latest_message(imc.VehicleState) is not None, "the page shows the last state of a lost vehicle"
    systems.add_process(udp, "otter", "run 2", "", 3)
    assert (otter.latest_message(imc.VehicleState), otter.labels) == (None, {})
    assert otter.latest_message(imc.Announce) is not None, "its type is the same"


@pytest.mark.parametrize("case", ["lost for a moment", "a second process", "another link"])
def test_what_a_vehicle_has_sent_stays_known_while_it_runs(case: str) -> None:
    systems, udp, zenoh = NetworkSystemTable(), UDPLink(), ZenohLink([])
    otter = running(systems, udp, "run 1")
    if case == "lost for a moment":
        systems.remove_process(udp, "otter", "run 1", is_reported=False)
        systems.add_process(udp, "otter", "run 1", "", 3)
    elif case == "a second process":
        systems.add_process(udp, "otter", "camera", "", 3)
    else:
        systems.add_process(zenoh, "otter", "run 1 on zenoh", "", 3)
    assert otter.latest_message(imc.VehicleState) is not None
    assert otter.labels == {1: "GPS"}


def test_a_restart_that_two_links_notice_is_one() -> None:
    systems, udp, zenoh = NetworkSystemTable(), UDPLink(), ZenohLink([])
    for link in (udp, zenoh):
        running(systems, link, "run 1")
    systems.remove_process(zenoh, "otter", "run 1", is_reported=True)
    otter = running(systems, zenoh, "run 2")
    systems.remove_process(udp, "otter", "run 1", is_reported=True)
    systems.add_process(udp, "otter", "run 2", "", 3)
    assert otter.latest_message(imc.VehicleState) is not None
