"""Who may send packets, from where, and where to send to them."""

import pytest

import imc
from imc.console_acl import REPORTS, ConsoleAcl
from imc.discovery import Endpoint, Service, Services
from tasks.transports.imc_links.datagram_filter import (
    NEW_RATE,
    NOT_LISTED,
    SPOOFED,
    STRANGERS,
    DatagramFilter,
    sender_text,
)
from tasks.transports.imc_links.peer_table import (
    ELSEWHERE,
    KEPT,
    MALFORMED,
    MISSED,
    MOST_PEERS,
    TOO_FAST,
    UNKNOWN,
    DropCounts,
    Peer,
    PeerTable,
)

OWN, CONSOLE, NOW = 0x1A, 0x4042, 1e9


def at(*places, uid=""):
    return Services.from_system_info([Service("imc+udp", address, port) for address, port in places], uid=uid)


def packet(src=CONSOLE, message=None, order="little"):
    return imc.encode((message or imc.Heartbeat()).replace(src=src, timestamp=NOW), order)


class Scene:
    """A gate and its peers; `sends` judges a packet and takes note of it."""

    def __init__(self, *, consoles=(), rate=2000.0, **options):
        self.peers = PeerTable(rate=rate)
        self.gate = DatagramFilter(OWN, self.peers, ConsoleAcl(consoles, {"neptus": CONSOLE}.get), **options)

    def sends(self, data=None, address="10.0.0.7", port=6001, now=NOW):
        peer = self.gate.evaluate(packet() if data is None else data, address, port, now)
        if isinstance(peer, Peer):
            peer.source, peer.received_at = address, now
        return peer

    def targets(self, now=NOW):
        return [endpoint for _, endpoint in self.peers.contacts(now)]


def test_a_peer_announces_then_sends_then_gets():
    scene = Scene()
    assert scene.sends() == UNKNOWN
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001)), NOW)
    assert scene.targets() == []
    assert scene.sends(port=50000) is scene.peers.find(CONSOLE)
    assert scene.targets() == [Endpoint("10.0.0.7", 6001)], "not the port that it sent from"


@pytest.mark.parametrize("order", ["little", "big"])
def test_both_byte_orders_are_judged_alike(order):
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001)), NOW)
    assert isinstance(scene.sends(packet(order=order)), Peer)
    assert scene.sends(packet(OWN, order=order)) == SPOOFED
    assert scene.sends(packet(0x4043, order=order)) == UNKNOWN


def test_another_address_is_refused_until_it_is_announced_and_both_count_for_a_while():
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001)), NOW)
    assert scene.sends(address="10.0.0.8") == ELSEWHERE
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.8", 6001)), NOW + 1)
    assert isinstance(scene.sends(address="10.0.0.7"), Peer)
    assert isinstance(scene.sends(address="10.0.0.8"), Peer)
    assert scene.targets() == [Endpoint("10.0.0.8", 6001)]
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.8", 6001)), NOW + KEPT)
    assert scene.sends(address="10.0.0.7", now=NOW + KEPT) == ELSEWHERE


def test_a_restarted_system_is_where_it_says_now():
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001), uid=1), NOW)
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.8", 6001), uid=2), NOW + 1)
    assert scene.sends(address="10.0.0.7") == ELSEWHERE
    scene.peers.on_announce(CONSOLE, "ccu", Services(), NOW + 2)  # heard by another way, without a uid
    assert isinstance(scene.sends(address="10.0.0.8"), Peer)


def test_a_sender_on_loopback_is_on_this_computer_whatever_it_announces():
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "imcpy", at(("192.0.2.2", 6001)), NOW)
    assert isinstance(scene.sends(address="127.0.0.1"), Peer)
    assert scene.targets() == [Endpoint("127.0.0.1", 6001)]


def test_a_system_without_an_address_may_send_and_gets_nothing():
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "ccu", Services(), NOW)
    assert isinstance(scene.sends(), Peer)
    assert scene.targets() == []


def test_a_called_system_gets_packets_before_it_has_sent_one():
    scene = Scene()
    scene.peers.called = [CONSOLE]
    scene.peers.on_announce(CONSOLE, "dune", at(("10.0.0.7", 6002), ("10.0.0.8", 6002)), NOW)
    assert scene.targets() == [Endpoint("10.0.0.7", 6002)]


