"""Which files ground stations can list and read, and what they cannot reach."""

import os
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink.vehicle.files.ftp_messages import FtpErrorCode, FtpOpcode
from mavlink.vehicle.files.ftp_server import FtpServer
from mavlink.vehicle.files.virtual_files import VirtualFiles
from tasks.transports.mavlink_links.ftp_folders import DiskFolders
from tests.tasks.transports.mavlink_files import LOG, STATION, TEXT, ask, fill, listing, request, taken, vehicle_files


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return fill(tmp_path_factory.mktemp("vehicle"))


@pytest.fixture
def tree(folder):
    return vehicle_files(folder)


@pytest.fixture
def server(tree):
    server = FtpServer(tree)
    yield server
    server.close()


def test_lists(server):
    assert listing(server, b"/") == listing(server, b"") == [b"Fgeneral.json\t2", b"Dlogs"]
    assert listing(server, b"logs") == listing(server, b"@MAV_LOG/") == [b"D20240102"]
    cheese = "FKäse 🧀\n\t6".encode()
    assert listing(server, b"/logs/20240102/030405_dive") == [b"FData.lsf\t1024", cheese, b"S", b"Fempty\t0", b"S"]


def test_lists_with_times(server, folder):
    log = folder / "logs/20240102/030405_dive"
    os.utime(log / "Data.lsf", (1704164645, 1704164645))
    os.utime(folder / "logs/20240102", (1704164646, 1704164646))
    assert listing(server, b"/logs", FtpOpcode.LIST_WITH_TIME) == [b"D20240102\t0\t1704164646"]
    assert b"FData.lsf\t1024\t1704164645" in listing(server, b"/logs/20240102/030405_dive", FtpOpcode.LIST_WITH_TIME)
    assert b"Fgeneral.json\t2\t0" in listing(server, b"/", FtpOpcode.LIST_WITH_TIME)


def test_files_with_odd_names_are_read(server):
    for name, content in ((b"a tab\there", b"tab"), ("Käse 🧀\n".encode(), b"cheese"), (b"\xff\xfe odd", b"odd")):
        assert ask(server, FtpOpcode.OPEN, b"/logs/20240102/030405_dive/" + name) == len(content).to_bytes(4, "little")
        assert ask(server, FtpOpcode.READ, size=239) == content


@pytest.mark.parametrize(
    "path",
    [
        LOG,
        LOG[1:],
        b"//logs/./20240102//030405_dive/Data.lsf",
        b"mftp://" + LOG,
        b"MFTP://[;comp=1]" + LOG,
        b"@MAV_LOG/20240102/030405_dive/Data.lsf",
        LOG + b"\0and something else",
    ],
)
def test_ways_to_write_a_path(server, path):
    assert ask(server, FtpOpcode.OPEN, path) == len(TEXT).to_bytes(4, "little")


@pytest.mark.parametrize(
    "path",
    [
        b"",
        b"/",
        b"\0",
        b"/secret",
        b"secret",
        b"/logs/../secret",
        b"/logs/20240102/../../secret",
        b"/../secret",
        b"../secret",
        b"mftp://../secret",
        b"/logs/secret",
        b"/logs/way_out/secret",
        b"/logs/inside/Data.lsf",
        b"/logs/null",
        b"/logs/pipe",
        b"/logs",
        b"/logs/20240102",
        b"/etc/passwd",
        b"//etc/passwd",
        b"/pictures/1.png",
        b"@PARAM/other",
        LOG + b"/more",
        b"/logs/" + b"x" * 233,
        b"/" * 239,
        b"a/" * 119,
        "/logs/Ä".encode() * 26,
    ],
)
def test_what_is_not_there(server, path):
    assert ask(server, FtpOpcode.OPEN, path) == ask(server, FtpOpcode.CHECKSUM, path) == FtpErrorCode.NOT_FOUND


@pytest.mark.parametrize("path", [b"/logs/..", b"/logs/way_out", b"/logs/inside", b"/nowhere", b"pictures", LOG])
def test_folders_that_are_not_there(server, path):
    assert ask(server, FtpOpcode.LIST, path) == FtpErrorCode.NOT_FOUND


def test_a_name_of_a_whole_packet(server, folder):
    name = "n" * 233
    (folder / "logs" / name).write_bytes(b"1")
    try:
        assert ask(server, FtpOpcode.OPEN, b"/logs/" + name.encode()) == b"\x01\0\0\0"
        assert f"F{name}\t1".encode() in listing(server, b"/logs")
        assert b"S" in listing(server, b"/logs", FtpOpcode.LIST_WITH_TIME)
    finally:
        (folder / "logs" / name).unlink()


def test_a_path_longer_than_a_packet_is_refused(server):
    assert (
        ask(server, FtpOpcode.OPEN, b"/logs", size=240)
        == ask(server, FtpOpcode.LIST, b"/logs", size=255)
        == FtpErrorCode.DATA_SIZE
    )


PARTS = (b"logs", b"..", b"secret", b"way_out", b"inside", b"", b"mftp:")
PATHS = [b"/".join(parts) for length in range(1, 5) for parts in product(PARTS, repeat=length)]


def test_nothing_outside_is_read(server):
    for path in PATHS:
        assert ask(server, FtpOpcode.OPEN, path) == FtpErrorCode.NOT_FOUND, path
        assert ask(server, FtpOpcode.LIST, path) in (
            FtpErrorCode.NOT_FOUND,
            b"Fgeneral.json\t2\0Dlogs\0",
            b"D20240102\0",
        ), path


REQUESTS = st.builds(
    lambda opcode, path, session, offset: request(opcode, path, session=session, offset=offset),
    st.sampled_from(FtpOpcode),
    st.sampled_from([*PATHS[:56], LOG]),
    st.integers(0, 2),
    st.integers(0, 1100),
)


@settings(max_examples=100)
@given(payloads=st.lists(REQUESTS | st.binary(max_size=300), max_size=50))
def test_nothing_raises(folder, payloads):
    server = FtpServer(VirtualFiles({"general.json": lambda: b"{}"}, DiskFolders({"logs": folder / "logs"})))
    for number, payload in enumerate(payloads):
        for answer in (server.receive(STATION, payload, float(number)), server.next_payload(STATION, float(number))):
            assert answer is None or taken(answer)[2] in (128, 129)
    server.close()
