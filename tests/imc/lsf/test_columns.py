"""Logs as columns equal the messages, for every type, byte order and kind of damage."""

import math
import random
import re
import subprocess
import sys
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from fastcrc.crc16 import arc
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc
from imc.lsf import Log, scan
from imc.lsf import scanner as packet_scan

LOGS = Path(__file__).parents[2] / "data" / "logs"
HEADER = ("timestamp", "src", "src_ent", "dst", "dst_ent")
FAST = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
RANGES = {"b": 1 << 7, "h": 1 << 15, "i": 1 << 31, "q": 1 << 63}

pieces = st.one_of(
    st.binary(min_size=1, max_size=60),
    st.sampled_from(
        [b"\x54", b"\x54\xfe", b"\xfe\x54", b"\x54\xfe\x54", b"\x54\xfe\x01\0\x96\0", b"\xfe\x54\0\x01\0\x30"]
    ),
)


def some_message(kind: type[imc.Message], chance: random.Random) -> imc.Message:
    """A message of the type with varied values."""
    values: dict[str, Any] = {}
    for info, code in zip(imc.fields(kind), kind.WIRE, strict=True):
        if code in "fd":
            value: Any = chance.choice([0.0, -1.5, 1e30, math.inf, chance.randrange(-99, 99) / 4])
        elif code in "TR":
            value = chance.randbytes(chance.randrange(9)).hex()
            value = value if code == "T" else value.encode()
        elif code in "ML":
            inner = [
                chance.choice([None, imc.Heartbeat(), imc.EntityInfo(label="x" * chance.randrange(4))]) for _ in "ab"
            ]
            value = inner[0] if code == "M" else inner[: chance.randrange(3)]
        else:
            half = RANGES[code.lower()]
            value = chance.randrange(-half, half) if code.islower() else chance.randrange(2 * half)
        values[info.name] = value
    address = {"src": chance.randrange(1 << 16), "src_ent": chance.randrange(256), "dst": 7, "dst_ent": 9}
    return kind(timestamp=1e9 + chance.random(), **address, **values)


def assert_rows_are(rows: np.ndarray[Any, Any], messages: list[imc.Message]) -> None:
    for name in rows.dtype.names or ():
        np.testing.assert_array_equal(rows[name], [getattr(message, name) for message in messages], err_msg=name)
    assert len(rows) == len(messages)


def reference_scan(data: bytes) -> list[tuple[int, bytes]]:
    """Offset and bytes of each packet, found byte by byte."""
    found: list[tuple[int, bytes]] = []
    pos = 0
    while pos + 22 <= len(data):
        order = {b"\x54\xfe": "little", b"\xfe\x54": "big"}.get(data[pos : pos + 2])
        packet = data[pos : pos + 22 + int.from_bytes(data[pos + 4 : pos + 6], order or "little")]
        whole = order and pos + len(packet) <= len(data) and len(packet) == 22 + int.from_bytes(packet[4:6], order)
        if whole and arc(packet[:-2]) == int.from_bytes(packet[-2:], order):
            found.append((pos, packet))
            pos += len(packet)
        else:
            pos += 1
    return found


@pytest.mark.parametrize("name", ["dune-idle", "dune-mission-cut"])
def test_columns_of_logs_of_dune_are_the_objects(name: str) -> None:
    log = Log(LOGS / name)
    messages: dict[str, list[imc.Message]] = {}
    for message in log:
        messages.setdefault(type(message).__name__, []).append(message)
    assert {kind: len(found) for kind, found in messages.items()} == log.counts()
    arrays = log.arrays()
    assert set(arrays) == set(messages)
    for kind, found in messages.items():
        assert_rows_are(log[kind], found)
        np.testing.assert_array_equal(arrays[kind], log[kind])
        assert list(log.objects(kind)) == found
    assert log.losses == []