def test_silence_ends_the_contact_and_later_the_peer():
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001)), NOW)
    scene.sends()
    assert scene.peers.remove_silent(NOW + 29) == []
    assert [peer.name for peer in scene.peers.remove_silent(NOW + 31)] == ["ccu"]
    assert scene.targets(NOW + 31) == []
    scene.peers.remove_silent(NOW + KEPT + 1)
    assert len(scene.peers) == 0


def test_who_was_in_contact_is_received_at_once_after_a_long_cut():
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001)), NOW)
    scene.sends().taken = True
    for now in (61, 62):
        scene.peers.remove_silent(NOW + now)
    assert isinstance(scene.sends(now=NOW + 62), Peer), "its next Announce may be 10 s away"
    assert scene.targets(NOW + 62) == [Endpoint("10.0.0.7", 6001)]
    scene.peers.remove_silent(NOW + 62 + MISSED)
    scene.peers.remove_silent(NOW + 62 + MISSED)
    assert len(scene.peers) == 0


def test_the_rate_of_a_peer_is_bounded_and_comes_back():
    scene = Scene(rate=10.0)
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001)), NOW)
    found = [scene.sends(now=NOW + 1) for _ in range(100)]
    assert sum(isinstance(peer, Peer) for peer in found) == 10
    assert found[-1] == TOO_FAST
    assert sum(isinstance(scene.sends(now=NOW + 1.5), Peer) for _ in range(100)) == 5


def test_strangers_need_an_announce_unless_the_profile_knows_them():
    static = Scene(static=[Endpoint("10.0.0.7", 6001)])
    assert isinstance(static.sends(), Peer)
    assert static.sends(packet(0x4043), address="10.0.0.8") == UNKNOWN
    trusting = Scene(ignore_filter=True)
    assert isinstance(trusting.sends(), Peer)
    assert trusting.targets() == [], "nothing is sent to an address that nobody announced"


@pytest.mark.parametrize("data", [b"", b"\x54\xfe", bytes(21), b"\x55" * 40])
def test_what_is_no_packet_is_malformed_and_names_no_source(data):
    assert Scene().sends(data) == MALFORMED
    assert sender_text(data, "10.0.0.7") == "10.0.0.7"


def test_listed_consoles_command_from_their_addresses_and_others_report():
    scene = Scene(consoles=["neptus@10.0.0.7", "0x4043"])
    for system in (CONSOLE, 0x4043, 0x4044):
        scene.peers.on_announce(system, "ccu", at(("10.0.0.7", 6001), ("10.0.0.8", 6001)), NOW)
    stop = imc.PlanControl(op=imc.PlanControl.Op.STOP)

    def obeyed(system, address, message=stop):
        return isinstance(scene.sends(packet(system, message), address), Peer)

    assert obeyed(CONSOLE, "10.0.0.7")
    assert not obeyed(CONSOLE, "10.0.0.8")
    assert obeyed(0x4043, "10.0.0.8")
    assert not obeyed(0x4044, "10.0.0.7")
    assert scene.sends(packet(0x4044, stop)) == NOT_LISTED
    assert obeyed(0x4044, "10.0.0.7", imc.EstimatedState())
    assert not obeyed(0x4044, "10.0.0.7", imc.Abort())


def test_no_task_obeys_what_anybody_may_report():
    commands = (imc.PlanControl, imc.PlanDB, imc.SetEntityParameters, imc.VehicleCommand, imc.Abort, imc.Teleoperation)
    commands += (imc.RemoteActions, imc.LoggingControl, imc.OperationalLimits, imc.PowerOperation, imc.RestartSystem)
    assert not REPORTS & {kind.ID for kind in commands}


@pytest.mark.parametrize(
    ("item", "reason"),
    [("nobody", "is not in"), ("0x10000", "is not the id"), ("-1", "is not the id"), ("neptus@host", "IPv4")],
)
def test_a_wrong_console_is_an_error(item, reason):
    with pytest.raises(ValueError, match=reason):
        ConsoleAcl([item], {"neptus": CONSOLE}.get)


