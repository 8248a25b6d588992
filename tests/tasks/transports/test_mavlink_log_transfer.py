"""LOG_REQUEST_LIST and LOG_REQUEST_DATA."""

import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink.vehicle.files import log_server as limits
from mavlink.vehicle.files.log_server import LogServer
from mavlink.vehicle.files.virtual_files import VirtualFiles
from tasks.transports.mavlink_links.ftp_folders import DiskFolders
from tests.tasks.transports.mavlink_station import DIALECT

STATION = (255, 190)
SIZES = {"20240102/030405_dive": 900, "20240102/040000": 100, "20240103/000001": 91}
ALL = {"start": 0, "end": 0xFFFF}


@pytest.fixture
def folder(tmp_path):
    for name, size in SIZES.items():
        log = tmp_path / name
        log.mkdir(parents=True)
        (log / "Data.lsf.gz").write_bytes(bytes(number % 251 for number in range(size)))
        (log / "Output.txt").write_text("text")
    (tmp_path / "20240101/no log").mkdir(parents=True)
    (tmp_path / "20240104/120000").mkdir(parents=True)
    (tmp_path / "20240104/120000/Data.lsf").touch()
    (tmp_path / "20240104/way_out").symlink_to(tmp_path / "20240102")
    return tmp_path


@pytest.fixture
def server(folder):
    server = LogServer(VirtualFiles({}, DiskFolders({"logs": folder})), b"logs")
    yield server
    server.close()


def ask(server, name, values, *, asker=STATION, now=0.0, first=0):
    """All that is sent then."""
    server.receive(asker, name, values, now, first=first)
    found = []
    while server.is_busy(asker):
        kind, fields = server.next_message(asker, now)
        assert DIALECT.by_name[kind].unpack(DIALECT.by_name[kind].pack(fields)).keys() == fields.keys()
        found.append(fields)
    assert server.next_message(asker, now) is None
    return found


def read(server, log, offset, count, **how):
    found = ask(server, "LOG_REQUEST_DATA", {"id": log, "ofs": offset, "count": count}, **how)
    assert all(len(item["data"]) == 90 and not any(item["data"][item["count"] :]) for item in found)
    return [(item["id"], item["ofs"], item["count"]) for item in found]


@pytest.mark.parametrize("first", [0, 1])
def test_logs_are_numbered_from_the_oldest_on(server, first):
    found = ask(server, "LOG_REQUEST_LIST", ALL, first=first)
    assert [(log["id"], log["size"]) for log in found] == list(enumerate([900, 100, 91], first))
    assert {(log["num_logs"], log["last_log_num"]) for log in found} == {(3, first + 2)}
    assert [log["time_utc"] for log in found] == [1704164645, 1704168000, 1704240001]


def test_a_part_of_the_list(server):
    assert [log["id"] for log in ask(server, "LOG_REQUEST_LIST", {"start": 1, "end": 1})] == [1]
    assert [log["id"] for log in ask(server, "LOG_REQUEST_LIST", {"start": 2, "end": 9})] == [2]
    assert ask(server, "LOG_REQUEST_LIST", {"start": 7, "end": 9}) == []
    assert [log["id"] for log in ask(server, "LOG_REQUEST_LIST", {"start": 2, "end": 3}, first=1)] == [2, 3]


def test_no_logs(tmp_path):
    for name in ("missing", ""):
        server = LogServer(VirtualFiles({}, DiskFolders({"logs": tmp_path / name})), b"logs")
        none = {"id": 0, "num_logs": 0, "last_log_num": 0, "time_utc": 0, "size": 0}
        assert ask(server, "LOG_REQUEST_LIST", ALL) == [none]
        assert read(server, 0, 0, 90) == []


def test_a_log_that_is_not_named_by_its_time_has_that_of_its_file(folder):
    log = folder / "dives/first"
    log.mkdir(parents=True)
    (log / "Data.lsf").write_bytes(b"1")
    os.utime(log / "Data.lsf", (1700000000, 1700000000))
    server = LogServer(VirtualFiles({}, DiskFolders({"logs": folder})), b"logs")
    assert ask(server, "LOG_REQUEST_LIST", ALL)[-1]["time_utc"] == 1700000000


def test_data(server, folder):
    ask(server, "LOG_REQUEST_LIST", ALL)
    assert read(server, 2, 0, 0xFFFFFFFF) == [(2, 0, 90), (2, 90, 1)]
    assert read(server, 0, 0, 0xFFFFFFFF)[-2:] == [(0, 810, 90), (0, 900, 0)]  # the end is told
    assert read(server, 0, 0, 900)[-1] == (0, 810, 90)  # it is known
    assert read(server, 0, 180, 90) == [(0, 180, 90)]
    assert read(server, 1, 45, 20) == [(1, 45, 20)]
    assert read(server, 1, 5000, 90) == [(1, 5000, 0)]
    assert read(server, 3, 0, 90) == read(server, 0xFFFF, 0, 90) == []
    data = ask(server, "LOG_REQUEST_DATA", {"id": 1, "ofs": 0, "count": 100})
    assert b"".join(item["data"][: item["count"]] for item in data) == bytes(range(100))


