"""Who may hear and command a vehicle whose [Zenoh] section names certificates, passwords and lists."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from runtime.zenoh import ZenohConfig
from runtime.zenoh.certificate_checks import certificate_problem
from runtime.zenoh.listen_endpoint_failover import is_in_use
from runtime.zenoh.security import Security
from tests.outside import NO_FILE, until
from tests.runtime.zenoh.processes import PATIENCE, Network, Process, count

ALICE, BOB = 0x4001, 0x4002
SYSTEM = 1
PATH = "imc/system-1"
SERVER, CLIENT = "serverAuth", "clientAuth"
BOTH = f"{SERVER}, {CLIENT}"


def vehicle(network: Network, **options: str) -> Process:
    bus = network.bus(SYSTEM, scouting=False, **options)
    assert bus.line() == {"opened": True}
    bus.ask("flow 50")
    return bus


def asker(network: Network, options: dict[str, Any]) -> Process:
    process = network.asker("client", options)
    assert process.line() == {"opened": True}
    return process


def hears(process: Process, expression: str = f"{PATH}/EstimatedState/*") -> bool:
    return bool(process.ask(f"late {expression} 0.5")["heard"])


def command(process: Process, source: int, key: str, abbrev: str = "PlanControl") -> None:
    process.ask(f"put {key} {json.dumps({'abbrev': abbrev, 'src': source, 'dst': SYSTEM})}")


def request(process: Process, source: int) -> Any:
    asked = {"abbrev": "PlanDB", "src": source, "dst": SYSTEM, "request_id": 7}
    return process.ask(f"get {PATH}/@q/PlanDB {json.dumps(asked)}")["replies"]


def tokens(process: Process) -> list[Any]:
    return process.ask(f"tokens {PATH}/@alive/**")["tokens"]


def check_lists(bus: Process, commander: Process, listener: Process) -> None:
    """The commander hears, commands and asks; the listener hears, and nothing else.

    What is allowed may need a moment: a client learns only after it has opened what others declare.
    """
    until(lambda: hears(commander))
    until(lambda: hears(listener))
    until(lambda: listener.ask(f"get {PATH}/@q/EstimatedState/*")["replies"])
    command(listener, BOB, f"{PATH}/@cmd/SetEntityParameters/bob", "SetEntityParameters")
    command(listener, BOB, f"{PATH}/SetEntityParameters/bob", "SetEntityParameters")
    assert request(listener, BOB) == []
    commander.ask(f"token {PATH}/@alive/0001/vision")
    command(commander, ALICE, f"{PATH}/VehicleState/Navigation", "SetEntityParameters")
    assert not any("vision" in line["token"] for line in tokens(listener)), (
        "she cannot pass for a process of the vehicle"
    )
    command(commander, ALICE, f"{PATH}/@cmd/PlanControl/alice")
    bus.until(lambda status: "PlanControl" in status["names"])
    (reply,) = until(lambda: request(commander, ALICE))
    assert (reply["abbrev"], reply["dst"]) == ("PlanDB", ALICE)
    assert "SetEntityParameters" not in bus.ask("status")["names"]


def certificates(
    openssl: str, folder: Path, *names: str, days: int = 2, address: str = "127.0.0.1", **usage: str
) -> None:
    """An authority, and certificates that it has signed for these names, at an address; they end in so many days.

    `usage` are further names with the extendedKeyUsage of each.
    """

    def make(*words: str) -> None:
        subprocess.run([openssl, *words], cwd=folder, check=True, capture_output=True)

    key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")
    make("req", "-x509", "-days", "2", *key, "-subj", "/CN=authority", "-keyout", "ca.key", "-out", "ca.pem")
    for name in (*names, *usage):
        make("req", *key, "-subj", f"/CN={name}", "-keyout", f"{name}.key", "-out", f"{name}.csr")
        limit = f"extendedKeyUsage={usage[name]}\n" if name in usage else ""
        (folder / f"{name}.ext").write_text(f"subjectAltName=IP:{address}\n{limit}")
        make(
            "x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial",
            "-days", str(days), "-extfile", f"{name}.ext", "-out", f"{name}.pem",
        )  # fmt: skip


@pytest.mark.heavy
def test_users_log_in_with_a_password_and_may_do_what_their_list_allows(
    network: Network, openssl: str, tmp_path: Path
) -> None:
    certificates(openssl, tmp_path, "vehicle")
    (tmp_path / "password").write_text("deep\n")
    (tmp_path / "users").write_text("vehicle:deep\nalice:a1\nbob:b2\ncarol:c3\n")
    own = {"User": "vehicle", "Password_File": str(tmp_path / "password")}
    endpoint = f"tls/127.0.0.1:{network.local_port + 2}"
    bus = vehicle(
        network,
        Listen=endpoint,
        Certificate=str(tmp_path / "vehicle.pem"),
        Private_Key=str(tmp_path / "vehicle.key"),
        Users_File=str(tmp_path / "users"),
        Commanders="alice",
        Listeners="bob",
        **own,
    )
    assert not any("is open to others" in line for line in bus.errors)

    def login(user: str, password: str, where: str = endpoint) -> dict[str, Any]:
        return {
            "connect/endpoints": [where],
            "transport/link/tls/root_ca_certificate": str(tmp_path / "ca.pem"),
            **({"transport/auth/usrpwd/user": user} if user else {}),
            **({"transport/auth/usrpwd/password": password} if user else {}),
        }

    check_lists(bus, asker(network, login("alice", "a1")), asker(network, login("bob", "b2")))
    carol = asker(network, login("carol", "c3"))
    assert not hears(carol), "she may log in, but is in no list"
    command(carol, 0x4003, f"{PATH}/@cmd/SetEntityParameters/carol", "SetEntityParameters")
    here = f"tcp/127.0.0.1:{network.local_port}"
    refused = [login("", ""), login("alice", "wrong"), login("mallory", "a1"), login("", "", here)]
    strangers = [network.asker("client", options) for options in refused]
    for stranger in strangers:
        assert stranger.popen.wait(PATIENCE) != 0
    sibling = network.bus(2, scouting=False, **own)
    assert sibling.line() == {"opened": True}
    sibling.hears(SYSTEM, 5)
    assert "SetEntityParameters" not in bus.ask("status")["names"]


@pytest.mark.heavy
def test_certificates_say_who_may_hear_and_who_may_command(network: Network, openssl: str, tmp_path: Path) -> None:
    certificates(openssl, tmp_path, "vehicle", "alice", "bob", "carol")
    other = tmp_path / "other"
    other.mkdir()
    certificates(openssl, other, "alice")
    port = network.local_port + 2
    endpoint = f"tls/127.0.0.1:{port}"
    bus = vehicle(
        network,
        Mode="router",
        Listen=endpoint,
        Root_Certificate=str(tmp_path / "ca.pem"),
        Certificate=str(tmp_path / "vehicle.pem"),
        Private_Key=str(tmp_path / "vehicle.key"),
        Commanders="alice",
        Listeners="bob",
    )
    assert is_in_use(endpoint)
    assert not any("is open to others" in line for line in bus.errors)

    def certified(name: str, folder: Path = tmp_path) -> dict[str, Any]:
        tls = "transport/link/tls"
        return {
            "connect/endpoints": [endpoint],
            f"{tls}/root_ca_certificate": str(tmp_path / "ca.pem"),
            **({f"{tls}/enable_mtls": True} if name else {}),
            **({f"{tls}/connect_certificate": str(folder / f"{name}.pem")} if name else {}),
            **({f"{tls}/connect_private_key": str(folder / f"{name}.key")} if name else {}),
        }

    check_lists(bus, asker(network, certified("alice")), asker(network, certified("bob")))
    assert not hears(asker(network, certified("carol")))
    for stranger in (certified(""), certified("alice", other)):
        process = network.asker("client", stranger)
        until(lambda process=process: process.popen.poll() is not None or not process.lines.empty())
        assert process.popen.poll() is not None or not hears(process)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"Commanders": "alice"}, "need Root Certificate or Users File"),
        ({"Certificate": "vehicle.pem"}, "Certificate and Private Key belong together"),
        ({"User": "vehicle"}, "User and Password File belong together"),
        ({"Users File": "users"}, "Users File needs User and Password File"),
        ({"Root Certificate": "none.pem"}, rf"Root Certificate: .*none\.pem: {NO_FILE}"),
        ({"User": "vehicle", "Password File": "empty"}, "has no password in its first line"),
        ({"Mutual TLS": "true"}, "Mutual TLS needs Root Certificate"),
        ({"Root Certificate": "users", "Commanders": "a, b", "Listeners": "b"}, "b is listed twice in"),
        ({"Mutual TLS": "yes"}, "'yes' is not one of true, false"),
    ],
)
def test_options_that_cannot_protect_are_refused(tmp_path: Path, options: dict[str, str], words: str) -> None:
    for name in ("vehicle.pem", "users", "empty"):
        (tmp_path / name).write_text("")
    with pytest.raises(ValueError, match=words):
        ZenohConfig.from_options(options, tmp_path).build()


def test_a_vehicle_says_which_of_its_files_others_will_not_accept_or_can_read(
    network: Network, openssl: str, tmp_path: Path
) -> None:
    certificates(openssl, tmp_path, "vehicle", days=-1)
    (tmp_path / "vehicle.key").chmod(0o604)
    bus = vehicle(
        network,
        Listen=f"tls/127.0.0.1:{network.local_port + 2}",
        Root_Certificate=str(tmp_path / "ca.pem"),
        Certificate=str(tmp_path / "vehicle.pem"),
        Private_Key=str(tmp_path / "vehicle.key"),
    )
    for words in ("vehicle.pem: ", "every user of this computer can read or change"):
        assert any(words in line for line in bus.errors)


def test_whether_a_certificate_will_be_accepted_is_known_before(openssl: str, tmp_path: Path) -> None:
    for folder in (tmp_path / "ours", tmp_path / "theirs"):
        folder.mkdir()
        certificates(openssl, folder, "vehicle")
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    own = ours / "vehicle.pem", ours / "vehicle.key"
    assert certificate_problem(ours / "ca.pem", *own) == ""
    assert certificate_problem(theirs / "ca.pem", *own)
    assert certificate_problem(ours / "ca.pem", ours / "vehicle.pem", theirs / "vehicle.key")
    assert NO_FILE in certificate_problem(ours / "ca.pem", ours / "nothing.pem", ours / "vehicle.key")


@pytest.mark.parametrize(("usage", "lacks"), [(BOTH, ()), (SERVER, (CLIENT,)), (CLIENT, (SERVER,))])
def test_a_certificate_is_doubted_only_in_the_part_that_it_is_not_for(
    usage: str, lacks: tuple[str, ...], openssl: str, tmp_path: Path
) -> None:
    certificates(openssl, tmp_path, vehicle=usage)
    own, key = tmp_path / "vehicle.pem", tmp_path / "vehicle.key"
    here, elsewhere = ["tcp/127.0.0.1:7447"], ["tls/10.0.0.7:7448"]
    doubt = f"Certificate: those {{}} will not accept {own}: its extendedKeyUsage has no {{}}"
    of_server = [doubt.format("who connect here", SERVER)] if SERVER in lacks else []
    of_client = [doubt.format("whom it connects to", CLIENT)] if CLIENT in lacks else []
    for mutual, doubts in ((None, of_client), (False, [])):
        security = Security(tmp_path / "ca.pem", own, key, mutual)
        assert security.warnings(here, here) == []
        assert security.warnings(elsewhere, here) == of_server
        assert security.warnings(here, elsewhere) == doubts


@pytest.mark.heavy
def test_zenoh_takes_a_certificate_for_clients_from_a_client_and_one_for_servers_not(
    network: Network, openssl: str, tmp_path: Path
) -> None:
    certificates(openssl, tmp_path, vehicle=SERVER, alice=CLIENT, bob=SERVER)
    endpoint = f"tls/127.0.0.1:{network.local_port + 2}"

    def joins(system: int, name: str, **options: str) -> Process:
        pem, key = (str(tmp_path / f"{name}.{end}") for end in ("pem", "key"))
        ca = str(tmp_path / "ca.pem")
        return network.bus(
            system, scouting=False, Root_Certificate=ca, Certificate=pem, Private_Key=key, Mode="router", **options
        )

    bus = joins(SYSTEM, "vehicle", Listen=endpoint)
    assert bus.line() == {"opened": True}
    bus.ask("flow 50")
    alice, bob = (joins(n, name, Connect=endpoint, Local_Port="0") for n, name in ((2, "alice"), (3, "bob")))
    assert alice.line() == bob.line() == {"opened": True}
    alice.hears(SYSTEM, 5)
    assert not count(bob.ask("status"), SYSTEM)
    until(lambda: any("its extendedKeyUsage has no clientAuth" in line for line in bob.errors))
    assert not any("extendedKeyUsage" in line for line in (*bus.errors, *alice.errors))
