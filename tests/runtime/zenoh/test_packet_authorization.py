"""What may arrive from whom: a vehicle is commanded at its own keys only, and each name stands for one system."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import imc
from imc.console_acl import ConsoleAcl
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport
from runtime.zenoh.packet_authorization import PacketAuthorizer
from runtime.zenoh.security import Security
from runtime.zenoh.unlisted_consoles import UnlistedConsoles
from tests.outside import until
from tests.runtime.zenoh.processes import Network
from tests.runtime.zenoh.test_security import certificates

OWN, OTTER, CARAVEL, MANTA, GROUND = 0x001A, 0x2201, 0x0804, 0x0805, 0x4001
NAMES = {OWN: "pole", OTTER: "otter", CARAVEL: "caravel"}
SIBLING = "5161"


def named(system: int) -> str:
    return NAMES.get(system, f"0x{system:04X}")


def gate(*listed: str) -> PacketAuthorizer:
    """Of the vehicle pole, while otter runs on the bus."""
    running = {"otter": frozenset({OTTER}), "pole": frozenset({OWN})}
    part = ProcessPart("pole", OWN, 1)
    profile = {"manta": MANTA, "otter": 0x0999, "station": GROUND}
    return PacketAuthorizer(part, listed, lambda: running, named, lambda zid: zid == SIBLING, profile.get)


REFUSED = [
    ("otter/PlanControl/X", imc.PlanControl(src=OTTER, dst=OWN), "a command belongs to imc/pole/@cmd"),
    ("otter/PlanControl/X", imc.PlanControl(src=GROUND, dst=OWN), "a command belongs to imc/pole/@cmd"),
    ("ccu/PlanControl/X", imc.PlanControl(src=GROUND, dst=OWN), "a command belongs to imc/pole/@cmd"),
    ("otter/SetEntityParameters/X", imc.SetEntityParameters(src=GROUND), "of 0x4001, which is not otter"),
    ("otter/PlanControl/X", imc.PlanControl(src=GROUND, dst=0xFFF0), "of 0x4001, which is not otter"),
    ("otter/EstimatedState/X", imc.EstimatedState(src=CARAVEL), "of 0x0804, which is not otter"),
    ("otter/EstimatedState/X", imc.EstimatedState(src=OWN), "in the name of this vehicle"),
    ("otter/Abort/X", imc.Abort(src=OTTER), "an Abort of another vehicle for all"),
    ("otter/Abort/X", imc.Abort(src=OTTER, dst=0xFFF0), "an Abort of another vehicle for all"),
    ("otter/MessagePart/X", imc.MessagePart(src=OTTER), "a part of a message, which may be a command, of another"),
    ("manta/Abort/X", imc.Abort(src=GROUND), "of 0x4001, which is not manta"),
    ("manta/Abort/X", imc.Abort(src=MANTA), "an Abort of another vehicle for all"),
    ("pole/EstimatedState/X", imc.EstimatedState(src=GROUND), "of 0x4001, which is not pole"),
    ("pole/@heard/Heartbeat/ccu", imc.Heartbeat(src=GROUND), "in the name of this vehicle"),
    ("pole/@cmd/Abort/pole", imc.Abort(src=OWN, dst=OWN), "in the name of this vehicle"),
    ("otter/@cmd/Abort/ccu", imc.Abort(src=GROUND), "a command at another system's key"),
    ("otter/@cmd/Abort/ccu", imc.Abort(src=GROUND, dst=OWN), "a command at another system's key"),
]
TAKEN = [
    ("otter/EstimatedState/Navigation", imc.EstimatedState(src=OTTER)),
    ("otter/Heartbeat/Daemon", imc.Heartbeat(src=OTTER, dst=0)),
    ("otter/@cmd/PlanControl/ccu", imc.PlanControl(src=GROUND, dst=OTTER)),
    ("ccu/Abort/ccu", imc.Abort(src=GROUND)),
    ("station/Abort/ccu", imc.Abort(src=0x4002)),
    ("manta/EstimatedState/Navigation", imc.EstimatedState(src=MANTA)),
    ("ccu/Heartbeat/ccu", imc.Heartbeat(src=GROUND, dst=0xFFF0)),
    ("buoy/Temperature/T", imc.Temperature(src=0x7777)),
    ("pole/@cmd/PlanControl/ccu", imc.PlanControl(src=GROUND, dst=OWN)),
    ("pole/@cmd/PlanDB/otter", imc.PlanDB(src=OTTER, dst=OWN)),
    ("0x001A/@cmd/PlanControl/ccu", imc.PlanControl(src=GROUND, dst=OWN)),
    ("0xFFF0/@cmd/Abort/ccu", imc.Abort(src=GROUND, dst=0xFFF0)),
]
OF_SIBLINGS = [
    ("pole/EstimatedState/Navigation", imc.EstimatedState(src=OWN)),
    ("pole/@cmd/Abort/pole", imc.Abort(src=OWN, dst=OWN)),
    ("pole/@cmd/Abort/ccu", imc.Abort(src=GROUND, dst=OWN)),
    ("pole/@heard/Abort/ccu", imc.Abort(src=GROUND, dst=0xFFF0)),
]


@pytest.mark.parametrize(("key", "message", "why"), REFUSED)
def test_what_is_not_its_senders_to_say_is_refused_with_its_reason(key: str, message: imc.Message, why: str) -> None:
    for order in ("little", "big"):
        assert why in gate().reject_reason(f"imc/{key}", imc.encode(message, order), "other")


@pytest.mark.parametrize(("key", "message"), TAKEN)
def test_what_honest_programs_send_is_taken(key: str, message: imc.Message) -> None:
    for listed in ((), ("otter",)):
        assert gate(*listed).reject_reason(f"imc/{key}", imc.encode(message), "") == ""


@pytest.mark.parametrize(("key", "message"), OF_SIBLINGS)
def test_what_the_processes_of_a_vehicle_send_each_other_is_taken(key: str, message: imc.Message) -> None:
    assert gate().reject_reason(f"imc/{key}", imc.encode(message), SIBLING) == ""


def test_a_vehicle_that_is_only_listed_speaks_for_no_console_and_no_known_vehicle() -> None:
    caravel = gate("caravel")
    for source, why in ((CARAVEL, ""), (0x7777, ""), (GROUND, "of 0x4001"), (OTTER, "of otter, which is not caravel")):
        packet = imc.encode(imc.EstimatedState(src=source))
        assert why in caravel.reject_reason("imc/caravel/EstimatedState/X", packet, "")
        assert bool(why) == bool(caravel.reject_reason("imc/caravel/EstimatedState/X", packet, ""))


LISTED = 0x4101
ORDERS = [
    ("pole/@cmd/PlanControl/ccu", imc.PlanControl(src=GROUND, dst=OWN), True),
    ("pole/@cmd/PlanDB/otter", imc.PlanDB(src=OTTER, dst=OWN), True),
    ("ccu/Abort/ccu", imc.Abort(src=GROUND), True),
    ("otter/Rpm/Motor", imc.Rpm(src=OTTER), False),
]
NO_ORDERS = [
    ("pole/@cmd/PlanControl/ccu", imc.PlanControl(src=LISTED, dst=OWN), "other"),
    ("ccu/Heartbeat/ccu", imc.Heartbeat(src=GROUND), "other"),
    ("otter/EstimatedState/Navigation", imc.EstimatedState(src=OTTER), "other"),
    ("pole/@cmd/Abort/ccu", imc.Abort(src=GROUND, dst=OWN), SIBLING),
    ("pole/@heard/Abort/ccu", imc.Abort(src=GROUND), SIBLING),
]


def closed_gate(process: str = "main") -> tuple[PacketAuthorizer, UnlistedConsoles, list[str], list[imc.Message]]:
    """Of the vehicle pole, which only one console may command; what it logs, and what it answers."""
    part = ProcessPart("pole", OWN, 1, process)
    told: list[str] = []
    answers: list[imc.Message] = []
    acl = ConsoleAcl([f"0x{LISTED:04X}"], lambda _: None)
    consoles = UnlistedConsoles(acl, part, told.append, lambda _, packet: answers.append(imc.decode(packet)))
    running = {"otter": frozenset({OTTER}), "pole": frozenset({OWN})}
    found = PacketAuthorizer(part, (), lambda: running, named, lambda zid: zid == SIBLING, consoles=consoles)
    return found, consoles, told, answers


@pytest.mark.parametrize(("key", "message", "is_answered"), ORDERS)
def test_an_order_of_a_console_that_is_not_listed_is_named_once_and_answered(
    key: str, message: imc.Message, is_answered: bool
) -> None:
    closed, consoles, told, answers = closed_gate()
    for _ in range(1000):
        assert closed.is_of_unlisted_console(f"imc/{key}", imc.encode(message), "other")
    assert (consoles.rejected, consoles.dropped) == ((1000, 0) if is_answered else (0, 1000))
    (text,) = told
    assert f"0x{message.src:04X}" in text
    assert "[General] Consoles" in text
    assert bool(answers) == is_answered
    assert len(answers) < 10
    assert {answer.dst for answer in answers} <= {message.src}


@pytest.mark.parametrize(("key", "message", "session"), NO_ORDERS)
def test_listed_consoles_reports_and_the_processes_of_a_vehicle_pass_a_list(
    key: str, message: imc.Message, session: str
) -> None:
    closed, consoles, told, answers = closed_gate()
    assert not closed.is_of_unlisted_console(f"imc/{key}", imc.encode(message), session)
    assert (consoles.rejected, told, answers) == (0, [], [])


def test_only_the_main_process_of_a_vehicle_answers() -> None:
    closed, consoles, told, answers = closed_gate("vision")
    assert closed.is_of_unlisted_console(f"imc/{ORDERS[0][0]}", imc.encode(ORDERS[0][1]), "other")
    assert (consoles.rejected, told, answers) == (1, [], [])


@pytest.fixture
def pole(network: Network, openssl: str, tmp_path: Path) -> Iterator[tuple[ZenohTransport, list[imc.Message], str]]:
    """A vehicle that a certificate for otter may join, what it receives, and where it listens."""
    certificates(openssl, tmp_path, "pole", "otter")
    pem, key, ca = (tmp_path / name for name in ("pole.pem", "pole.key", "ca.pem"))
    endpoint = f"tls/127.0.0.1:{network.local_port + 2}"
    config = ZenohConfig(
        local_port=network.local_port,
        scouting="none",
        listen=(endpoint,),
        security=Security(ca, pem, key, vehicles=("otter",)),
        vehicle="pole",
    )
    transport = ZenohTransport(config, named, lambda *_: "Navigation", part=ProcessPart("pole", OWN, 1))
    heard: list[imc.Message] = []
    transport.open(lambda packet: heard.append(imc.decode(packet)))
    yield transport, heard, endpoint
    transport.close()


@pytest.mark.heavy
def test_a_vehicle_with_a_certificate_cannot_command_another_one(
    network: Network, pole: tuple[ZenohTransport, list[imc.Message], str], tmp_path: Path
) -> None:
    transport, heard, endpoint = pole
    tls = "transport/link/tls"
    options: dict[str, Any] = {
        "connect/endpoints": [endpoint],
        f"{tls}/root_ca_certificate": str(tmp_path / "ca.pem"),
        f"{tls}/enable_mtls": True,
        f"{tls}/connect_certificate": str(tmp_path / "otter.pem"),
        f"{tls}/connect_private_key": str(tmp_path / "otter.key"),
    }
    otter = network.asker("client", options)
    assert otter.line() == {"opened": True}

    def put(key: str, abbrev: str, **fields: int) -> None:
        otter.ask(f"put imc/otter/{key}/X {json.dumps({'abbrev': abbrev, **fields})}")

    def met() -> bool:
        put("Depth", "Depth", src=OTTER)
        return bool(heard)

    until(met)
    for abbrev in ("PlanControl", "SetEntityParameters", "PlanDB"):
        for source in (OTTER, GROUND):
            put(abbrev, abbrev, src=source, dst=OWN)
        put(abbrev, abbrev, src=GROUND)
    put("Abort", "Abort", src=OTTER)
    put("EstimatedState", "EstimatedState", src=GROUND)
    put("Salinity", "Salinity", src=OTTER)
    until(lambda: any(isinstance(message, imc.Salinity) for message in heard))
    assert {type(message) for message in heard} == {imc.Depth, imc.Salinity}
    assert transport.subscribers.rejected.total == 11
