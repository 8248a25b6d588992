"""MAVLink's file transfer: requests, bursts, sessions, checksums."""

import errno
import os

import pytest

from mavlink.vehicle.files import ftp_server as limits
from mavlink.vehicle.files.ftp_messages import FtpErrorCode, FtpOpcode, checksum
from mavlink.vehicle.files.ftp_server import FtpServer
from tests.tasks.transports.mavlink_files import LOG, STATION, TEXT, ask, fill, request, taken, vehicle_files

OTHER = (245, 190)


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


def rest(server, asker=STATION):
    """What `next_payload` has."""
    found = []
    while server.is_busy(asker):
        if (payload := server.next_payload(asker, 0.0)) is not None:
            found.append(taken(payload))
    return found


def test_an_answer_names_its_request(server):
    answer = server.receive(STATION, request(FtpOpcode.OPEN, LOG, sequence=0xFFFF, session=7, offset=3), 0.0)
    assert taken(answer) == (0, 7, 128, FtpOpcode.OPEN, 0, 3, len(TEXT).to_bytes(4, "little"))
    answer = server.receive(STATION, request(FtpOpcode.READ, sequence=9, session=7, offset=1000, size=20), 0.0)
    assert taken(answer) == (10, 7, 128, FtpOpcode.READ, 0, 1000, TEXT[1000:1020])
    answer = server.receive(STATION, request(FtpOpcode.READ, sequence=10, session=7, offset=len(TEXT), size=20), 0.0)
    assert taken(answer) == (11, 7, 129, FtpOpcode.READ, 0, len(TEXT), bytes((FtpErrorCode.END,)))
    assert ask(server, FtpOpcode.TERMINATE, session=7) == b""
    assert ask(server, FtpOpcode.READ, session=7, size=20) == FtpErrorCode.SESSION


def test_what_may_not_be_read_is_refused_with_its_number(server, folder, monkeypatch):
    def refused(*args, **kwargs):
        raise PermissionError(errno.EACCES, "no")

    monkeypatch.setattr(os, "open", refused)
    payload = server.receive(STATION, request(FtpOpcode.OPEN, LOG), 0.0)
    assert taken(payload)[-1] == bytes((FtpErrorCode.ERRNO, errno.EACCES))


@pytest.mark.parametrize("opcode", range(FtpOpcode.CREATE, FtpOpcode.RENAME + 1))
def test_nothing_is_written(server, folder, opcode):
    before = sorted(folder.rglob("*"))
    assert ask(server, opcode, LOG) == FtpErrorCode.PROTECTED
    assert sorted(folder.rglob("*")) == before


def test_what_nobody_knows_is_refused_and_answers_are_not_answered(server):
    assert ask(server, 99) == ask(server, 17) == FtpErrorCode.UNKNOWN
    assert server.receive(STATION, request(128), 0.0) is server.receive(STATION, request(129), 0.0) is None
    assert ask(server, FtpOpcode.NONE) == b""


def test_a_large_folder_in_many_answers(server, folder):
    many = folder / "logs/many"
    many.mkdir()
    names = [f"picture_{number:06}.png" for number in range(2000)]
    for name in names:
        (many / name).touch()
    first = ask(server, FtpOpcode.LIST, b"/logs/many", now=0.0)
    for name in names[:500]:
        (many / name).unlink()
    found = first[:-1].split(b"\0")
    answers = 1
    while (answer := ask(server, FtpOpcode.LIST, b"/logs/many", offset=len(found), now=30.0)) != FtpErrorCode.END:
        found += answer[:-1].split(b"\0")
        answers += 1
    told = first.count(b"\0")
    listed = [f"F{name}\t0".encode() for name in names]
    assert found == listed[:told] + [b"S"] * (500 - told) + listed[500:]  # those that are gone keep their places
    assert answers < 200
    assert ask(server, FtpOpcode.LIST, b"/logs/many", now=32.0).startswith(b"Fpicture_000500")
    for name in names[500:]:
        (many / name).unlink()
    many.rmdir()


