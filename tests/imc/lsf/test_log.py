"""Logs on disk: real, damaged and written here."""

import bz2
import gzip
import zlib
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import imcpy
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc
from imc.lsf import Log, LsfWriter
from imc.lsf.gzip_members import PACKED_CHUNK
from tests.outside import largest_file

DEFINITIONS = Path(imc.__file__).parent / "definitions"
LOGS = Path(__file__).parents[2] / "data" / "logs"

# What imcpy 1.1.2 finds in the unpacked log.
IDLE = """
Acceleration=502 AlignmentState=4 AngularVelocity=502 Announce=4 CpuUsage=228 Distance=48 EntityActivationState=36
EntityInfo=234 EntityList=2 EntityMonitoringState=11 EntityParameters=4 EntityState=289 EstimatedState=100
EstimatedStreamVelocity=6 EulerAngles=502 GpsFix=9 GpsFixRejection=4 GroundVelocity=25 Heartbeat=5 LogBookEntry=103
LoggingControl=4 NavigationData=100 NavigationUncertainty=100 PlanControl=2 PlanControlState=20 PlanDB=5
QueryEntityInfo=90 RemoteActionsRequest=2 Rpm=101 ServoPosition=2012 SetThrusterActuation=2 SimulatedState=503
SoundSpeed=10 Temperature=5 TransportBindings=1034 VehicleState=12 VersionInfo=2 WaterVelocity=25
"""

FAST = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
garbage = st.one_of(
    st.binary(min_size=1, max_size=60),
    st.just(b"\x54\xfe"),
    st.just(b"\xfe\x54\x01\x00"),
    st.just(b"\x54\xfe\x01\x00\xff\xff"),
    st.just(b"\x54\xfe\x96\x00\x30\x00"),
)


def make_packets(count: int) -> list[bytes]:
    """Packets of different sizes and ids, in both byte orders."""
    made: list[bytes] = []
    for number in range(count):
        message = (
            imc.Heartbeat(timestamp=1e9 + number),
            imc.EntityState(timestamp=1e9 + number, description=f"{number} " * (number % 40)),
            imc.Unknown(timestamp=1e9 + number, id=9999, payload=bytes(range(number % 250))),
        )[number % 3]
        made.append(imc.encode(message, "big" if number % 5 == 4 and number % 3 != 2 else "little"))
    return made


def packets_of(path: Path) -> list[bytes]:
    return [packet for _, packet in Log(path).packets()]


def counts_by_imcpy(data: bytes) -> Counter[str]:
    found: Counter[str] = Counter()
    while data:
        size = int.from_bytes(data[4:6], "little") + 22
        found[type(imcpy.Packet.deserialize(data[:size])).__name__] += 1
        data = data[size:]
    return found


def test_log_of_dune_has_what_imcpy_finds() -> None:
    log = Log(LOGS / "dune-idle")
    expected = {name: int(number) for name, number in (entry.split("=") for entry in IDLE.split())}
    assert log.counts() == dict(sorted(expected.items(), key=lambda item: log.schema.types[item[0]].id))
    assert len(log) == 6647
    assert log.losses == []
    assert log.schema_source is None
    assert log.schema == imc.builtin()


def test_log_of_a_mission_decodes_and_encodes_to_the_same_bytes() -> None:
    log = Log(LOGS / "dune-mission-cut" / "Data.lsf.gz")
    unpacked = gzip.decompress(log.path.read_bytes())
    assert Counter(log.counts()) == counts_by_imcpy(unpacked)
    assert b"".join(imc.encode(message) for message in log) == unpacked
    assert log.losses == []


def test_classes_are_shared_with_logs_of_another_schema(tmp_path: Path) -> None:
    public = imc.load(DEFINITIONS / "imc-5.4.31.yaml")
    (tmp_path / "IMC.xml").write_bytes(imc.dump(public))
    get = public["GpioStateGet"](timestamp=1.0, name="led")
    (tmp_path / "Data.lsf").write_bytes(imc.encode(imc.Rpm(timestamp=1.0, value=7)) + public.encode(get))
    log = Log(tmp_path)
    rpm, found = log
    assert log.schema == public
    assert log.schema_source == tmp_path / "IMC.xml"
    assert rpm == imc.Rpm(timestamp=1.0, value=7)
    assert (type(found).__name__, found.ID, found.name) == ("GpioStateGet", imc.EstimatedMugState.ID, "led")
    assert Log(tmp_path, schema=imc.builtin()).counts() == {"Rpm": 1, "EstimatedMugState": 1}


def test_offsets_are_those_of_the_unpacked_file() -> None:
    log = Log(LOGS / "dune-mission-cut")
    unpacked = gzip.decompress(log.path.read_bytes())
    assert all(unpacked[offset : offset + len(packet)] == packet for offset, packet in log.packets())