@pytest.mark.heavy
def test_every_type_in_both_byte_orders(tmp_path: Path) -> None:
    chance = random.Random(1)
    path = tmp_path / "Data.lsf"
    messages: dict[str, list[imc.Message]] = {}
    packets: list[bytes] = []
    for kind in imc.builtin().messages * 4:
        message = some_message(imc.builtin()[kind.abbrev], chance)
        packet = imc.encode(message, chance.choice(["little", "big"]))
        if chance.random() < 0.2:
            packet = imc.encode(imc.decode(packet).replace(surplus=chance.randbytes(9)))
        packets.append(packet)
        messages.setdefault(kind.abbrev, []).append(imc.decode(packet))
    path.write_bytes(b"".join(packets))
    log = Log(path)
    arrays = log.arrays()
    for name, found in messages.items():
        assert_rows_are(arrays[name], found)
        assert list(log.objects(name)) == found
    assert log.losses == []


@pytest.mark.heavy
def test_payloads_that_are_too_short_are_losses_and_no_rows(tmp_path: Path) -> None:
    chance = random.Random(2)
    path = tmp_path / "Data.lsf"
    for kind in imc.builtin().messages:
        message = some_message(imc.builtin()[kind.abbrev], chance)
        payload = imc.encode(message)[20:-2]
        packets = [
            imc.encode(imc.Unknown(id=kind.id, timestamp=1e9 + cut, payload=payload[:cut]))
            for cut in range(len(payload))
        ]
        path.write_bytes(b"".join([imc.encode(message), *packets, imc.encode(message)]))
        log, plain = Log(path), Log(path)
        expected = list(plain.messages(kind.abbrev))
        assert_rows_are(log[kind.abbrev], expected)
        assert list(log.objects(kind.abbrev)) == expected
        assert [loss[:2] for loss in log.losses] == [loss[:2] for loss in plain.losses]
        assert len(log.losses) + len(expected) == len(packets) + 2


@pytest.mark.heavy
@FAST
@given(st.lists(st.tuples(st.integers(0, 40), pieces), max_size=12), st.integers(0, 2**32), st.binary(max_size=30))
def test_good_packets_around_damage_are_all_rows(
    tmp_path: Path, damage: list[tuple[int, bytes]], seed: int, tail: bytes
) -> None:
    chance = random.Random(seed)
    kinds = [imc.EstimatedState, imc.EntityState, imc.PlanControl, imc.Rpm]
    parts: list[bytes] = []
    good: list[imc.Message] = []
    for _ in range(40):
        message = some_message(chance.choice(kinds), chance)
        if chance.random() < 0.2:
            message = imc.Unknown(id=9999, payload=imc.encode(message) * 2, timestamp=1e9)
        packet = bytearray(imc.encode(message, chance.choice(["little", "big"])))
        if not isinstance(message, imc.Unknown) and chance.random() < 0.2:
            packet[chance.randrange(6, len(packet))] ^= 1 << chance.randrange(8)
        else:
            good.append(imc.decode(bytes(packet)))
        parts.append(bytes(packet))
    for place, piece in damage:
        parts.insert(place, piece)
    path = tmp_path / "Data.lsf"
    path.write_bytes(data := b"".join(parts) + tail)
    log = Log(path)
    assert log.counts() == Counter(f"id {m.id}" if isinstance(m, imc.Unknown) else type(m).__name__ for m in good)
    for kind in kinds:
        found = [message for message in good if isinstance(message, kind)]
        assert_rows_are(log[kind], found)
        assert list(log.objects(kind)) == found
    spans = sorted([(at, len(packet)) for at, packet in log.packets()] + [loss[:2] for loss in log.losses])
    assert sum(length for _, length in spans) == len(data)
    assert all(a + length == b for (a, length), (b, _) in pairwise(spans))


@FAST
@given(st.lists(st.one_of(pieces, st.integers(0, 2**32)), max_size=15), st.integers(1, 200), st.integers(1, 200))
def test_scan_finds_what_a_search_byte_by_byte_finds(parts: list[bytes | int], step: int, size: int) -> None:
    data = b""
    for part in parts:
        if isinstance(part, int):
            chance = random.Random(part)
            message = some_message(chance.choice([imc.EntityState, imc.Heartbeat, imc.MsgList]), chance)
            packet = bytearray(imc.encode(message, chance.choice(["little", "big"])))
            if chance.random() < 0.4:
                packet[chance.randrange(len(packet))] ^= 1 << chance.randrange(8)
            part = bytes(packet) if chance.random() < 0.8 else imc.encode(imc.Unknown(payload=bytes(packet) * 2))
        data += part
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(packet_scan, "PIECE", size)
        chunks = [data[at : at + step] for at in range(0, len(data), step)]
        found = [item for batch in scan(chunks, 0xFE54, lambda *_: None) for item in batch.packets()]
    assert found == reference_scan(data)