def test_files_that_change_while_they_are_read(server, folder):
    file = folder / "logs/live"
    file.write_bytes(b"x" * 1000)
    assert ask(server, FtpOpcode.OPEN, b"/logs/live") == (1000).to_bytes(4, "little")
    with file.open("ab") as growing:
        growing.write(b"y" * 1000)
    assert ask(server, FtpOpcode.READ, offset=900, size=239) == b"x" * 100
    assert ask(server, FtpOpcode.READ, offset=1000, size=239) == FtpErrorCode.END
    file.unlink()
    assert ask(server, FtpOpcode.READ, offset=0, size=10) == b"x" * 10
    file.write_bytes(b"z" * 1000)
    assert ask(server, FtpOpcode.OPEN, b"/logs/live", session=1) == (1000).to_bytes(4, "little")
    assert server.receive(STATION, request(FtpOpcode.BURST, session=1, size=100), 0.0) is None
    os.truncate(file, 150)
    assert [(step[2], step[5], step[6]) for step in rest(server)] == [
        (128, 0, b"z" * 100),
        (128, 100, b"z" * 50),
        (129, 150, bytes((FtpErrorCode.END,))),
    ]
    file.unlink()


def test_a_burst(server):
    ask(server, FtpOpcode.OPEN, LOG)
    assert server.receive(STATION, request(FtpOpcode.BURST, sequence=0xFFFE, offset=300, size=100), 0.0) is None
    packets = rest(server)
    assert [packet[0] for packet in packets] == [0xFFFF, 0, 1, 2, 3, 4, 5, 6]
    assert [packet[5] for packet in packets] == list(range(300, 1024, 100))
    assert [packet[4] for packet in packets] == [0] * 7 + [1]
    assert b"".join(packet[6] for packet in packets) == TEXT[300:]
    assert ask(server, FtpOpcode.BURST, sequence=7, offset=1024) == FtpErrorCode.END


def test_a_burst_ends_and_can_be_repeated(server, monkeypatch):
    monkeypatch.setattr(limits, "BURST", 3)
    ask(server, FtpOpcode.OPEN, LOG)
    wish = request(FtpOpcode.BURST, sequence=5, size=100)
    server.receive(STATION, wish, 0.0)
    assert taken(server.next_payload(STATION, 0.0))[5] == 0
    assert server.receive(STATION, wish, 0.0) is None  # goes on
    assert [(packet[0], packet[4], packet[5]) for packet in rest(server)] == [(7, 0, 100), (8, 1, 200)]
    server.receive(STATION, wish, 0.0)
    server.next_payload(STATION, 0.0)
    server.receive(STATION, request(FtpOpcode.BURST, sequence=5, size=100, offset=500), 0.0)  # as pymavlink goes on
    assert [(packet[0], packet[5]) for packet in rest(server)] == [(6, 500), (7, 600), (8, 700)]


def test_files_take_turns(server):
    for session in (3, 4):
        ask(server, FtpOpcode.OPEN, LOG, session=session)
        server.receive(STATION, request(FtpOpcode.BURST, session=session, size=239), 0.0)
    assert [packet[1] for packet in rest(server)] == [3, 4] * 5


def test_a_session_that_ends_ends_its_burst(server):
    ask(server, FtpOpcode.OPEN, LOG)
    server.receive(STATION, request(FtpOpcode.BURST), 0.0)
    ask(server, FtpOpcode.TERMINATE)
    assert (server.is_busy(STATION), server.next_payload(STATION, 0.0)) == (False, None)


def test_a_repeated_request_gets_the_same_answer(server):
    opened = server.receive(STATION, request(FtpOpcode.OPEN, LOG, sequence=1), 0.0)
    ask(server, FtpOpcode.READ, sequence=2, size=10)
    assert server.receive(STATION, request(FtpOpcode.OPEN, LOG, sequence=1), 0.0) == opened
    closed = server.receive(STATION, request(FtpOpcode.TERMINATE, sequence=3), 0.0)
    assert server.receive(STATION, request(FtpOpcode.TERMINATE, sequence=3), 0.0) == closed
    assert ask(server, FtpOpcode.TERMINATE, sequence=4) == FtpErrorCode.SESSION
    assert ask(server, FtpOpcode.OPEN, LOG, sequence=1) == len(TEXT).to_bytes(4, "little")  # a new client, by chance
    assert ask(server, FtpOpcode.READ, sequence=2, size=10) == TEXT[:10]
    assert ask(server, FtpOpcode.RESET, sequence=0) == ask(server, FtpOpcode.RESET, sequence=0) == b""
    assert ask(server, FtpOpcode.READ, sequence=2, size=10) == FtpErrorCode.SESSION


