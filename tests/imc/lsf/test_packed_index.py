"""Indices of packed logs: equal to the log, whatever is damaged, and no member is unpacked without need."""

import bz2
import gzip
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import imc
from imc.lsf import Log, LsfWriter, gzip_members, parallel_gunzip
from imc.lsf import byte_reader as log_bytes
from tests.imc.lsf.indexed import all_of, messages, write_log

pytestmark = pytest.mark.usefixtures("every_index_is_kept")


@pytest.mark.parametrize(
    ("suffix", "pack"), [(".gz", gzip.compress), (".bz2", bz2.compress), (".z", zlib.compress), ("", bytes)]
)
@pytest.mark.parametrize("size", [5000, 70_001, 10**9])
def test_packed_logs(tmp_path: Path, suffix: str, pack: Callable[[bytes], bytes], size: int) -> None:
    plain = write_log(tmp_path / "plain.lsf", 6000)
    data = plain.read_bytes()
    path = tmp_path / f"packed.lsf{suffix}"
    path.write_bytes(b"".join(pack(data[at : at + size]) for at in range(0, len(data), size)))
    expected = all_of(Log(plain))
    assert all_of(Log(path)) == expected
    log = Log(path)
    assert all_of(log) == expected
    objects, found = log.objects("Rpm"), list(Log(plain).objects("Rpm"))
    assert [objects[n] for n in (1500, 3, 4, 1999, 0)] == [found[n] for n in (1500, 3, 4, 1999, 0)]
    assert list(log.time_ordered()) == list(log)


def test_members_that_are_not_needed_are_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "Data.lsf.gz"
    writer = LsfWriter(path, block=1 << 17)
    for number, message in enumerate(messages(30000)):
        if number in (1000, 25000):
            writer.write(imc.encode(imc.PlanControl(timestamp=float(number), info="x")))
        writer.write(imc.encode(message))
    writer.close()
    assert len(Log(path)) == 30002
    unpacked: set[int] = set()

    def noted(*arguments: Any) -> Iterator[gzip_members.MemberData]:
        for piece in parallel_gunzip.unpack_ahead(*arguments):
            unpacked.add(piece.member)
            yield piece

    monkeypatch.setattr(log_bytes, "unpack_ahead", noted)
    log = Log(path)
    assert log["PlanControl"]["timestamp"].tolist() == [1000.0, 25000.0]
    assert len(log.index().members) == 16
    assert len(unpacked) == 2
    assert [message.info for message in log.messages("PlanControl")] == ["x", "x"]
    assert len(unpacked) == 2


@pytest.mark.heavy
def test_damaged_members_are_read_again_as_the_first_time(tmp_path: Path) -> None:
    parts: list[bytes] = []
    made = messages(6000)
    for at in range(0, 6000, 500):
        member = bytearray(gzip.compress(b"".join(map(imc.encode, made[at : at + 500]))))
        if at in (1500, 4000):
            member[len(member) // 2 : len(member) // 2 + 20] = bytes(20)
        parts.append(bytes(member))
    path = tmp_path / "Data.lsf.gz"
    path.write_bytes(b"".join(parts))
    streamed = list(Log(path, keep_index=False).messages())
    for _ in "written", "loaded":
        log = Log(path)
        for name in ("Rpm", "EntityState", "EstimatedState"):
            assert list(log.objects(name)) == [m for m in streamed if type(m).__name__ == name]
        assert len(log) == len(streamed) < 6000
        assert sum("member at byte" in loss.reason for loss in log.losses) == 2