def test_damage_to_several_neighbours_is_seen(tmp_path: Path) -> None:
    packets = [bytearray(imc.encode(imc.Rpm(timestamp=float(n), value=n))) for n in range(200)]
    damaged = {3, 4, 5, 17, 18, 31, 32, 47, 48, 49, 150}
    for number in damaged:
        packets[number][20] ^= 0x10
    (tmp_path / "Data.lsf").write_bytes(b"".join(packets))
    log = Log(tmp_path)
    assert log["Rpm"]["timestamp"].tolist() == [float(n) for n in range(200) if n not in damaged]
    assert [(loss.offset, loss.length) for loss in log.losses] == [
        (24 * first, 24 * length) for first, length in [(3, 3), (17, 2), (31, 2), (47, 3), (150, 1)]
    ]
    assert {loss.reason for loss in log.losses} == {"wrong CRC"}
    unchecked = Log(tmp_path, crc=False)
    assert len(unchecked["Rpm"]) == len(list(unchecked)) == len(list(unchecked.objects("Rpm"))) == 200
    assert unchecked.losses == []


def test_without_crcs_garbage_is_no_packet(tmp_path: Path) -> None:
    good = imc.encode(imc.Rpm(value=1))
    bad = bytearray(good)
    bad[4] = 3
    (tmp_path / "Data.lsf").write_bytes(good + b"\x54\xfe\0\0\x99\0garbage" + good + bytes(bad) + good * 2 + good[:9])
    log = Log(tmp_path, crc=False)
    assert len(log["Rpm"]) == 4
    assert [loss.offset for loss in log.losses] == [24, 61, 133]


def test_logs_of_many_windows(tmp_path: Path) -> None:
    kinds = [imc.EstimatedState(timestamp=1e9 + n, depth=n) for n in range(100)]
    many = b"".join(map(imc.encode, kinds))
    rare = [imc.encode(imc.LogBookEntry(timestamp=1e9, htime=float(n), text="x" * n)) for n in range(3)]
    sonar = imc.encode(imc.SonarData(data=bytes(60000)))
    data = rare[0] + many * 120 + sonar * 20 + rare[1] + many * 100 + rare[2]
    (tmp_path / "Data.lsf").write_bytes(data)
    log = Log(tmp_path)
    assert log.counts() == {"EstimatedState": 22000, "LogBookEntry": 3, "SonarData": 20}
    assert log["EstimatedState"]["depth"].tolist() == list(range(100)) * 220
    arrays = log.arrays("LogBookEntry", "EstimatedState")
    assert list(arrays) == ["LogBookEntry", "EstimatedState"]
    assert arrays["LogBookEntry"]["htime"].tolist() == [0.0, 1.0, 2.0]
    np.testing.assert_array_equal(arrays["EstimatedState"], log["EstimatedState"])
    assert [entry.text for entry in log.objects("LogBookEntry")] == ["", "x", "xx"]
    assert [type(m).__name__ for m in log.messages("LogBookEntry", "SonarData")].count("SonarData") == 20


def test_objects_are_a_sequence() -> None:
    log = Log(LOGS / "dune-idle")
    objects, messages = log.objects(imc.EntityState), list(log.messages(imc.EntityState))
    assert len(objects) == len(messages) == 289
    assert objects[0] == messages[0]
    assert objects[-1] == messages[-1]
    assert list(objects[10:200:7]) == messages[10:200:7]
    assert list(objects.select(log[imc.EntityState]["src_ent"] == 3)) == [m for m in messages if m.src_ent == 3]
    assert messages[5] in objects
    with pytest.raises(IndexError):
        objects[289]