def test_messages_of_some_types() -> None:
    log = Log(LOGS / "dune-idle")
    kinds = Counter(type(message) for message in log.messages(imc.GpsFix, "Rpm"))
    assert kinds == {imc.GpsFix: 9, imc.Rpm: 101}
    with pytest.raises(KeyError):
        next(log.messages("NoSuchMessage"))


@pytest.mark.parametrize(
    ("name", "pack"),
    [
        ("Data.lsf", bytes),
        ("Data.lsf.gz", gzip.compress),
        ("Data.lsf.bz2", bz2.compress),
        ("Data.lsf.z", zlib.compress),
    ],
)
def test_every_compression(tmp_path: Path, name: str, pack: Callable[[bytes], bytes]) -> None:
    packets = make_packets(500)
    halves = b"".join(packets[:200]), b"".join(packets[200:])
    (tmp_path / name).write_bytes(b"".join(map(pack, halves)))
    log = Log(tmp_path)
    assert [packet for _, packet in log.packets()] == packets
    assert log.losses == []


def test_no_log(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "missing"):
        with pytest.raises(FileNotFoundError, match="no"):
            Log(path)


def test_empty_log(tmp_path: Path) -> None:
    for name in ("Data.lsf", "Data.lsf.gz"):
        (tmp_path / name).write_bytes(b"")
        log = Log(tmp_path / name)
        assert len(log) == 0
        assert log.losses == []


def test_packet_that_is_too_short_for_its_type_is_a_loss_of_messages_only(tmp_path: Path) -> None:
    short = imc.encode(imc.Unknown(timestamp=1.0, id=imc.EstimatedState.ID, payload=b"abc"))
    good = imc.encode(imc.Heartbeat(timestamp=2.0))
    (tmp_path / "Data.lsf").write_bytes(good + short + good)
    log = Log(tmp_path)
    assert len(log) == 3
    assert [type(message) for message in log] == [imc.Heartbeat, imc.Heartbeat]
    assert [(loss.offset, loss.length) for loss in log.losses] == [(len(good), len(short))]
    assert "EstimatedState" in log.losses[0].reason


@FAST
@given(st.lists(st.tuples(st.integers(0, 30), garbage), max_size=12), st.integers(0, 40))
def test_all_good_packets_around_damage_are_found(tmp_path: Path, damage: list[tuple[int, bytes]], cut: int) -> None:
    packets = make_packets(30)
    parts = list(packets)
    for place, piece in sorted(damage, key=lambda item: -item[0]):
        parts.insert(place, piece)
    tail = make_packets(40)[cut % 40][: cut % 22]
    path = tmp_path / "Data.lsf"
    path.write_bytes(b"".join(parts) + tail)
    log = Log(path)
    found = list(log.packets())
    assert [packet for _, packet in found] == packets
    spans = sorted([(offset, len(packet)) for offset, packet in found] + [loss[:2] for loss in log.losses])
    assert sum(length for _, length in spans) == path.stat().st_size
    assert all(a + length == b for (a, length), (b, _) in pairwise(spans))


@FAST
@given(st.lists(st.integers(0, 60), max_size=8), st.floats(0.0, 1.0))
def test_members_anywhere_and_the_last_one_cut(tmp_path: Path, cuts: list[int], kept: float) -> None:
    packets = make_packets(60)
    borders = [0, *sorted(cuts), 60]
    members = [gzip.compress(b"".join(packets[a:b])) for a, b in pairwise(borders)]
    path = tmp_path / "Data.lsf.gz"
    path.write_bytes(b"".join(members))
    assert packets_of(path) == packets

    last = members[-1][: int(len(members[-1]) * kept)]
    path.write_bytes(b"".join(members[:-1]) + last)
    found = packets_of(path)
    assert found == packets[: len(found)]
    assert len(found) >= borders[-2]
    log = Log(path)
    assert len(log) == len(found)
    assert bool(log.losses) is (0 < len(last) < len(members[-1]))


@FAST
@given(st.integers(0, 9), st.integers(0, 10**6), st.binary(max_size=30))
def test_damaged_member_costs_nothing_of_the_others(tmp_path: Path, which: int, place: int, piece: bytes) -> None:
    packets = make_packets(200)
    members = [gzip.compress(b"".join(packets[a : a + 20])) for a in range(0, 200, 20)]
    member = members[which]
    place %= len(member)
    members[which] = member[:place] + piece + (member[place + len(piece) :] if piece else b"")
    path = tmp_path / "Data.lsf.gz"
    path.write_bytes(b"".join(members))
    found = packets_of(path)
    others = packets[: 20 * which] + packets[20 * which + 20 :]
    assert [packet for packet in found if packet in set(others)] == others


@pytest.mark.heavy
def test_a_member_that_is_cut_off_does_not_unpack_on_through_the_next_one(tmp_path: Path) -> None:
    """In zlib's coding of these packets, and with these times of packing, it does after 160 of the cuts."""
    packets = make_packets(200)
    path = tmp_path / "Data.lsf.gz"
    for first, time in (120, 0x5C8707EF), (160, 228800133), (20, 2621528185):
        one, two = (gzip.compress(b"".join(packets[a : a + 20]), mtime=time) for a in (first, first + 20))
        for place in range(20, len(one)):
            path.write_bytes(one[:place] + two)
            assert packets_of(path)[-20:] == packets[first + 20 : first + 40], (first, place)
            found = packets_of(path)
            assert found[:-20] == packets[first : first + len(found) - 20], (first, place)


