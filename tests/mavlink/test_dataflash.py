"""DataFlash logs: what DFReader of pymavlink reads is read, and damage hides nothing else."""

import random
import struct

import pytest
from pymavlink.DFReader import DFReader_binary

from mavlink.dataflash import DataFlash
from tests.mavlink.flights import DataFlashWriter

KINDS = frozenset({"ATT", "GPS", "PARM", "MSG"})


def flight(count=200):
    log = DataFlashWriter()
    for number in range(count):
        time = 10.0 + number / 10
        log.add(time, "ATT", Roll=number / 10, Pitch=-1.5, Yaw=359.0)
        if number % 5 == 0:
            log.add(time, "GPS", Status=3, GMS=400_000, GWk=2200, NSats=9, HDop=1.2, Lat=41.18, Lng=-8.7, Alt=12.34)
    return log.add(40.0, "PARM", Name="SYSID_THISMAV", Value=7.0).add(40.0, "MSG", Message="ArduSub V4.1.1")


def read(tmp_path, data):
    path = tmp_path / "a.BIN"
    path.write_bytes(data)
    log = DataFlash(path)
    return log, list(log.read(KINDS))


def test_records_are_those_that_pymavlink_reads(tmp_path):
    log, records = read(tmp_path, flight().data)
    theirs, found = DFReader_binary(str(log.path)), []
    while (message := theirs.recv_match(type=list(KINDS), strict=True)) is not None:
        values = message.to_dict()
        found.append((values.pop("mavpackettype"), values))
    assert [(record.name, record.values) for record in records] == found
    assert (len(found), log.lost) == (242, 0)


@pytest.mark.parametrize(
    "hole", [b"", bytes(5000), b"\xff" * 5000, random.Random(1).randbytes(5000), b"\xa3\x95" * 2500], ids=len
)
def test_damage_costs_only_the_records_that_it_hits(tmp_path, hole):
    data = flight().data
    whole = [record for record in read(tmp_path, data)[1] if record.name == "ATT"]
    size = 3 + struct.calcsize("<QffffffB")
    place = [at for at in range(len(data)) if data.startswith(b"\xa3\x95\x81", at)][100]
    log, records = read(tmp_path, data[: place + 10] + hole + data[place + size :])
    assert [record for record in records if record.name == "ATT"] == whole[:100] + whole[101:]
    assert log.lost == 10 + len(hole)


def test_a_file_that_was_cut_ends_there(tmp_path):
    data = flight().data
    log, records = read(tmp_path, data[:-7])
    assert (records[-1].name, log.lost) == ("PARM", 3 + 8 + 64 - 7)


GARBAGE = {"zeros": bytes(2_000_000), "heads": b"\xa3\x95\x80" * 500_000, "ones": b"\xff" * 2_000_000}


@pytest.mark.parametrize("garbage", GARBAGE.values(), ids=GARBAGE)
def test_garbage_has_no_records(tmp_path, garbage):
    log, records = read(tmp_path, garbage)
    assert (records, log.lost) == ([], len(garbage))


def test_a_time_that_cannot_be_is_damage_and_a_real_jump_is_not(tmp_path):
    log = flight(10).add(1e9, "ATT").add(41.0, "ATT").add(5000.0, "ATT").add(5000.1, "ATT").add(5000.2, "ATT")
    times = [record.time for record in read(tmp_path, log.data)[1] if record.name == "ATT"]
    assert times[-4:] == [10.9, 41.0, 5000.1, 5000.2]
