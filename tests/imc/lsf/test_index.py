"""Indices of logs: equal to the log, up to date, safe to read; and Neptus' indices."""

import hashlib
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from fastcrc import crc32
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc
from imc.lsf import Log, index_file, read_neptus_index, write_neptus_index
from imc.lsf import byte_reader as log_bytes
from tests.imc.lsf.indexed import all_of, messages, write_log

LOGS = Path(__file__).parents[2] / "data" / "logs"
pytestmark = pytest.mark.usefixtures("every_index_is_kept")
FAST = settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])


def kept(folder: Path) -> list[Path]:
    """The indices in the cache."""
    return sorted((folder / "cache").glob("shoal/logs/*.index"))


def reads(patch: pytest.MonkeyPatch) -> list[Path]:
    """The paths of all logs that were read completely."""
    found: list[Path] = []
    chunks = log_bytes.unpacked_chunks

    def noted(path: Path, *rest: Any) -> Iterator[bytes]:
        found.append(path)
        return chunks(path, *rest)

    patch.setattr(index_file, "unpacked_chunks", noted)
    return found


@pytest.mark.parametrize("crc", [True, False])
def test_index_is_written_and_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, crc: bool) -> None:
    path = write_log(tmp_path / "Data.lsf")
    seen = reads(monkeypatch)
    without = all_of(Log(path, crc=crc, keep_index=False))
    assert [file.name for file in tmp_path.iterdir()] == ["Data.lsf"]
    first = all_of(Log(path, crc=crc))
    assert sorted(file.name for file in tmp_path.iterdir()) == ["Data.lsf", "cache"]
    assert len(kept(tmp_path)) == 1
    assert seen == [path, path]
    second = all_of(Log(tmp_path, crc=crc))
    assert len(seen) == 2
    assert first == second == without
    assert all_of(Log(path, crc=not crc)) != first


@pytest.mark.parametrize("together", [1, 7, 100, 1 << 16])
def test_packets_sorted_in_parts_are_where_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, together: int
) -> None:
    monkeypatch.setattr("imc.lsf.scanner.PIECE", 256)
    monkeypatch.setattr("imc.lsf.index.TOGETHER", together)
    log = Log(write_log(tmp_path / "Data.lsf"))
    whole = [(packet, offset) for offset, packet in log.packets()]
    places = log.index().packet_positions()
    assert places.offsets.tolist() == [offset for _, offset in whole]
    assert places.big.tolist() == [packet[0] == 0xFE for packet, _ in whole]
    assert [int(end - begin) for begin, end in zip(places.offsets, places.ends, strict=True)] == [
        len(packet) for packet, _ in whole
    ]


def test_checked_index_of_undamaged_log_serves_both(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, messages(60))))
    seen = reads(monkeypatch)
    assert Log(tmp_path).counts() == Log(tmp_path, crc=False).counts()
    assert len(seen) == 1


def test_index_is_small(tmp_path: Path) -> None:
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, messages(6000))))
    assert len(Log(tmp_path)) == 6000
    assert kept(tmp_path)[0].stat().st_size < 3.5 * 6000


@pytest.mark.parametrize("change", ["append", "begin", "end", "touch", "shorten"])
def test_stale_index_is_rebuilt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str) -> None:
    path = write_log(tmp_path / "Data.lsf")
    log = Log(path)
    count, state, seen = len(log), path.stat(), reads(monkeypatch)
    data = bytearray(path.read_bytes())
    if change == "append":
        data += imc.encode(imc.Rpm())
    elif change == "shorten":
        del data[-100:]
    elif change != "touch":
        data[30 if change == "begin" else -30] ^= 1
    path.write_bytes(data)
    later = state.st_mtime_ns + (10**9 if change in ("touch", "append", "shorten") else 0)
    os.utime(path, ns=(later, later))
    expected = len(list(Log(path, keep_index=False).packets()))
    assert len(Log(path)) == expected
    assert len(seen) == 1
    assert (expected == count) is (change == "touch")
    if change in ("append", "shorten", "touch"):
        assert len(log) == expected
        fresh = Log(path, keep_index=False)
        fresh.index()
        assert log.losses == fresh.losses