def test_members_inside_a_good_member_are_a_part_of_it(tmp_path: Path) -> None:
    packets = [imc.encode(imc.Unknown(id=9999, payload=gzip.compress(bytes([k]) * 5000))) for k in range(50)]
    stored = gzip.compress(b"".join(packets), 0)
    assert stored.count(b"\x1f\x8b\x08") == 51
    path = tmp_path / "Data.lsf.gz"
    path.write_bytes(stored * 2)
    assert packets_of(path) == packets * 2
    assert not Log(path).losses


@pytest.mark.parametrize(("suffix", "pack"), [("gz", gzip.compress), ("bz2", bz2.compress), ("z", zlib.compress)])
def test_what_precedes_damage_in_one_long_member_is_kept(
    tmp_path: Path, suffix: str, pack: Callable[[bytes], bytes]
) -> None:
    packets = make_packets(20000)
    packed = bytearray(pack(b"".join(packets)))
    assert len(packed) > 2 * PACKED_CHUNK
    place = len(packed) * 3 // 4
    packed[place : place + 200] = bytes(200)
    path = tmp_path / f"Data.lsf.{suffix}"
    path.write_bytes(packed)
    log = Log(path)
    found = [packet for _, packet in log.packets()]
    whole = 8000 if suffix == "bz2" else 14000
    assert found[:whole] == packets[:whole]
    assert "Data.lsf" in " ".join(loss.reason for loss in log.losses)


@pytest.mark.parametrize("compression", ["none", "gzip", "bzip2", "zlib"])
def test_writer_makes_members_of_whole_packets(tmp_path: Path, compression: str) -> None:
    packets = make_packets(300)
    suffix = {"none": "", "gzip": ".gz", "bzip2": ".bz2", "zlib": ".z"}[compression]
    sizes: list[int] = []
    for name in ("one", "two"):
        path = tmp_path / f"{name}.lsf{suffix}"
        writer = LsfWriter(path, compression, block=4096)
        for packet in packets:
            writer.write(packet)
            if writer.size not in sizes:
                sizes.append(writer.size)
        writer.close()
        assert packets_of(path) == packets
    whole = path.read_bytes()
    assert whole == (tmp_path / f"one.lsf{suffix}").read_bytes()
    assert len(sizes) > 5
    for size in sizes:
        path.write_bytes(whole[:size])
        log = Log(path)
        assert [packet for _, packet in log.packets()] == packets[: len(log)]
        assert log.losses == []
    with pytest.raises(FileExistsError):
        LsfWriter(path, compression)


def test_gzip_header_says_nothing_of_time_and_computer(tmp_path: Path) -> None:
    writer = LsfWriter(tmp_path / "Data.lsf.gz")
    writer.write(imc.encode(imc.Heartbeat(timestamp=1.0)))
    writer.close()
    assert (tmp_path / "Data.lsf.gz").read_bytes()[:10] == bytes.fromhex("1f8b08000000000000ff")


def test_full_disk_leaves_whole_members_and_keeps_the_rest(tmp_path: Path) -> None:
    packets = make_packets(2000)
    path = tmp_path / "Data.lsf.gz"
    writer = LsfWriter(path, block=4096)
    refused = 0
    with largest_file(10_000):
        for packet in packets[:1500]:
            try:
                writer.write(packet)
            except OSError:
                refused += 1
                assert path.stat().st_size == writer.size
        assert refused
        assert writer.waiting > 0
        kept = packets_of(path)
        assert 0 < len(kept) < 1500
        assert kept == packets[: len(kept)]
    for packet in packets[1500:]:
        writer.write(packet)
    writer.close()
    assert writer.waiting == 0
    log = Log(path)
    assert [packet for _, packet in log.packets()] == packets
    assert log.losses == []


def test_writer_notices_that_its_file_has_gone(tmp_path: Path) -> None:
    writer = LsfWriter(tmp_path / "Data.lsf", "none")
    assert writer.is_file_in_place()
    writer.path.unlink()
    assert not writer.is_file_in_place()
    writer.path.write_bytes(b"another")
    assert not writer.is_file_in_place()
    writer.close()


def test_an_unknown_message_is_named_with_the_nearest(tmp_path):
    (tmp_path / "Data.lsf").write_bytes(imc.encode(imc.EstimatedState(timestamp=1.0)))
    log = imc.Log(tmp_path / "Data.lsf")
    for read in (log.array, log.objects, log.to_pandas, lambda kind: list(log.messages(kind))):
        with pytest.raises(KeyError, match=r"no message 'EstimatedSate' .did you mean 'EstimatedState'"):
            read("EstimatedSate")
