"""Links to zenoh: where they lead, and their end."""

import asyncio
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import zenoh

import imc
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport
from shoal.network import Diagnosis, Network, NetworkError, ZenohLink, diagnose, make_network
from tests.outside import PATIENCE
from tests.runtime.zenoh.processes import local_port
from tests.runtime.zenoh.test_security import certificates

PARTS = (("certificate", "pem"), ("private_key", "key"))


def test_no_thread_is_in_zenoh_when_a_command_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the exit status of a command that looks for a vehicle over UDP is often 134, an abort."""
    join, enters, may_leave = zenoh.open, threading.Event(), threading.Event()

    def join_slowly(config: zenoh.Config) -> zenoh.Session:
        enters.set()
        assert may_leave.wait(PATIENCE)
        return join(config)

    async def look() -> None:
        async with Network([ZenohLink([f"tcp/127.0.0.1:{local_port()}"])]):
            assert await asyncio.to_thread(enters.wait, PATIENCE)
            asyncio.get_running_loop().call_later(0.1, may_leave.set)  # while the link closes

    monkeypatch.setattr("shoal.network.zenoh_session_thread.LAST_TRY", PATIENCE)
    monkeypatch.setattr(zenoh, "open", join_slowly)
    asyncio.run(look())
    assert not [thread.name for thread in threading.enumerate() if thread.name == "zenoh open"]


class Panic(BaseException):
    """As a panic in the Rust of zenoh arrives in Python."""


@pytest.mark.parametrize("error", [OSError("ca.pem is gone"), Panic("index out of bounds")])
def test_a_link_names_whatever_opens_no_session_and_tries_again(
    monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    failing, join, endpoint = [error], zenoh.open, f"tcp/127.0.0.1:{local_port()}"

    def open_or_fail(config: zenoh.Config) -> zenoh.Session:
        if failing:
            raise failing.pop()
        return join(config)

    async def look(link: ZenohLink) -> None:
        async with Network([link]):
            assert link.trouble == f"zenoh: {error}"
            end = time.monotonic() + PATIENCE
            while link.trouble and time.monotonic() < end:
                await asyncio.sleep(0.05)

    listening: Any = zenoh.Config()
    listening.insert_json5("scouting/multicast/enabled", "false")
    listening.insert_json5("listen/endpoints", json.dumps([endpoint]))
    with zenoh.open(listening):
        monkeypatch.setattr(zenoh, "open", open_or_fail)
        link = ZenohLink([endpoint])
        asyncio.run(look(link))
    assert link.trouble == ""


@pytest.mark.parametrize("whose", ["", "foreign"])
def test_a_rejection_is_reported_and_not_that_nobody_listens(whose: str, openssl: str, tmp_path: Path) -> None:
    """A client without a certificate, and with one of another authority."""
    for folder in (tmp_path, tmp_path / "foreign"):
        folder.mkdir(exist_ok=True)
        certificates(openssl, folder, "pole")
    endpoint = f"tls/127.0.0.1:{local_port()}"
    listening: Any = zenoh.Config()
    tls = "transport/link/tls"
    own = {"listen_certificate": "pole.pem", "listen_private_key": "pole.key", "root_ca_certificate": "ca.pem"}
    for name, file in own.items():
        listening.insert_json5(f"{tls}/{name}", json.dumps(str(tmp_path / file)))
    listening.insert_json5(f"{tls}/enable_mtls", "true")
    listening.insert_json5("scouting/multicast/enabled", "false")
    listening.insert_json5("listen/endpoints", json.dumps([endpoint]))
    ours = {"root_ca_certificate": str(tmp_path / "ca.pem"), "enable_mtls": bool(whose)}
    if whose:
        ours |= {f"connect_{part}": str(tmp_path / whose / f"pole.{end}") for part, end in PARTS}
    (tmp_path / "ours.json5").write_text(json.dumps({"transport": {"link": {"tls": ours}}}))

    async def look() -> str:
        link = ZenohLink([endpoint], tmp_path / "ours.json5")
        async with Network([link]):
            end = time.monotonic() + PATIENCE
            while "has not answered yet" in link.trouble and time.monotonic() < end:
                await asyncio.sleep(0.05)
            return link.trouble

    with zenoh.open(listening):
        trouble = asyncio.run(look())
    assert trouble.startswith(f"{endpoint} did not accept us: it needs a certificate of its own authority")
    assert asyncio.run(look()) == f"nothing listens at {endpoint}"


@pytest.mark.heavy
def test_the_doctor_names_the_list_of_commanders_of_a_vehicle_that_is_received_over_zenoh_and_does_not_answer() -> None:
    port = local_port()
    config = ZenohConfig(local_port=port, scouting="none", vehicle="pole")
    vehicle = ZenohTransport(config, lambda _: "pole", lambda *_: "Navigation", part=ProcessPart("pole", 0x1A, 1))
    vehicle.open(lambda _: None)

    async def speak() -> None:
        while True:
            message = imc.EstimatedState(src=0x1A, src_ent=7, timestamp=time.time())
            vehicle.send(message, imc.encode(message))
            await asyncio.sleep(0.05)

    async def look() -> Diagnosis:
        speaking = asyncio.create_task(speak())
        async with Network([ZenohLink([f"tcp/127.0.0.1:{port}"])]) as network:
            found = await diagnose(network, "pole", seconds=0.6, patience=0.1)
        speaking.cancel()
        return found

    findings = asyncio.run(look()).findings
    vehicle.close()
    (finding,) = [each for each in findings if "does not answer" in each.text]
    assert "is not in its Commanders, see [Zenoh]" in finding.remedy


@contextmanager
def speaking(name: str, number: int) -> Iterator[str]:
    """A system that says something all the time, on a network of its own; its endpoint."""
    endpoint = f"tcp/127.0.0.1:{local_port()}"
    listen = {"mode": "peer", "listen": {"endpoints": [endpoint]}, "scouting": {"multicast": {"enabled": False}}}
    with zenoh.open(zenoh.Config.from_json5(json.dumps(listen))) as session:
        has_ended = threading.Event()

        def speak() -> None:
            while not has_ended.wait(0.02):
                packet = imc.encode_with_header(imc.Heartbeat(), time.time(), number, 0, 0xFFFF, 0xFF)
                session.put(f"imc/{name}/Heartbeat/Daemon", packet)

        thread = threading.Thread(target=speak)
        thread.start()
        try:
            yield endpoint
        finally:
            has_ended.set()
            thread.join()


async def seen(network: Network, *names: str) -> bool:
    """Whether these vehicles appear; there may be others on this computer."""
    with suppress(TimeoutError):
        async with asyncio.timeout(PATIENCE):
            while not {system.name for system in network.vehicles()}.issuperset(names):
                await network.wait_for_change(0.1)
    return {system.name for system in network.vehicles()}.issuperset(names)


def test_each_of_several_endpoints_is_joined_and_one_that_does_not_answer_is_named() -> None:
    missing = f"tcp/127.0.0.1:{local_port()}"

    async def look(*endpoints: str) -> None:
        async with make_network([",".join(endpoints)]) as network:
            network.subscribe(None, (imc.Heartbeat,))
            assert await seen(network, "first", "second")
            assert network.search.link_troubles == [f"nothing listens at {missing}"]
            with pytest.raises(
                NetworkError, match=f"no vehicle 'third' on the network; .*nothing listens at {missing}"
            ):
                await network.find_system("third", 0.1)

    with speaking("first", 0x0B01) as first, speaking("second", 0x0B02) as second:
        asyncio.run(look(first, missing, second))


def test_all_messages_end_with_their_last_reader_and_those_of_others_continue() -> None:
    async def look(endpoint: str) -> None:
        link = ZenohLink([endpoint])
        async with Network([link]) as network:
            everything = network.listen()
            await everything.next(PATIENCE)
            heartbeats = network.listen(None, (imc.Heartbeat,))  # which are among them
            network.close_listener(everything)
            heartbeats.take_all()
            for _ in range(2):
                assert isinstance((await heartbeats.next(PATIENCE))[1], imc.Heartbeat)
            assert not [expression for expression in link._wanted if expression.startswith("imc/*/**")]

    with speaking("somebody", 0x0A11) as endpoint:
        asyncio.run(look(endpoint))


def test_a_configuration_file_says_where_to_connect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SHOAL_CONNECT", raising=False)
    path = tmp_path / "ground.json5"

    async def look() -> None:
        async with make_network(zenoh_config=path) as network:
            network.subscribe(None, (imc.Heartbeat,))
            assert await seen(network, "first")

    with speaking("first", 0x0B01) as first:
        path.write_text(f'{{mode: "client", connect: {{endpoints: ["{first}"]}}}}')
        asyncio.run(look())
    path.write_text("{mode: 3}")
    with pytest.raises(ValueError, match=r"ground\.json5"):
        make_network(zenoh_config=path)
