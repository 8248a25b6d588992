import json
import logging
import re
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import zenoh

import imc
import runtime.zenoh.publishers
from runtime.zenoh import ZenohConfig, ZenohTransport
from runtime.zenoh.error_counter import ErrorCounter
from runtime.zenoh.key_expressions import key_chunk, message_key
from runtime.zenoh.listen_endpoint_failover import is_in_use
from runtime.zenoh.subscribers import Subscribers
from tests.outside import until
from tests.runtime.zenoh.processes import local_port


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("lauv-noptilus-1", "lauv-noptilus-1"),
        ("0x1234", "0x1234"),
        ("Path Control", "Path_Control"),
        ("Camera/Front", "Camera%2FFront"),
        ("@cmd", "%40cmd"),
        ("a*$?#b", "a%2A%24%3F%23b"),
        ("**", "%2A%2A"),
        ("Câmara", "C%C3%A2mara"),
        ("\udcff", "%5Cudcff"),
        ("", "_"),
        (" ", "_"),
        ("x" * 1000, "x" * 255),
    ],
)
def test_a_name_is_one_chunk_of_a_key(name: str, expected: str) -> None:
    assert key_chunk(name) == expected


def test_keys_say_whose_message_it_is() -> None:
    assert message_key("EstimatedState", "lauv-1", "Navigation") == "imc/lauv-1/EstimatedState/Navigation"
    assert message_key("Abort", "ccu", "7", destination="lauv-1") == "imc/lauv-1/@cmd/Abort/ccu"


def test_options_become_a_config() -> None:
    options = {
        "Mode": "Router",
        "Local Port": "7600",
        "Listen": "tls/0.0.0.0:7448, quic/[::]:7449#iface=eth0",
        "Connect": "tcp/10.0.10.1:7447",
        "Scouting": "eth0, wlan0",
        "Scouting Address": "224.0.0.225:7446",
        "Shared Memory": "true",
        "Config File": "net.json5",
    }
    assert ZenohConfig.from_options(options, Path("/etc/shoal")) == ZenohConfig(
        mode="router",
        local_port=7600,
        listen=("tls/0.0.0.0:7448", "quic/[::]:7449#iface=eth0"),
        connect=("tcp/10.0.10.1:7447",),
        scouting="eth0,wlan0",
        scouting_address="224.0.0.225:7446",
        shared_memory=True,
        config_file=Path("/etc/shoal/net.json5"),
    )
    assert ZenohConfig.from_options({"Mode": " ", "Listen": ""}) == ZenohConfig()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("Mode", "boss"),
        ("Local Port", "65500"),
        ("Local Port", "-1"),
        ("Listen", "tcp/0.0.0.0"),
        ("Listen", "tcp/0.0.0.0:7447, what"),
        ("Connect", "10.0.10.1:7447"),
        ("Scouting", "eth0; rm"),
        ("Scouting Address", "224.0.0.224"),
        ("Shared Memory", "perhaps"),
        ("Sharing", "true"),
    ],
)
def test_a_wrong_option_is_named(name: str, text: str) -> None:
    with pytest.raises(ValueError, match=rf"^\[Zenoh\] {name}: "):
        ZenohConfig.from_options({name: text})


def built(config: ZenohConfig, name: str) -> Any:
    return json.loads(config.build().config.get_json(name))


def test_everything_stays_on_the_loopback_interface_by_default() -> None:
    config = ZenohConfig()
    assert config.build().fixed == ["tcp/127.0.0.1:7447"]
    assert built(config, "mode") == "peer"
    assert built(config, "listen/endpoints") == ["tcp/127.0.0.1:7500"]
    assert built(config, "connect/endpoints") == ["tcp/127.0.0.1:7447"]
    assert built(config, "scouting/multicast/enabled") is False, "zenoh's own scouting listens at 0.0.0.0"
    assert built(config, "scouting/gossip/autoconnect") == []
    assert built(config, "transport/shared_memory/transport_optimization/enabled") is False
    assert config.build().group == "224.0.0.224:7446"
    assert config.build().exposed == []


def test_each_session_connects_to_those_at_the_ports_below_its_own() -> None:
    layout = ZenohConfig(local_port=20000).build(2)
    assert layout.session == "tcp/127.0.0.1:20055"
    assert json.loads(layout.config.get_json("connect/endpoints")) == [
        "tcp/127.0.0.1:20000",
        "tcp/127.0.0.1:20053",
        "tcp/127.0.0.1:20054",
    ]


MUTUAL = "{transport: {link: {tls: {enable_mtls: true}}}, access_control: {enabled: true}}"