def test_numbers_begin_where_they_were_told_to(server):
    assert ask(server, "LOG_REQUEST_LIST", ALL, first=1)[0]["id"] == 1
    assert read(server, 1, 0, 90, first=1) == [(1, 0, 90)]
    assert read(server, 0, 0, 90, first=1) == []
    assert read(server, 3, 0, 900, first=1) == [(3, 0, 90), (3, 90, 1)]


def test_a_log_is_as_long_as_it_was_told_to_be(server, folder):
    ask(server, "LOG_REQUEST_LIST", ALL)
    with (folder / "20240103/000001/Data.lsf.gz").open("ab") as live:
        live.write(bytes(1000))
    assert read(server, 2, 0, 0xFFFFFFFF) == [(2, 0, 90), (2, 90, 1)]
    assert ask(server, "LOG_REQUEST_LIST", ALL, now=6.0)[2]["size"] == 1091


def test_numbers_stay_until_the_list_is_asked_for(server, folder):
    ask(server, "LOG_REQUEST_LIST", ALL)
    (folder / "20240102/030405_dive/Data.lsf.gz").unlink()
    assert read(server, 1, 0, 90, now=6.0) == [(1, 0, 90)]
    assert read(server, 0, 0, 90, now=6.0) == [(0, 0, 0)]
    assert [log["id"] for log in ask(server, "LOG_REQUEST_LIST", {"start": 2, "end": 2}, now=6.0)] == [2]
    assert [log["size"] for log in ask(server, "LOG_REQUEST_LIST", ALL, now=6.0)] == [100, 91]


def test_gaps_are_filled_one_after_the_other(server):
    ask(server, "LOG_REQUEST_LIST", ALL)
    for offset, count in ((0, 90), (270, 180), (270, 90), (810, 90)):
        server.receive(STATION, "LOG_REQUEST_DATA", {"id": 0, "ofs": offset, "count": count}, 0.0)
    assert read(server, 0, 360, 90) == [(0, offset, 90) for offset in (0, 270, 360, 810)]  # none twice
    server.receive(STATION, "LOG_REQUEST_DATA", {"id": 0, "ofs": 0, "count": 900}, 0.0)
    assert read(server, 1, 0, 90) == [(1, 0, 90)]  # another log replaces it


def test_the_station_ends_a_transfer(server, folder):
    before = len(os.listdir("/proc/self/fd"))
    server.receive(STATION, "LOG_REQUEST_DATA", {"id": 0, "ofs": 0, "count": 900}, 0.0)
    server.next_message(STATION, 0.0)
    assert len(os.listdir("/proc/self/fd")) == before + 1
    assert ask(server, "LOG_REQUEST_END", {}) == []
    assert len(os.listdir("/proc/self/fd")) == before
    read(server, 0, 0, 90)
    server.forget_silent(61.0)
    assert len(os.listdir("/proc/self/fd")) == before


def test_nothing_is_erased(server, folder):
    before = sorted(folder.rglob("*"))
    assert ask(server, "LOG_ERASE", {}) == []
    assert sorted(folder.rglob("*")) == before


def test_what_is_kept_is_limited(server, monkeypatch):
    monkeypatch.setattr(limits, "MOST_LOGS", 2)
    assert [log["size"] for log in ask(server, "LOG_REQUEST_LIST", ALL)] == [100, 91]
    monkeypatch.setattr(limits, "LONGEST_RANGE", 90)
    assert read(server, 0, 0, 0xFFFFFFFF) == [(0, 0, 90)]
    before = len(os.listdir("/proc/self/fd")) - 1
    for asker in range(100):
        read(server, 0, 0, 45, asker=asker, now=asker / 100)
    assert len(os.listdir("/proc/self/fd")) == before + 16
    for offset in range(0, 4500, 45):
        server.receive(STATION, "LOG_REQUEST_DATA", {"id": 0, "ofs": offset, "count": 1}, 1.0)
    assert len(read(server, 0, 99, 1, now=1.0)) == 32


@pytest.fixture(scope="module")
def one_log(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    (folder / "20240102/030405").mkdir(parents=True)
    (folder / "20240102/030405/Data.lsf").write_bytes(bytes(1000))
    return folder


@settings(max_examples=50)
@given(
    wishes=st.lists(
        st.tuples(
            st.sampled_from(("LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_REQUEST_END", "LOG_ERASE")),
            st.binary(max_size=12),
        ),
        max_size=20,
    )
)
def test_nothing_raises(one_log, wishes):
    server = LogServer(VirtualFiles({}, DiskFolders({"logs": one_log})), b"logs")
    for name, payload in wishes:
        definition = DIALECT.by_name[name]
        server.receive(STATION, name, definition.unpack(definition.pad_payload(payload)), 0.0)
        server.next_message(STATION, 0.0)
    server.close()
