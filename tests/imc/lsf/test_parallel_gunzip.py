"""Gzip members unpacked ahead give the same as one by one, for any file."""

import gzip
import random
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import imc
from imc.lsf import COMPRESSIONS, ParallelMap, compress_member, parallel_gunzip, unpacked_chunks
from imc.lsf import byte_reader as log_bytes
from imc.lsf.byte_reader import open_reader
from imc.lsf.gzip_members import MemberData, unpack_members
from imc.lsf.parallel_gunzip import unpack_ahead

FAST = settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
GZIP = COMPRESSIONS["gzip"]


@pytest.fixture(autouse=True)
def short_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel_gunzip, "STRETCH", 300)
    monkeypatch.setattr(parallel_gunzip, "LONGEST", 3000)
    monkeypatch.setattr(parallel_gunzip, "LARGEST", 20_000)
    monkeypatch.setattr(log_bytes, "MEMBER_STEP", 500)
    monkeypatch.setattr(log_bytes, "MEMORY", 2000)


@pytest.fixture(scope="module")
def threads() -> Iterator[ParallelMap]:
    with ThreadPoolExecutor(2) as executor:
        yield executor.map


def member(random: random.Random) -> bytes:
    kind = random.randrange(12)
    if kind == 0:
        return compress_member(b"")
    if kind == 1:
        return compress_member(bytes(random.randrange(60_000)))
    if kind == 2:
        return compress_member(compress_member(b"inside") * random.randrange(40), 0)
    data = random.randbytes(random.randrange(4000 if kind == 3 else 400))
    return gzip.compress(data, random.choice((1, 6, 9))) if kind == 4 else compress_member(data)


def damaged(data: bytes, random: random.Random, count: int) -> bytes:
    found = bytearray(data)
    for _ in range(count):
        place = random.randrange(len(found) + 1)
        change = random.randrange(4)
        if change == 0:
            found[place : place + 1] = random.randbytes(1)
        elif change == 1:
            found[place:place] = random.randbytes(random.randrange(500))
        elif change == 2:
            del found[place : place + random.randrange(500)]
        else:
            del found[max(place, len(found) - 300) :]
    return bytes(found)


def make_file(seed: int, members: int, damage: int) -> tuple[random.Random, bytes]:
    chance = random.Random(seed)
    return chance, damaged(b"".join(member(chance) for _ in range(members)), chance, damage)


files = given(st.integers(0, 1 << 32), st.integers(0, 40), st.integers(0, 3))


@pytest.mark.heavy
@FAST
@files
def test_pieces_are_the_same(threads: ParallelMap, seed: int, members: int, damage: int) -> None:
    _, data = make_file(seed, members, damage)
    in_order = list(unpack_members(BytesIO(data), GZIP))
    assert list(unpack_ahead(BytesIO(data), GZIP, 0, threads)) == in_order
    assert list(unpack_ahead(BytesIO(data), GZIP, 0, map)) == in_order


@pytest.mark.heavy
@FAST
@files
@example(seed=867, members=18, damage=3)
@example(seed=1669346, members=6, damage=2)
def test_bytes_damage_members_and_parts_are_the_same(
    tmp_path: Path, threads: ParallelMap, seed: int, members: int, damage: int
) -> None:
    chance, data = make_file(seed, members, damage)
    path = tmp_path / "Data.lsf.gz"
    path.write_bytes(data)
    found: list[tuple[object, ...]] = []
    table: log_bytes.Members = []
    for spread in (None, threads):
        table, losses = [], list[tuple[int, int, str]]()
        whole = b"".join(unpacked_chunks(path, lambda *loss, to=losses: to.append(loss), table, None, spread))
        found.append((whole, losses, table))
    assert found[0] == found[1]
    again = list[tuple[int, int, str]]()

    def lose(*loss: int | str) -> None:
        again.append(loss)

    with open_reader(path, table, lose) as reader, open_reader(path, table, lose, threads) as other:
        for _ in range(5):
            begin = chance.randrange(len(whole) + 1)
            end = begin + chance.randrange(3000)
            assert other.read_range(begin, end) == reader.read_range(begin, end) == whole[begin:end]
    assert set(again) <= set(found[0][1])


def test_whole_members_go_through_spread_a_few_at_a_time() -> None:
    data = b"".join(compress_member(random.Random(n).randbytes(100)) for n in range(300))
    running, most, total = 0, 0, 0

    def spread(function: Any, parts: Any) -> Iterator[Any]:
        nonlocal running, most, total
        running, total = running + 1, total + len(parts[0])
        most = max(most, running)

        def results() -> Iterator[list[MemberData] | None]:
            nonlocal running
            running -= 1
            yield function(parts[0])

        return results()

    assert list(unpack_ahead(BytesIO(data), GZIP, 0, spread)) == list(unpack_members(BytesIO(data), GZIP))
    assert most == parallel_gunzip.AHEAD
    assert total > len(data) - 1000


def test_log_is_the_same(tmp_path: Path, threads: ParallelMap) -> None:
    path = tmp_path / "Data.lsf.gz"
    packets = [imc.encode(imc.Rpm(timestamp=1e9 + n, value=n)) for n in range(2000)]
    whole = b"".join(compress_member(b"".join(packets[n : n + 10])) for n in range(0, 2000, 10))
    path.write_bytes(whole[:9000] + b"?" + whole[9001:-3])
    one, other = imc.Log(path), imc.Log(path, spread=threads)
    assert other.counts() == one.counts()
    assert other["Rpm"].tobytes() == one["Rpm"].tobytes()
    assert list(other) == list(one)
    assert other.losses == one.losses
    assert other.index().members == one.index().members
    assert one.losses