@pytest.mark.parametrize(
    ("values", "file", "exposed"),
    [
        ({"listen": ("tcp/0.0.0.0:7448",)}, None, ["tcp/0.0.0.0:7448"]),
        ({"connect": ("tcp/10.0.0.1:7448",)}, None, ["tcp/10.0.0.1:7448"]),
        ({"listen": ("tls/0.0.0.0:7448",)}, None, ["tls/0.0.0.0:7448"]),
        ({"listen": ("tls/0.0.0.0:7448",)}, MUTUAL, []),
        ({"listen": ("tcp/0.0.0.0:7448",)}, MUTUAL, ["tcp/0.0.0.0:7448"]),
        ({"listen": ("tcp/127.0.0.1:7448", "tcp/[::1]:7448")}, None, []),
        ({"scouting": "auto"}, None, ["scouts on auto"]),
        ({"scouting": "eth0"}, MUTUAL, ["scouts on eth0"]),
        ({"scouting": "eth0", "listen": ("tls/0.0.0.0:7448",)}, MUTUAL, ["scouts on eth0"]),
        ({"scouting": "lo"}, None, []),
        ({}, '{scouting: {multicast: {interface: "eth0"}}}', ["scouts on eth0"]),
        ({}, '{listen: {endpoints: ["tcp/[::]:7448"]}}', ["tcp/[::]:7448"]),
        ({}, "{scouting: {multicast: {enabled: true}}}", []),
    ],
)
def test_what_others_can_reach_without_certificates_is_reported(
    tmp_path: Path, values: dict[str, Any], file: str | None, exposed: list[str]
) -> None:
    path = None if file is None else tmp_path / "net.json5"
    if path is not None:
        path.write_text(file or "")
    layout = ZenohConfig(config_file=path, **values).build()
    assert layout.exposed == exposed
    by_zenoh = json.loads(layout.config.get_json("scouting/multicast/enabled"))
    assert by_zenoh == any(word.startswith("scouts") for word in exposed)


@pytest.mark.parametrize(
    ("listen", "listens"),
    [((), ["tcp/0.0.0.0:0"]), (("tcp/0.0.0.0:7448",), []), (("tcp/127.0.0.1:7448",), ["tcp/0.0.0.0:0"])],
)
def test_who_scouts_on_a_network_listens_there_and_connects_to_those_found(
    listen: tuple[str, ...], listens: list[str]
) -> None:
    config = ZenohConfig(scouting="eth0", listen=listen)
    assert built(config, "mode") == "router", "what others publish reaches all of this computer"
    assert built(config, "listen/endpoints")[1:] == listens
    assert built(config, "scouting/multicast/autoconnect")["router"] == ["router", "peer"]


def test_a_client_listens_nowhere_and_connects_where_it_is_reported() -> None:
    config = ZenohConfig(mode="client", connect=("tls/vehicle:7448",))
    assert config.build().fixed == built(config, "listen/endpoints") == []
    assert built(config, "connect/endpoints") == ["tls/vehicle:7448"]
    assert built(ZenohConfig(mode="client"), "connect/endpoints") == ["tcp/127.0.0.1:7447"]


def test_options_win_over_the_file_and_the_file_over_the_defaults(tmp_path: Path) -> None:
    file = tmp_path / "net.json5"
    file.write_text("""{
        mode: "router", // comments as in JSON5
        listen: {endpoints: {router: ["tls/0.0.0.0:7448"], peer: ["tcp/[::]:0"]}},
        scouting: {multicast: {enabled: false, interface: "eth0"}},
        transport: {link: {tx: {lease: 3000}}},
    }""")
    config = ZenohConfig(config_file=file)
    assert built(config, "mode") == "router"
    assert config.build().fixed == ["tcp/127.0.0.1:7447", "tls/0.0.0.0:7448"]
    assert built(config, "scouting/multicast/enabled") is False
    assert built(config, "transport/link/tx/lease") == 3000
    config = ZenohConfig(config_file=file, mode="peer", scouting="loopback", local_port=0, listen=())
    assert config.build().fixed == built(config, "connect/endpoints") == []
    assert built(config, "scouting/multicast/enabled") is False
    assert config.build().group == "", "there is no session port to tell of"


@pytest.mark.parametrize("content", ["{", '{mode: "boss"}', "{lisen: {}}", None])
def test_a_wrong_file_is_named(tmp_path: Path, content: str | None) -> None:
    file = tmp_path / "net.json5"
    if content is not None:
        file.write_text(content)
    with pytest.raises(ValueError, match=r"net\.json5"):
        ZenohConfig(config_file=file).build()


def test_held_endpoints_are_recognised() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert is_in_use(f"tcp/127.0.0.1:{port}#iface=lo")
        assert is_in_use(f"tls/localhost:{port}")
    assert not is_in_use(f"tcp/127.0.0.1:{port}")
    assert not is_in_use("tcp/no-such-host.invalid:1")