def test_answers_are_those_of_the_one_who_asks(server):
    ask(server, FtpOpcode.OPEN, LOG)
    assert ask(server, FtpOpcode.READ, asker=OTHER, size=10) == FtpErrorCode.SESSION
    assert ask(server, FtpOpcode.RESET, asker=OTHER) == b""
    assert ask(server, FtpOpcode.READ, size=10) == TEXT[:10]


def test_sessions_are_few_and_end_after_a_while(server):
    for session in range(5):
        assert ask(server, FtpOpcode.OPEN, LOG, session=session) == len(TEXT).to_bytes(4, "little")
    sixth = {"session": 5, "sequence": 9}
    assert ask(server, FtpOpcode.OPEN, LOG, **sixth) == FtpErrorCode.NO_SESSIONS
    assert ask(server, FtpOpcode.OPEN, LOG, session=4, sequence=8) == len(TEXT).to_bytes(
        4, "little"
    )  # in its own place
    assert ask(server, FtpOpcode.READ, session=2, size=10, now=50.0) == TEXT[:10]
    assert ask(server, FtpOpcode.OPEN, LOG, now=61.0, **sixth) == len(TEXT).to_bytes(4, "little")
    assert ask(server, FtpOpcode.READ, session=2, size=10, now=61.0) == TEXT[:10]
    assert ask(server, FtpOpcode.READ, session=3, size=10, now=61.0) == FtpErrorCode.SESSION


def test_open_files_are_closed(server, folder):
    before = len(os.listdir("/proc/self/fd"))
    for asker in range(40):
        for session in range(7):
            ask(server, FtpOpcode.OPEN, LOG, session=session, asker=asker)
        ask(server, FtpOpcode.CHECKSUM, LOG, asker=asker)
        ask(server, FtpOpcode.OPEN, b"/logs/pipe", asker=asker)
        ask(server, FtpOpcode.LIST, b"/logs/20240102", asker=asker)
    assert len(os.listdir("/proc/self/fd")) == before + 16 * 5
    assert ask(server, FtpOpcode.NONE, asker=99) == FtpErrorCode.NO_SESSIONS
    server.forget_silent(61.0)
    assert len(os.listdir("/proc/self/fd")) == before
    assert ask(server, FtpOpcode.NONE, asker=99) == b""


def test_who_only_lists_makes_room_for_others(server):
    ask(server, FtpOpcode.OPEN, LOG, asker="reader")
    for asker in range(100):
        assert ask(server, FtpOpcode.LIST, b"/", asker=asker, now=float(asker) / 100) != FtpErrorCode.NO_SESSIONS
    assert ask(server, FtpOpcode.READ, asker="reader", size=1, now=1.0) == TEXT[:1]


def bitwise(data):
    """CRC-32 as MAVLink's implementations calculate it."""
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xEDB88320 if value & 1 else 0)
    return value


def test_checksums(server, folder):
    assert checksum(b"123456789") == bitwise(b"123456789") == 0x2DFD2D88
    assert checksum(TEXT[7:], checksum(TEXT[:7])) == bitwise(TEXT)
    assert ask(server, FtpOpcode.CHECKSUM, LOG) == bitwise(TEXT).to_bytes(4, "little")
    assert ask(server, FtpOpcode.CHECKSUM, LOG[:-8] + b"empty") == bytes(4)


def test_the_checksum_of_a_long_file_takes_several_steps(server, folder):
    (folder / "logs/long").write_bytes(TEXT * 300)
    wish = request(FtpOpcode.CHECKSUM, b"/logs/long", sequence=3)
    assert server.receive(STATION, wish, 0.0) is server.receive(STATION, wish, 0.0) is None
    assert server.is_busy(STATION)
    assert [server.next_payload(STATION, 0.0) for _ in range(3)] == [None] * 3
    (folder / "logs/long").unlink()
    payload = server.next_payload(STATION, 0.0)
    assert taken(payload) == (4, 0, 128, FtpOpcode.CHECKSUM, 0, 0, checksum(TEXT * 300).to_bytes(4, "little"))
    assert (server.is_busy(STATION), server.receive(STATION, wish, 0.0)) == (False, payload)
