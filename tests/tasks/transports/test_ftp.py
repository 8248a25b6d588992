"""Downloads over FTP, with Python's client: what can be read, and what cannot."""

import ftplib
import io
import os
import socket
import time
from threading import Thread

import pytest

from imc.discovery import Endpoint
from shoal.network.logs import list_logs
from tasks.transports.ftp_server import MOST_OF_ONE, MOST_SESSIONS, FTPServer
from tests.outside import until

HOST = "127.0.0.1"
LOG = "20260101/000000_survey"
DATA = bytes(range(256)) * 4096  # 1 MiB


@pytest.fixture
def logs(tmp_path):
    """A vehicle's log folder, with something secret beside it."""
    root = tmp_path / "log" / "lauv"
    (root / LOG).mkdir(parents=True)
    (root / LOG / "Data.lsf.gz").write_bytes(DATA)
    (root / LOG / "Output.txt").write_text("started\n")
    (root / "20260101/000100").mkdir()
    (tmp_path / "log" / "lauv-2").mkdir()
    (tmp_path / "log" / "lauv-2" / "secret").write_text("secret")
    (root / "20260101" / "out").symlink_to(tmp_path / "log" / "lauv-2")
    (root / LOG / "secret").symlink_to(tmp_path / "log" / "lauv-2" / "secret")
    (root / LOG / "Again.txt").symlink_to(root / LOG / "Output.txt")
    return root


@pytest.fixture
def serve(logs):
    """Serves the folder; `serve(deletes=True)` returns a connected client."""
    servers, clients = [], []

    def start(deletes=False, login=True, timeout=120.0, tales=None):
        tell = (tales if tales is not None else []).append
        in_use = (logs / "20260101/000100").__eq__
        server = FTPServer(logs, HOST, 0, deletes=deletes, timeout=timeout, in_use=in_use, report=tell)
        thread = Thread(target=server.run)
        thread.start()
        servers.append((server, thread))
        client = ftplib.FTP(timeout=10)
        clients.append(client)
        client.connect(HOST, server.port)
        if login:
            client.login()
        client.server = server
        return client

    yield start
    for client in clients:
        client.close()
    for server, thread in servers:
        server.stop()
        thread.join(5)
        assert not thread.is_alive()


def lines(client, command):
    found = []
    client.retrlines(command, found.append)
    return found


def read(client, path, rest=None):
    found = io.BytesIO()
    client.retrbinary(f"RETR {path}", found.write, rest=rest)
    return found.getvalue()


def refused(client, command):
    with pytest.raises(ftplib.error_perm) as error:
        client.sendcmd(command)
    return str(error.value)[:3]


def soon(condition):
    """Whether the server's thread, which counts after it answers, meets a condition."""
    return until(condition, 5.0)


def test_all_logs_are_listed_in_one_answer(serve, logs, monkeypatch):
    """Without a connection for each folder, which takes seconds over a bad radio."""
    (logs / "20260102").mkdir()
    client = serve()
    place = Endpoint(HOST, client.server.port)
    monkeypatch.setattr(ftplib.FTP, "makepasv", None)
    found = list_logs([place])
    assert [(log.name, log.files) for log in found] == [
        (LOG, {"Again.txt": 8, "Data.lsf.gz": len(DATA), "Output.txt": 8}),
        ("20260101/000100", {}),
    ]
    assert found[0].changed["Output.txt"] == int((logs / LOG / "Output.txt").stat().st_mtime)
    monkeypatch.undo()
    monkeypatch.setattr("tasks.transports.ftp_server.MOST_IN_TREE", 4)
    assert list_logs([place]) == found, "too many for one answer: folder by folder"


