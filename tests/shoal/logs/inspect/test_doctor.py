"""Diagnosis and repair of logs."""

import gzip
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import imc
from shoal.logs.inspect import examine_log, repair_log
from tests.log_messages import OTHER, START, VEHICLE, at, labels

LOGS = Path(__file__).parents[3] / "data" / "logs"


def said(folder):
    return [f"{finding.severity}: {finding.text}" for finding in examine_log(folder).findings]


def stop(seconds):
    return at(seconds, imc.LoggingControl, op=imc.LoggingControl.Op.STOPPED)


def good(count=200):
    return [*labels(Battery=7), *(at(n / 10) for n in range(count)), stop(count / 10)]


def test_a_good_log_is_healthy(make_log):
    examination = examine_log(make_log(good()))
    assert examination.healthy
    assert examination.findings == []


def test_the_log_of_dune_has_nothing_worse_than_notes():
    findings = examine_log(LOGS / "dune-idle").findings
    assert [finding.severity for finding in findings if "IMC.xml" not in finding.text] == ["note"]


def damaged(kind):
    packets = [imc.encode(message) for message in good()]
    if kind == "CRC":
        packets[50] = packets[50][:-1] + bytes([packets[50][-1] ^ 1])
    elif kind == "garbage":
        packets.insert(50, b"garbage")
    elif kind == "cut":
        packets[-1] = packets[-1][:10]
    return packets


@pytest.mark.parametrize(
    ("kind", "text", "saved"),
    [
        ("CRC", "error: damage: wrong CRC: 1 place, 26 bytes", 201),
        ("garbage", "error: damage: no packet begins here: 1 place, 7 bytes", 202),
        ("cut", "warning: damage: packet cut short: 1 place, 10 bytes", 201),
    ],
)
def test_damage_is_reported_and_repaired(make_log, tmp_path, kind, text, saved):
    examination = examine_log(make_log(damaged(kind), compression="none"))
    assert text in [f"{finding.severity}: {finding.text}" for finding in examination.findings]
    assert not examination.healthy
    assert repair_log(examination, tmp_path / "clean") == saved
    assert examine_log(tmp_path / "clean").healthy
    assert len(imc.Log(tmp_path / "clean")) == saved


@pytest.mark.heavy
def test_a_cut_member_is_reported_and_mended(make_log, tmp_path):
    """SIGKILL during a write cuts the last member at any byte."""
    path = make_log(good(), block=2000) / "Data.lsf.gz"
    whole = path.read_bytes()
    packets = b"".join(map(imc.encode, good()))
    last = whole.rindex(b"\x1f\x8b\x08\0")
    complete = len(gzip.decompress(whole[:last]))
    saved = []
    for cut in range(last + 1, len(whole), 9):
        path.write_bytes(whole[:cut])
        with pytest.raises((EOFError, gzip.BadGzipFile)):
            gzip.decompress(path.read_bytes())
        examination = examine_log(path.parent)
        assert "warning: damage: cut compressed data: 1 place" in said(path.parent)
        count = repair_log(examination, tmp_path / str(cut))
        mended = gzip.decompress((tmp_path / str(cut) / "Data.lsf.gz").read_bytes())
        assert len(mended) >= complete
        assert packets.startswith(mended)
        assert examine_log(tmp_path / str(cut)).healthy
        assert [*imc.Log(tmp_path / str(cut))] == good()[:count]
        saved.append(count)
    assert saved == sorted(saved)
    assert saved[-1] == len(good())  # of which only the checksum is cut


def test_several_threads_find_the_same(make_log, monkeypatch):
    monkeypatch.setattr("imc.lsf.parallel_gunzip.STRETCH", 500)
    path = make_log(good(2000), block=500) / "Data.lsf.gz"
    data = bytearray(path.read_bytes())
    for place in (3000, 9000):
        data[place] ^= 0x55
    path.write_bytes(data)
    with ThreadPoolExecutor(2) as threads:
        examination = examine_log(path.parent, spread=threads.map)
    assert not examination.healthy
    assert examination.findings == examine_log(path.parent).findings


