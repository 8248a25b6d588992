"""Which of several links to a system is heard."""

import time

from shoal.network import UDPLink, ZenohLink
from shoal.network.systems import FRESH, System


def test_the_link_that_brings_all_messages_is_heard_while_it_brings_any() -> None:
    udp, zenoh, system = UDPLink(), ZenohLink([]), System("lauv-noptilus-1")
    system.links = {"udp": udp, "zenoh": zenoh}
    now = time.monotonic()
    system.last = {"udp": now}
    assert (system.takes(udp), system.takes(zenoh)) == (True, True)
    system.last["zenoh"] = now
    assert (system.takes(udp), system.takes(zenoh)) == (False, True)
    system.last["zenoh"] = now - FRESH - 1.0
    assert system.takes(udp)
