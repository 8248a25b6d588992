"""ULog files: what pyulog reads is read, and damage hides nothing else."""

import random

import numpy as np
import pytest
import pyulog

from mavlink.ulog import BadULog, ULog
from tests.mavlink.flights import ULogWriter

KINDS = frozenset({"vehicle_attitude", "battery_status", "P", "L", "O"})


def flight(count=200):
    log = ULogWriter().parameter("MAV_SYS_ID", 7).parameter("SYS_HZ", 0.1)
    for number in range(count):
        log.add(1.0 + number / 10, "vehicle_attitude", q=("f", [1.0, 0.0, number / 1000, 0.0]))
        log.add(1.0 + number / 10, "battery_status", number % 2, voltage_v=("f", 16.0), id=("B", 1))
        if number % 50 == 0:
            log.sync().text(1.0 + number / 10, 4, f"warning {number}")
    return log.dropout(120)


def read(tmp_path, data):
    path = tmp_path / "a.ulg"
    path.write_bytes(data)
    log = ULog(path)
    return log, list(log.read(KINDS))


def test_messages_are_those_that_pyulog_reads(tmp_path):
    log, records = read(tmp_path, flight().data)
    theirs = pyulog.ULog(str(log.path))
    for topic in theirs.data_list:
        ours = [record for record in records if (record.name, record.instance) == (topic.name, topic.multi_id)]
        for column, values in topic.data.items():
            assert np.array_equal([record.values[column] for record in ours], values)
    assert {(topic.name, topic.multi_id) for topic in theirs.data_list} == {
        (record.name, record.instance) for record in records if "timestamp" in record.values
    }
    parameters = {record.values["key"]: record.values["value"] for record in records if record.name == "P"}
    assert parameters == theirs.initial_parameters
    texts = [(record.time, record.values["text"]) for record in records if record.name == "L"]
    assert texts == [(text.timestamp / 1e6, text.message) for text in theirs.logged_messages]
    assert [record.values["ms"] for record in records if record.name == "O"] == [theirs.dropouts[0].duration]
    assert (log.lost, len(records)) == (0, 407)


@pytest.mark.parametrize("hole", [b"", bytes(5000), b"\xff" * 5000, random.Random(1).randbytes(5000)], ids=len)
def test_damage_costs_only_the_messages_that_it_hits(tmp_path, hole):
    data = flight().data
    whole = read(tmp_path, data)[1]
    head = bytes((26, 0)) + b"D" + bytes(2)
    place = [at for at in range(len(data)) if data.startswith(head, at)][100]
    log, records = read(tmp_path, data[: place + 10] + hole + data[place + 29 :])
    hit = next(record for record in whole if record.name == "vehicle_attitude" and record.time == 11.0)
    assert records == [record for record in whole if record is not hit]
    assert log.lost == 10 + len(hole)


def test_a_file_that_was_cut_ends_there(tmp_path):
    data = flight().data
    assert len(read(tmp_path, data[:-1])[1]) == len(read(tmp_path, data)[1]) - 1


@pytest.mark.parametrize("data", [b"", b"ULog", b"x" * 100, b"ULog\x01\x12\x36" + flight(1).data[7:]], ids=len)
def test_what_is_no_ulog_file_is_refused_by_name(tmp_path, data):
    with pytest.raises(BadULog, match=r"a\.ulg"):
        read(tmp_path, data)


def test_a_newer_kind_of_file_is_refused(tmp_path):
    data = flight(1).data
    with pytest.raises(BadULog, match=r"a\.ulg: is of a newer kind"):
        read(tmp_path, data[: 16 + 3 + 8] + b"\x02" + data[16 + 3 + 9 :])


@pytest.mark.parametrize(
    "fields", ["loop x;", "uint8_t[9999] x;" * 9, "what x;", "uint8_t[-1] x;", ":;[", "loop[9999] x;"]
)
def test_formats_that_lead_nowhere_are_left_out(tmp_path, fields):
    log = ULogWriter()
    log._message("F", f"loop:uint64_t timestamp;{fields}".encode())
    log._message("A", b"\0\x63\0loop")
    assert len(read(tmp_path, log.data + flight().data[16 + 3 + 40 :])[1]) == 407