def test_a_console_finds_and_downloads_a_log(serve):
    client = serve()
    assert client.sendcmd("SYST") == "215 UNIX Type: L8"
    assert [line.split()[-1] for line in lines(client, "LIST /")] == ["20260101"]
    assert lines(client, "LIST")[0].startswith("drwx")
    assert [line.split()[-1] for line in lines(client, "LIST -la /20260101")] == ["000000_survey", "000100"]
    entry = lines(client, f"LIST /{LOG}")[1].split()
    assert entry[0].startswith("-rw")
    assert (entry[2], entry[4], entry[-1]) == ("unknown", str(len(DATA)), "Data.lsf.gz")
    assert read(client, f"/{LOG}/Data.lsf.gz") == DATA
    assert client.size(f"/{LOG}/Data.lsf.gz") == len(DATA)
    client.cwd(f"/{LOG}")
    assert client.pwd() == f"/{LOG}"
    assert read(client, "Data.lsf.gz", rest=1_000_000) == DATA[1_000_000:]
    facts = dict(client.mlsd())
    assert facts["Data.lsf.gz"]["size"] == str(len(DATA))
    assert facts["Data.lsf.gz"]["type"] == "file"
    client.set_pasv(False)
    assert read(client, "Output.txt") == b"started\n"
    assert soon(lambda: client.server.counts == {"sent": 3})


def test_the_space_on_the_disk_is_reported(serve):
    code, free, total = serve().sendcmd("USPC").split()
    assert code == "258"
    assert 0 < int(free) <= int(total)


@pytest.mark.parametrize("user", ["anonymous", "neptus", "ünï"])
def test_any_user_is_let_in(serve, user):
    client = serve(login=False)
    client.login(user, "whatever")
    assert lines(client, "NLST") == ["20260101"]


@pytest.mark.parametrize(
    "path",
    [
        "../lauv-2/secret",
        "/../lauv-2/secret",
        f"{LOG}/../../../lauv-2/secret",
        "..//..//..//..//etc/passwd",
        "/etc/passwd",
        "//etc/passwd",
        f"{LOG}/secret",
        "20260101/out/secret",
        "..\\lauv-2\\secret",
        "/proc/self/environ",
        "~/.ssh",
        f"{LOG}/Data.lsf.gz/../../../../lauv-2/secret",
    ],
)
def test_nothing_outside_the_folder_can_be_reached(serve, path):
    client = serve()
    client.set_pasv(True)
    assert refused(client, f"SIZE {path}") == "550"
    assert refused(client, f"CWD {path}") == "550"
    with pytest.raises(ftplib.error_perm):
        read(client, path)
    with pytest.raises(ftplib.error_perm):
        lines(client, f"LIST {path}")
    assert refused(client, f"MDTM {path}") == "550"
    assert refused(client, f"MLST {path}") == "550"
    client.cwd("/")
    assert client.pwd() == "/"


def test_links_are_what_they_lead_to_and_those_that_lead_out_are_not_listed(serve):
    client = serve()
    names = [line.split()[-1] for line in lines(client, f"LIST /{LOG}")]
    assert names == ["Again.txt", "Data.lsf.gz", "Output.txt"]
    assert "out" not in dict(client.mlsd("/20260101"))
    assert read(client, f"/{LOG}/Again.txt") == b"started\n"


@pytest.mark.parametrize(
    "command",
    [
        f"DELE /{LOG}/Data.lsf.gz",
        f"RMD /{LOG}",
        "MKD /new",
        "STOR /new",
        "APPE /new",
        "STOU",
        f"RNFR /{LOG}",
        f"SITE CHMOD 777 /{LOG}",
        f"MFMT 20200101000000 /{LOG}/Data.lsf.gz",
    ],
)
def test_nothing_can_be_changed(serve, logs, command):
    before = sorted((path, path.lstat().st_mtime, path.lstat().st_mode) for path in logs.rglob("*"))
    tales = []
    client = serve(tales=tales)
    assert refused(client, command) == "550"
    assert sorted((path, path.lstat().st_mtime, path.lstat().st_mode) for path in logs.rglob("*")) == before
    assert soon(lambda: tales)
    assert command.split()[0] in tales[0]
    assert client.server.counts["rejected"] == 1