def test_index_beside_the_log_if_wanted_else_in_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, seen = write_log(tmp_path / "Data.lsf"), reads(monkeypatch)
    assert all_of(Log(path, keep_index="beside")) == all_of(Log(path, keep_index="beside"))
    assert (len(seen), kept(tmp_path)) == (1, [])
    (tmp_path / "Data.lsf.index").unlink()
    (tmp_path / "Data.lsf.index").mkdir()
    assert all_of(Log(path, keep_index="beside")) == all_of(Log(path, keep_index="beside"))
    assert (len(seen), len(kept(tmp_path))) == (2, 1)


@pytest.mark.parametrize("obstacle", ["a file", "a link to nowhere", "no home", "a relative folder"])
def test_cache_that_cannot_be_written_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, obstacle: str
) -> None:
    path, seen = write_log(tmp_path / "Data.lsf"), reads(monkeypatch)
    monkeypatch.chdir(tmp_path)
    if obstacle == "a file":
        (tmp_path / "cache").write_bytes(b"in the way")
    elif obstacle == "a link to nowhere":
        (tmp_path / "cache").symlink_to("/proc/nothing/here")
    else:
        monkeypatch.setenv("XDG_CACHE_HOME", "" if obstacle == "no home" else "cache")
        monkeypatch.setattr(Path, "home", raise_no_home)
    assert len(Log(path)) == len(Log(path)) == 599
    assert len(seen) == 2
    assert not (tmp_path / "cache" / "shoal").exists()


def raise_no_home() -> Path:
    raise RuntimeError("Could not determine home directory.")


def test_cache_has_a_largest_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size = 0
    for number in range(5):
        Log(write_log(tmp_path / f"{number}.lsf")).index()
        size = size or kept(tmp_path)[0].stat().st_size
        monkeypatch.setattr(index_file, "CACHE", 3 * size)
        for age, file in enumerate(sorted(kept(tmp_path), key=lambda file: -file.stat().st_mtime_ns)):
            os.utime(file, ns=(10**18 - age, 10**18 - age))
    assert len(kept(tmp_path)) == 3
    assert sum(file.stat().st_size for file in kept(tmp_path)) <= 3 * size


@pytest.mark.heavy
@FAST
@given(st.floats(0.0, 1.0), st.binary(max_size=40), st.integers(0, 40))
def test_damaged_index_is_replaced(tmp_path: Path, where: float, piece: bytes, cut: int) -> None:
    path = write_log(tmp_path / "Data.lsf", 60)
    expected = all_of(Log(path))
    (index,) = kept(tmp_path)
    data = bytearray(index.read_bytes())
    place = int(where * len(data))
    data[place : place + cut] = piece
    index.write_bytes(data)
    assert all_of(Log(path)) == expected


@pytest.mark.heavy
@FAST
@given(st.data())
def test_index_that_lies_does_no_harm(tmp_path: Path, data: st.DataObject) -> None:
    """The index has correct checksums, but wrong numbers inside: they are found out, or do not matter."""
    path = write_log(tmp_path / "Data.lsf", 60)
    expected, messages_expected = all_of(Log(path)), list(Log(path, keep_index=False).messages("Rpm", "EntityState"))
    (index,) = kept(tmp_path)
    head, arrays = opened(index)
    number = st.one_of(st.integers(-(2**63), 2**64 - 1), st.integers(0, 99))
    signed = data.draw(st.booleans())  # signed: by chance, or by a friend; then ids and counts are true
    if not signed:
        for entry in head["types"]:
            name = data.draw(st.sampled_from(sorted(entry)))
            entry[name] = data.draw(st.one_of(st.just(entry[name]), number))
        head["length"] = data.draw(st.one_of(st.just(head["length"]), number))
    head["members"] = data.draw(st.lists(st.tuples(number, number), max_size=3))
    for _ in range(data.draw(st.integers(0, 5))):
        arrays[data.draw(st.integers(0, len(arrays) - 1))] = data.draw(st.integers(0, 255))
    forge(index, head, arrays, signed)
    assert list(Log(path).messages("Rpm", "EntityState")) == messages_expected
    forge(index, head, arrays, signed)
    assert all_of(Log(path)) == expected
    forge(index, head, arrays, signed)
    assert len(list(Log(path).time_ordered())) == 59