def test_conditions() -> None:
    log = Log(LOGS / "dune-idle")
    label = log.entities[26, 70]
    middle = float(np.median(log["Temperature"]["timestamp"]))
    for conditions, holds in [
        ({"start": middle}, lambda m: m.timestamp >= middle),
        ({"end": middle}, lambda m: m.timestamp < middle),
        (
            {"start": middle - 5, "end": middle + 5, "entity": 70},
            lambda m: abs(m.timestamp - middle) < 5 and m.src_ent == 70,
        ),
        ({"entity": label}, lambda m: (m.src, m.src_ent) == (26, 70)),
        ({"src": log.systems[26]}, lambda m: m.src == 26),
        ({"src": 16384}, lambda m: m.src == 16384),
    ]:
        expected = list(filter(holds, log))
        assert list(log.messages(**conditions)) == expected
        chosen = [m for m in expected if isinstance(m, imc.EntityState)]
        assert list(log.messages("EntityState", **conditions)) == chosen
        assert list(log.objects("EntityState", **conditions)) == chosen
        assert_rows_are(log.array("EntityState", **conditions), chosen)
        assert list(log.time_ordered(**conditions)) == sorted(expected, key=lambda m: m.timestamp)
    for conditions in ({"entity": "No Such Label"}, {"src": "no-such-system"}):
        with pytest.raises(KeyError, match=re.escape(next(iter(conditions.values())))):
            log.array("EntityState", **conditions)


def test_unknown_and_absent_types() -> None:
    log = Log(LOGS / "dune-idle")
    assert log["PlanSpecification"].shape == (0,)
    assert log["PlanSpecification"].dtype.names == (*HEADER,)
    assert list(log.objects("PlanSpecification")) == []
    for ask in (log.array, log.objects, log.messages, log.arrays, log.to_pandas):
        with pytest.raises(KeyError, match="NoSuchMessage"):
            ask("NoSuchMessage")


def test_order_of_time_is_stable_and_puts_what_has_none_last(tmp_path: Path) -> None:
    times = [3.0, 1.0, math.nan, 2.0, 1.0, -1.0, math.inf, 2.0]
    made = [imc.Rpm(timestamp=time, value=number) for number, time in enumerate(times)]
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, made)))
    log = Log(tmp_path)
    assert [message.value for message in log.time_ordered()] == [5, 1, 4, 3, 7, 0, 6, 2]
    assert [message.value for message in log.time_ordered("Rpm", start=1.0, end=3.0)] == [1, 4, 3, 7]


def test_labels_come_from_lists_too(tmp_path: Path) -> None:
    made = [
        imc.EntityInfo(src=5, src_ent=1, label="AHRS"),
        imc.EntityInfo(src=5, src_ent=255, label="sent before it had an id"),
        imc.EntityList(src=6, op=imc.EntityList.Op.REPORT, list="GPS=2;CPU = 1 =4;bad;x=;y=999;z=²;"),
        imc.EntityList(src=6, op=imc.EntityList.Op.QUERY, list="No=9"),
    ]
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, made)))
    assert Log(tmp_path).entities == {(5, 1): "AHRS", (6, 2): "GPS", (6, 4): "CPU = 1 "}


def test_positions_are_those_of_the_objects() -> None:
    log = Log(LOGS / "dune-mission-cut")
    found = log.positions()
    expected = [imc.coordinates.absolute_position(message) for message in log.messages(imc.EstimatedState)]
    for number, name in enumerate(("lat", "lon", "height")):
        np.testing.assert_allclose(found[name], [position[number] for position in expected], rtol=0, atol=1e-8)
    fixes = log.positions("GpsFix")
    np.testing.assert_array_equal(fixes["lat"], log["GpsFix"]["lat"])
    with pytest.raises(ValueError, match="lat"):
        log.positions("Rpm")


def test_pandas_has_all_fields() -> None:
    log = Log(LOGS / "dune-idle")
    frame = log.to_pandas("EntityState")
    assert list(frame.columns) == [*HEADER, "state", "flags", "description"]
    assert frame["description"].tolist() == [message.description for message in log.messages("EntityState")]
    assert frame.index[0] == pandas.Timestamp(log["EntityState"]["timestamp"][0], unit="s", tz="UTC")
    assert len(log.to_pandas("EntityState", entity=7)) == len(log.array("EntityState", entity=7))


def test_without_pandas_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError, match=r"needs pandas: pip install pandas, or 'shoal\[analysis\]'"):
        Log(LOGS / "dune-idle").to_pandas("EntityState")


def test_importing_imc_does_not_import_numpy() -> None:
    code = "import sys, imc; print({'numpy', 'pandas'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "set()\n"
