"""Which process answers a query, and which query a reply is for."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
import zenoh

import imc
from runtime.bus import Request
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport
from runtime.zenoh.queryables import MOST_OF_ONE
from tests.outside import until
from tests.runtime.zenoh.processes import local_port

POLE, CAMERA, SONAR = 0x001A, 7, 8
STRANGER, CONSOLE = 0x4666, 0x4123
Received = list[bytes]


@pytest.fixture
def port() -> int:
    return local_port()


@pytest.fixture
def client(port: int, main: tuple[ZenohTransport, Received]) -> Iterator[Any]:
    config = zenoh.Config.from_json5(f'{{mode: "client", connect: {{endpoints: ["tcp/127.0.0.1:{port}"]}}}}')
    with zenoh.open(config) as session:
        yield session


def joined(port: int, process: str, entities: int) -> tuple[ZenohTransport, Received]:
    """A process of the vehicle pole; the camera is that of the process vision."""
    transport = ZenohTransport(
        ZenohConfig(local_port=port, scouting="none", vehicle="pole"),
        lambda number: f"0x{number:04X}" if number != POLE else "pole",
        lambda _, entity: {CAMERA: "Camera", SONAR: "Sonar"}.get(entity, ""),
        part=ProcessPart("pole", POLE, entities, process),
        speaks_for=lambda entity: (entity == CAMERA) == (process == "vision"),
    )
    received: Received = []
    transport.open(received.append)
    return transport, received


@pytest.fixture
def main(port: int) -> Iterator[tuple[ZenohTransport, Received]]:
    transport, received = joined(port, "main", 0b001)
    yield transport, received
    transport.close()


def values(client: Any, key: str, how: zenoh.ConsolidationMode) -> list[str]:
    replies = client.get(f"imc/pole/@q/EntityState{key}", consolidation=how, timeout=5.0)
    found = [imc.decode(reply.ok.payload.to_bytes()) for reply in replies]
    return [message.description for message in found if isinstance(message, imc.EntityState)]


@pytest.mark.heavy
def test_of_two_processes_that_know_an_entity_only_its_own_one_answers_and_the_newest_counts(
    port: int, main: tuple[ZenohTransport, Received], client: Any
) -> None:
    with ThreadPoolExecutor() as pool:
        vision, _ = pool.submit(joined, port, "vision", 0b010).result()
    at = iter(range(1_700_000_000, 1_800_000_000))

    def say(transport: ZenohTransport, entity: int, description: str) -> None:
        message = imc.EntityState(timestamp=float(next(at)), src=POLE, src_ent=entity, description=description)
        transport.send(message, imc.encode(message))

    say(main[0], CAMERA, "process vision starts")
    say(vision, CAMERA, "active")
    until(lambda: values(client, "/*", zenoh.ConsolidationMode.NONE) == ["active"])
    for how in (zenoh.ConsolidationMode.AUTO, zenoh.ConsolidationMode.NONE):
        assert values(client, "/Camera", how) == ["active"]
    for transport, entity, said in ((main[0], SONAR, "wet"), (vision, CAMERA, "dark"), (main[0], SONAR, "dry")):
        say(transport, entity, said)
        for _ in range(3):
            assert values(client, "", zenoh.ConsolidationMode.AUTO) == [said]
    vision.close()


def ask(client: Any, source: int, request_id: int) -> Any:
    request = imc.PlanControl(src=source, dst=POLE, request_id=request_id)
    return client.get("imc/pole/@q/PlanControl", payload=imc.encode(request), timeout=9.0)


def told(replies: Any) -> str:
    reply = replies.recv()
    if reply.ok is None:
        return reply.err.payload.to_string()
    message = imc.decode(reply.ok.payload.to_bytes())
    assert isinstance(message, imc.PlanControl)
    return message.info


def answer(transport: ZenohTransport, source: int, request_id: int, info: str) -> None:
    kinds = imc.PlanControl.Type
    message = imc.PlanControl(src=POLE, dst=source, request_id=request_id, type=kinds.SUCCESS, info=info)
    transport.send(message, imc.encode(message))


@pytest.mark.heavy
def test_one_that_asks_for_what_takes_long_keeps_nobody_else_from_asking(
    main: tuple[ZenohTransport, Received], client: Any
) -> None:
    transport, received = main
    kept = [ask(client, STRANGER, number) for number in range(MOST_OF_ONE)]
    until(lambda: len(received) == MOST_OF_ONE)
    assert told(ask(client, STRANGER, 999)) == f"{MOST_OF_ONE} requests of 0x4666 wait for their replies already"
    other = ask(client, CONSOLE, 5)
    until(lambda: len(received) == MOST_OF_ONE + 1)
    answer(transport, CONSOLE, 5, "here")
    assert told(other) == "here"
    answer(transport, STRANGER, 3, "three")
    assert told(kept[3]) == "three"


@pytest.mark.heavy
def test_a_request_that_was_not_answered_takes_no_reply_of_a_later_one(
    main: tuple[ZenohTransport, Received], client: Any
) -> None:
    transport, received = main
    stale, beside = ask(client, CONSOLE, 1), ask(client, CONSOLE, 2)
    until(lambda: len(received) == 2)
    for packet in received:
        assert isinstance(packet, Request)
        packet.handled(True)
        packet.handled(False)
    later = ask(client, CONSOLE, 1)
    assert told(stale) == "given up for a later request: give each its own request_id"
    until(lambda: len(received) == 3)
    answer(transport, CONSOLE, 1, "one")
    answer(transport, CONSOLE, 2, "two")
    assert (told(later), told(beside)) == ("one", "two")