def test_more_systems_than_there_is_room_for():
    peers = PeerTable(kept=[1])
    for system in range(1, 1000):
        assert peers.on_announce(system, f"x{system}", Services(), NOW + system)
    assert len(peers) == MOST_PEERS
    assert peers.find(1), "a listed console stays"
    assert peers.find(999)
    for peer in peers:
        peer.source, peer.received_at = "10.0.0.7", NOW + 1000
    assert peers.on_announce(2000, "late", Services(), NOW + 1000)
    assert len(peers) == MOST_PEERS
    assert peers.find(1), "a listed console stays"
    assert [peer.name for peer in peers.remove_silent(NOW + 1000)] == ["x937"], "who gave way, though in contact"


def test_nobody_shuts_out_an_operator_by_many_names():
    """First gives way who has more than a share of the places, then who never commanded, then the longest silent."""
    peers = PeerTable()

    def join(system, address, commands=False):
        peer = peers.on_announce(system, "", Services(), NOW)
        peer.source, peer.received_at, peer.commands = address, NOW + system / 1e3, commands

    join(1, "10.0.0.1", commands=True)
    join(2, "10.0.0.1")
    for system in range(100, 162):
        join(system, "10.0.0.9", commands=True)
    for system in range(200, 246):
        join(system, f"10.0.1.{system}")
    assert [peers.find(system) is not None for system in (1, 2, 100, 145, 146, 161)] == [True] * 2 + [False] * 2 + [
        True
    ] * 2
    join(300, "10.0.2.1")
    assert peers.find(1), "it has commanded"
    assert not peers.find(2), "the longest silent of those that have not"


def test_a_place_that_refuses_packets_ends_the_contact_of_who_is_silent():
    scene = Scene()
    scene.peers.on_announce(CONSOLE, "ccu", at(("10.0.0.7", 6001)), NOW)
    scene.sends()
    place = Endpoint("10.0.0.7", 6001)
    assert scene.peers.on_port_unreachable(place, NOW + 1) == [], "it sends Heartbeat: its port may only be closed"
    assert [peer.system for peer in scene.peers.on_port_unreachable(place, NOW + 3)] == [CONSOLE]
    assert scene.targets(NOW + 3) == []
    assert isinstance(scene.sends(now=NOW + 4), Peer)
    assert scene.targets(NOW + 4) == [place]


def test_an_abort_for_this_vehicle_needs_no_announce():
    def obeyed(scene, target):
        return isinstance(scene.sends(packet(message=imc.Abort(dst=target))), Peer)

    assert obeyed(Scene(), OWN)
    assert not obeyed(Scene(), 0xFFFF)
    assert not obeyed(Scene(consoles=["0x4043"]), OWN)
    scene = Scene()
    assert sum(obeyed(scene, OWN) for _ in range(100)) == STRANGERS


def test_announces_in_ever_new_names_make_few_peers_and_a_peer_that_moves_is_still_taken():
    gate, seconds, rate = Scene().gate, 15, 600
    announce = packet(message=imc.Announce(sys_name="x"))
    taken = sum(gate.is_unknown_sender_announce(announce, UNKNOWN, NOW + i / rate) for i in range(seconds * rate))
    assert STRANGERS <= taken <= STRANGERS + NEW_RATE * seconds
    assert gate.is_unknown_sender_announce(announce, ELSEWHERE, NOW + seconds)


def test_drops_are_counted_by_sender_and_their_number_is_bounded():
    drops = DropCounts()
    assert drops.add("too fast", "a")
    assert not drops.add("too fast", "a")
    assert drops.add("malformed", "a")
    for i in range(10_000):
        drops.add("too fast", f"b{i}")
    assert len(drops["too fast"]) == 65
    assert str(drops) == "10002 too fast (others: 9937), 1 malformed (a)"
    assert str(DropCounts()) == ""


def test_a_new_sender_is_named_however_many_there_were_long_ago():
    drops = DropCounts()
    for i in range(100):
        drops.add("not announced", f"b{i}")
    for now in range(1000):
        drops.add("not announced", "b7")
        drops.merge_inactive(NOW + now)
    assert drops.add("not announced", "late")
    assert not drops.add("not announced", "b7"), "it goes on"
    assert dict(drops["not announced"]) == {"b7": 1002, "others": 99, "late": 1}