def opened(index: Path) -> tuple[dict[str, Any], bytearray]:
    """Head and arrays of an index."""
    body = bytearray(index.read_bytes()[len(index_file.MAGIC) + index_file.SIGNATURE_SIZE :])
    length = int.from_bytes(body[:4], "little")
    return msgspec.msgpack.decode(bytes(body[4 : 4 + length])), body[4 + length :]


def forge(index: Path, head: dict[str, Any], arrays: bytes, signed: bool) -> None:
    """Write an index with correct checksums, signed by the user or by somebody else."""
    packed = msgspec.msgpack.encode(head | {"arrays": crc32.iso_hdlc(arrays)})
    key = (index.parent / "key").read_bytes() if signed else bytes(32)
    signature = hashlib.blake2b(packed, digest_size=16, key=key).digest()
    index.write_bytes(index_file.MAGIC + signature + len(packed).to_bytes(4, "little") + packed + arrays)


def test_progress_reaches_the_end(tmp_path: Path) -> None:
    for path in (write_log(tmp_path / "Data.lsf", 20000), LOGS / "dune-idle"):
        shares: list[float] = []
        Log(path, keep_index=False).index(shares.append)
        assert shares == sorted(shares)
        assert shares[-1] == 1.0


def test_index_of_neptus(tmp_path: Path) -> None:
    times = [1e9, 1e9 + 1.9999, 1e9 - 2.5, 1e20, -1e20, 1e9 + 0.25]
    packets = [imc.encode(imc.Rpm(timestamp=time)) for time in times]
    packets.insert(3, imc.encode(imc.Unknown(id=9999, timestamp=1e9, payload=b"?")))
    (tmp_path / "Data.lsf").write_bytes(b"".join(packets))
    path = write_neptus_index(Log(tmp_path))
    assert path == tmp_path / "mra" / "lsf.index"
    entries = [
        (0, imc.Rpm.ID, 0),
        (1999, imc.Rpm.ID, 24),
        (-2500, imc.Rpm.ID, 48),
        (0, 9999, 72),
        (2**31 - 1, imc.Rpm.ID, 95),
        (-(2**31), imc.Rpm.ID, 119),
    ]
    entries.append((250, imc.Rpm.ID, 143))
    assert path.read_bytes() == b"IDX1" + struct.pack(">d", 1e9) + b"".join(struct.pack(">iHq", *e) for e in entries)
    origin, found = read_neptus_index(path)
    assert origin == 1e9
    assert found.tolist() == entries


def test_index_of_neptus_of_a_real_log(tmp_path: Path) -> None:
    log = Log(LOGS / "dune-idle")
    path = write_neptus_index(log, tmp_path / "lsf.index")
    assert path.stat().st_size == 12 + 14 * 6647
    _, found = read_neptus_index(path)
    assert list(zip(found["offset"].tolist(), found["id"].tolist(), strict=True)) == [
        (offset, imc.packet_id(packet)) for offset, packet in log.packets()
    ]
    assert np.bincount(found["id"])[imc.Rpm.ID] == 101
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(ValueError, match="Neptus"):
        read_neptus_index(path)
    (tmp_path / "Empty.lsf").write_bytes(b"")
    assert read_neptus_index(write_neptus_index(Log(tmp_path / "Empty.lsf"), path))[1].size == 0