@pytest.mark.parametrize(("content", "text"), [(b"", "the file is empty"), (b"x" * 99, "none of its 99 bytes")])
def test_no_log_at_all(tmp_path, content, text):
    (tmp_path / "Data.lsf").write_bytes(content)
    examination = examine_log(tmp_path)
    assert [finding.severity for finding in examination.findings] == ["error"]
    assert text in examination.findings[0].text
    with pytest.raises(ValueError, match="nothing is written"):
        repair_log(examination, tmp_path / "clean")
    assert not (tmp_path / "clean").exists()


@pytest.mark.parametrize(
    "schema",
    [b"<messages><", b"\x1f\x8bnonsense", b'<!DOCTYPE x [<!ENTITY a "b">]><messages/>', gzip.compress(bytes(1 << 25))],
)
def test_bad_definitions_are_reported_and_replaced(make_log, tmp_path, schema):
    examination = examine_log(make_log(good(), schema=schema))
    assert "the definitions beside the log are bad" in examination.findings[0].text
    repair_log(examination, tmp_path / "clean")
    assert imc.Log(tmp_path / "clean").schema == imc.builtin()


def test_missing_definitions(make_log):
    assert said(make_log(good(), schema=None)) == ["warning: there is no IMC.xml or IMC.xml.gz beside the log"]


def test_packets_that_contradict_the_definitions(make_log):
    packet = imc.encode(imc.Unknown(id=imc.Pulse.ID, payload=bytes(8), timestamp=START, src=VEHICLE, src_ent=7))
    short = imc.encode(imc.Unknown(id=imc.EntityState.ID, payload=bytes(1), timestamp=START, src=VEHICLE, src_ent=7))
    found = examine_log(make_log([*good(), packet, packet, short, stop(21)])).findings
    texts = [finding.text for finding in found if finding.severity == "error"]
    assert texts == [
        "the definitions contradict the packets: EntityState, 1 packet",
        "the definitions contradict the packets: Pulse, 2 packets",
    ]
    assert "2 packets: 8 bytes of fields in place of 0" in found[1].places[0]


def test_unknown_ids(make_log):
    unknown = [at(1, imc.Unknown, id=720), at(1, imc.Unknown, id=9999), at(2, imc.Unknown, id=9999)]
    (finding,) = examine_log(make_log([*good(), *unknown, stop(21)])).findings
    assert finding.text == "messages that the definitions do not have: 3 packets"
    assert finding.places == (
        "id 720: 1 packet, StationKeepingExtended in newer versions of DUNE",
        "id 9999: 2 packets",
    )


def test_a_clock_that_leaps_and_one_that_is_off(make_log):
    messages = [*labels(Battery=7), *(at(n / 10 - (60 if n > 300 else 0)) for n in range(600)), stop(0)]
    messages[100:100] = [at(-4000 + n, src=OTHER) for n in range(30)]
    found = said(make_log(messages))
    assert "warning: clocks jump: 1 time" in found
    assert any("the clock of lauv-seacon-1 is off" in text for text in found)


def test_silence_of_a_regular_message(make_log):
    others = [at(n, imc.Current) for n in range(60)]
    spoken = [at(n / 10) for n in range(600) if not 200 <= n < 300]
    messages = sorted([*others, *spoken], key=lambda message: message.timestamp)
    (finding,) = examine_log(make_log([*labels(Battery=7), *messages, stop(60)])).findings
    assert finding.text == "gaps in regular messages: 1 kind of message"
    assert "Voltage of Battery (every 0.1 s): silent for 10.1 s from 2026-01-01 00:00:19.900 UTC" in finding.places[0]


def test_entities_without_labels_nobody_and_too_many(make_log):
    many = [at(1, imc.EntityInfo, id=n, src_ent=n, label=f"Entity {n}") for n in range(255)]
    found = said(make_log([*many, at(2, src=VEHICLE, src_ent=255), stop(3)]))
    assert "warning: lauv-noptilus-1 has 255 entities" in found
    assert "note: 1 message of entity 255, which means none" in found
    assert "note: 1 entity without a label" in said(make_log([*good(), at(1, src_ent=9), stop(21)], "other"))


def test_several_runs_in_one_log(make_log):
    found = said(make_log([*labels(GPS=7), at(1), *labels(DVL=7), at(2), stop(3)]))
    assert found == ["warning: 1 entity with several labels"]


def test_a_log_that_was_cut_off(make_log):
    assert said(make_log(good()[:-1])) == ["note: the log does not end with LoggingControl STOPPED"]
