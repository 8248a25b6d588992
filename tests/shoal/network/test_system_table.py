"""Which of several links to a system is heard."""

import time

from shoal.network import UDPLink, ZenohLink
from shoal.network.system_table import FORGOTTEN, FRESH, NetworkSystem, NetworkSystemTable


def test_the_link_that_brings_all_messages_is_heard_while_it_brings_any() -> None:
    udp, zenoh, system = UDPLink(), ZenohLink([]), NetworkSystem("lauv-noptilus-1")
    system.links = {"udp": udp, "zenoh": zenoh}
    now = time.monotonic()
    system.last = {"udp": now}
    assert (system.accepts_link(udp), system.accepts_link(zenoh)) == (True, True)
    system.last["zenoh"] = now
    assert (system.accepts_link(udp), system.accepts_link(zenoh)) == (False, True)
    system.last["zenoh"] = now - FRESH - 1.0
    assert system.accepts_link(udp)


def test_a_second_vehicle_of_one_name_counts_as_long_as_it_is_heard() -> None:
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