def transport(**values: Any) -> ZenohTransport:
    config = ZenohConfig(local_port=0, scouting="none", **values)
    return ZenohTransport(config, lambda system: f"0x{system:04X}", lambda system, entity: "")


def test_a_listener_that_cannot_work_is_an_error_with_its_reason() -> None:
    with pytest.raises(ConnectionError, match=r"zenoh cannot listen at tls/127.0.0.1:1: "):
        transport(listen=("tls/127.0.0.1:1",)).open(lambda packet: None)
    with pytest.raises(ConnectionError):
        transport(mode="client", connect=("tcp/127.0.0.1:1",)).open(lambda packet: None)


def test_a_process_that_does_not_join_those_of_its_computer_listens_itself() -> None:
    port = local_port()
    packets: list[bytes] = []
    message = imc.Abort(src=1, timestamp=1.0)
    one, other = transport(listen=(f"tcp/127.0.0.1:{port}",)), transport(connect=(f"tcp/127.0.0.1:{port}",))
    one.open(packets.append)
    try:
        with pytest.raises(ConnectionError, match=f"{port}"):
            transport(listen=(f"tcp/127.0.0.1:{port}",)).open(lambda packet: None)
        other.open(lambda packet: None)
        until(lambda: other.send(message, imc.encode(message)) or packets, every=0.05)
    finally:
        other.close()
        one.close()
    assert set(packets) == {imc.encode(message)}


def test_a_transport_that_is_not_open_sends_nothing_and_closes_twice() -> None:
    closed = transport()
    message = imc.Abort(src=1)
    closed.send(message, imc.encode(message))
    closed.open(lambda packet: None)
    closed.close()
    closed.close()
    closed.send(message, imc.encode(message))
    assert closed.unsent.total == 0


def test_unknown_messages_entities_and_odd_names_have_keys_too() -> None:
    packets: list[bytes] = []
    odd = ZenohTransport(ZenohConfig(local_port=0, scouting="none"), lambda system: "a/*", lambda system, entity: "@ #")
    odd.open(packets.append)
    for message in (imc.Abort(src=1), imc.Abort(src=1, dst=2), imc.Unknown(id=65000, payload=b"x", src=1)):
        odd.send(message, imc.encode(message))
    odd.close()
    assert odd.unsent.total == 0


def test_the_sources_of_relayed_packets_do_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runtime.zenoh.publishers, "MOST_PUBLISHERS", 3)
    relay = transport()
    relay.open(lambda packet: None)
    for source in (1, 2, 3, 4, 1, 5, 4):
        message = imc.Heartbeat(src=source)
        relay.send(message, imc.encode(message))
    assert relay._publishers is not None
    assert len(relay._publishers) == 3
    relay.close()
    assert relay.unsent.total == 0


def test_lost_and_repeated_packets_are_reported_by_their_numbers(caplog: pytest.LogCaptureFixture) -> None:
    packets: list[bytes] = []
    receiver = Subscribers(packets.append, None, logging.getLogger("shoal.zenoh").warning)
    receiver._own = "own"

    def arrive(number: int, publisher: int = 1, zid: str = "zid") -> None:
        source = SimpleNamespace(source_id=SimpleNamespace(zid=zid, eid=publisher), source_sn=number)
        payload = zenoh.ZBytes(bytes([number & 0xFF]))
        sample: Any = SimpleNamespace(source_info=source, payload=payload, key_expr="imc/a/b/c")
        receiver.receive(sample)

    for number in (7, 8, 8, 7, 9, 12):
        arrive(number)
    arrive(3, publisher=2)
    assert packets == [b"\x07", b"\x08", b"\x09", b"\x0c", b"\x03"]
    assert receiver.lost.total == 2
    for number in (0xFFFFFFFF, 0, 1):
        arrive(number, publisher=3)
    for number in (1, 100):
        arrive(number, zid="own")
    assert (len(packets), receiver.lost.total) == (8, 2), "our own, that come back, are neither taken nor counted"
    assert caplog.text.count("lost on the way") == 1


def test_what_was_lost_at_the_end_is_reported_with_the_name_of_the_process(caplog: pytest.LogCaptureFixture) -> None:
    told: list[str] = []
    lost = ErrorCounter("were lost", told.append)
    tell = logging.getLogger("shoal.zenoh").warning
    lost.report_final("lauv", tell)
    assert not caplog.text
    lost.count("at imc/a/b/c")
    lost.count("at imc/a/b/d", 2)
    assert told == ["1 packets were lost; at imc/a/b/c"]
    lost.report_final("lauv, process vision", tell)
    assert re.search(r"lauv, process vision: 2 packets were lost, the last 0.\d s before the end, beside", caplog.text)