def test_logs_are_removed_only_if_the_profile_allows_it_and_never_the_present_one(serve, logs):
    tales = []
    client = serve(deletes=True, tales=tales)
    assert refused(client, "DELE /20260101/000100") == "550"
    assert refused(client, "RMD /") == "550"
    (logs / "same").symlink_to(logs / "20260101")
    assert refused(client, "DELE /same/000100") == "550"
    assert refused(client, "DELE ../lauv-2/secret") == "550"
    assert refused(client, "DELE /20260101/out") == "550"
    assert refused(client, "STOR /new") == "550"
    client.delete(f"/{LOG}/Output.txt")
    assert not (logs / LOG / "Output.txt").exists()
    client.sendcmd(f"DELE /{LOG}")  # Neptus removes folders so
    assert not (logs / LOG).exists()
    assert (logs / "20260101/000100").is_dir()
    assert (logs.parent / "lauv-2" / "secret").is_file()
    assert soon(lambda: f"{HOST} removed /{LOG}" in tales)


def test_a_pipe_in_the_folder_holds_nobody_up(serve, logs):
    os.mkfifo(logs / "pipe")
    client = serve()
    with pytest.raises(ftplib.error_perm):
        read(client, "pipe")
    assert lines(client, "NLST") == ["20260101", "pipe"]


def test_no_data_is_sent_to_another_computer(serve):
    assert refused(serve(), "PORT 10,0,0,1,20,20")[0] == "5"


def connected(client, address=HOST):
    """One more session with the server of a client."""
    another = ftplib.FTP(timeout=10)
    another.connect(HOST, client.server.port, source_address=(address, 0))
    return another


def test_one_address_gets_only_so_many_sessions_and_the_longest_idle_gives_way(serve, logs):
    with (logs / "large").open("wb") as large:
        large.truncate(1 << 26)
    first = serve()
    transfers = [first.transfercmd("RETR large")]
    others = [connected(first) for _ in range(MOST_OF_ONE - 1)]
    others[0].sendcmd("NOOP")
    others.append(connected(first))
    with pytest.raises((EOFError, OSError)):
        others.pop(1).sendcmd("NOOP")
    for client in others:
        client.login()
        transfers.append(client.transfercmd("RETR large"))
    with pytest.raises(ftplib.error_temp):
        connected(first)
    for each in (*others, *transfers):
        each.close()


def test_idle_sessions_of_others_shut_nobody_out(serve):
    first = serve()
    others = [connected(first, "127.0.0.2") for _ in range(MOST_OF_ONE)]
    others += [connected(first, "127.0.0.3") for _ in range(MOST_SESSIONS - MOST_OF_ONE)]
    assert lines(first, "NLST") == ["20260101"]
    assert connected(first).login().startswith("230")
    assert lines(first, "NLST") == ["20260101"], "it has one session only"
    for each in others:
        each.close()


def test_silent_sessions_end(serve):
    client = serve(timeout=0.2)
    time.sleep(0.2)
    with pytest.raises((ftplib.error_temp, EOFError)):
        client.getresp()


def test_a_client_that_reads_no_answers_is_cut_off(serve):
    client = serve()
    flood = socket.create_connection((HOST, client.server.port))
    flood.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    flood.settimeout(0.1)
    deadline = time.monotonic() + 20
    flood.send(b"USER x\r\nPASS y\r\n")
    try:
        while time.monotonic() < deadline:
            try:
                flood.send(b"FEAT\r\n" * 200)
            except TimeoutError:
                pass
    except (ConnectionError, BrokenPipeError):
        pass
    assert time.monotonic() < deadline
    assert soon(lambda: client.server.counts["cut off"] == 1)
    assert lines(client, "NLST") == ["20260101"]


@pytest.mark.parametrize(
    "garbage", [b"\0" * 5000, b"RETR " + b"a" * 5000 + b"\r\n", b"\xff\xf4\xf2ABOR\r\n", b"\r\n" * 9]
)
def test_rubbish_ends_at_most_its_own_session(serve, garbage):
    client = serve()
    with socket.create_connection((HOST, client.server.port)) as other:
        other.sendall(garbage)
        other.recv(100)
    assert lines(client, "NLST") == ["20260101"]
