"""What a server of logs may say."""

import asyncio
import contextlib
import re
import socket
import threading
from collections.abc import Iterator
from ftplib import FTP
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

import imc
from imc.discovery import Endpoint
from shoal.network.link import NetworkError
from shoal.network.logs import (
    AsyncRemoteLogs,
    RemoteFile,
    RemoteLog,
    fetch_log,
    list_folder,
    list_logs,
    list_logs_at_once,
)
from shoal.network.network import Network
from shoal.network.system_table import NetworkSystem


class Hostile(FTP):
    """Names that lead elsewhere, or are none."""

    def mlsd(self, path: str = "", facts: Any = ()) -> Any:
        for name in ("..", ".", "/etc/passwd", "..\\x", "a/../../b", "", "a\0b", "x" * 300, "20260101"):
            yield name, {"type": "dir"}
        yield "20260102", {"type": "file", "size": "-3", "modify": "yesterday"}
        yield "20260103", {"type": "file", "size": "12", "modify": "20260101000000.5"}


def test_no_name_leads_out_of_the_folder() -> None:
    assert list_folder(Hostile(), "", "dir") == {"20260101": RemoteFile()}
    assert list_folder(Hostile(), "", "file") == {"20260102": RemoteFile(), "20260103": RemoteFile(12, 1767225600.0)}


class HostileTree(FTP):
    def sendcmd(self, cmd: str) -> str:
        bad = ("/etc/passwd", "20260101/../x", "a/b/../../c", "20260101/120000/.ssh/keys", "20260101/120000/", "///")
        good = " type=file;size=-1;modify=x; /20260101/120000/Data.lsf"
        return "\n".join(["211-", good, *(f" type=file;size=3; {name}" for name in bad), " type=dir", "", "211 End"])


def test_no_name_in_a_tree_leads_out_of_the_folder() -> None:
    assert list_logs_at_once(HostileTree()) == [RemoteLog("20260101/120000", {"Data.lsf": 0}, {"Data.lsf": 0.0})]


def test_a_name_that_is_not_utf_8_is_an_error_of_the_server() -> None:
    with socket.create_server(("127.0.0.1", 0)) as control, socket.create_server(("127.0.0.1", 0)) as data:
        host, port = data.getsockname()
        answers = {"TYPE": "200 ok", "PASV": f"227 ok ({host.replace('.', ',')},{port // 256},{port % 256})"}
        answers |= {"EPSV": f"229 ok (|||{port}|)", "MLSD": "150 here", "QUIT": "221 bye"}

        def serve() -> None:
            with contextlib.suppress(OSError), control.accept()[0] as line, line.makefile("rw", newline="\r\n") as file:
                line.sendall(b"220 here\r\n")
                for command in iter(file.readline, ""):
                    line.sendall(answers.get(command.split()[0], "230 in").encode() + b"\r\n")
                    if command.startswith("MLSD"):
                        with data.accept()[0] as listing:
                            listing.sendall(b"type=dir; 2026\xff\r\n")
                        line.sendall(b"226 all\r\n")

        threading.Thread(target=serve, daemon=True).start()
        place = Endpoint(*control.getsockname())
        with pytest.raises(NetworkError, match=re.escape(f"the server of logs at {place}: ")):
            list_logs([place])


def test_the_address_that_the_vehicle_is_received_at_is_tried_first() -> None:
    system = NetworkSystem("otter", parts={("udp", "1"): "at 10.1.0.2:6002"})
    services = "ftp://10.0.9.7:30021/;ftp://10.1.0.2:30021/;imc+udp://10.1.0.2:6002/"
    system.store_latest(imc.Announce(sys_name="otter", services=services))
    asked: list[list[Endpoint]] = []

    def look(places: list[Endpoint]) -> list[RemoteLog]:
        asked.append(places)
        return []

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("shoal.network.logs.list_logs", look)
        asyncio.run(AsyncRemoteLogs(Network([]), system).list())
    assert asked == [[Endpoint("10.1.0.2", 30021), Endpoint("10.0.9.7", 30021)]]


def test_the_next_address_is_tried_if_one_does_not_answer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as first, socket.create_server(("127.0.0.1", 0)) as second:
        places = [Endpoint(*server.getsockname()) for server in (first, second)]
        first.close()

        def serve() -> None:
            with second.accept()[0] as line:
                line.sendall(b"421 busy\r\n")

        threading.Thread(target=serve, daemon=True).start()
        with pytest.raises(NetworkError, match=f"at {places[0]}, {places[1]}: 421 busy"):
            list_logs(places)


def test_a_log_of_a_system_whose_name_leads_elsewhere_is_not_fetched(tmp_path: Path) -> None:
    logs = AsyncRemoteLogs(cast(Any, None), cast(Any, SimpleNamespace(name="../../x")))
    with pytest.raises(NetworkError, match=r"'\.\./\.\./x' cannot be the name of a folder"):
        asyncio.run(logs.fetch(RemoteLog("20260101/000000", {}), tmp_path / "a" / "b"))
    assert list(tmp_path.rglob("*")) == []


@contextlib.contextmanager
def endless_server(listing: bytes = b"") -> Iterator[tuple[Endpoint, list[int]]]:
    """A server that sends a file, or `listing`, again and again; and the bytes that it has sent for each request."""
    sent: list[int] = []
    with socket.create_server(("127.0.0.1", 0)) as control, socket.create_server(("127.0.0.1", 0)) as data:
        port = data.getsockname()[1]
        answers = {"TYPE": "200 ok", "PASV": f"227 ok (127,0,0,1,{port // 256},{port % 256})", "QUIT": "221 bye"}

        def serve() -> None:
            with contextlib.suppress(OSError), control.accept()[0] as line, line.makefile("rw", newline="\r\n") as file:
                line.sendall(b"220 here\r\n")
                for command in iter(file.readline, ""):
                    word = command.split()[0]
                    if word == "SITE":
                        line.sendall(b"500 what?\r\n")
                    elif word in ("RETR", "MLSD"):
                        line.sendall(b"150 here\r\n")
                        sent.append(0)
                        with contextlib.suppress(OSError), data.accept()[0] as flow:
                            while sent[-1] < 200 << 20:
                                sent[-1] += flow.send(listing or bytes(1 << 16))
                        line.sendall(b"426 you have gone\r\n")
                    else:
                        line.sendall(answers.get(word, "230 in").encode() + b"\r\n")

        threading.Thread(target=serve, daemon=True).start()
        yield Endpoint(*control.getsockname()), sent


@pytest.mark.heavy
def test_a_server_that_sends_more_than_it_announced_is_cut_short(tmp_path: Path) -> None:
    log = RemoteLog("20260101/120000", {"Data.lsf": 5, "Config.ini": 7})
    with endless_server() as (place, sent):
        fetch_log([place], log, tmp_path, lambda _: None)
        assert {path.name: path.stat().st_size for path in tmp_path.iterdir()} == {"Data.lsf": 5, "Config.ini": 7}
        assert len(sent) == 2
        assert max(sent) < 50 << 20, "what waits in the sockets, but not all"


@pytest.mark.heavy
def test_a_list_without_end_is_an_error(tmp_path: Path) -> None:
    with endless_server(b"type=dir; 20260101\r\n" * 4096) as (place, sent):
        with pytest.raises(NetworkError, match="its answer is longer than 32 MiB"):
            list_logs([place])
        assert max(sent) < 100 << 20
