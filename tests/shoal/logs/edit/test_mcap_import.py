"""Import of Shoal's MCAP files, and of files that are not."""

import io
import tracemalloc
from contextlib import suppress
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Header
from mcap.writer import Writer

import imc
from runtime.logs import summarize
from shoal.logs.edit.mcap_import import TOPIC, BadMcapFile, import_mcap
from shoal.logs.export import LogSource
from shoal.logs.export.mcap import export_mcap

LOGS = Path(__file__).parents[3] / "data" / "logs"


def packets_of(log):
    return [packet for _, packet in log.packets()]


@pytest.fixture
def idle(tmp_path):
    """A log of DUNE, and the same as MCAP in several chunks."""
    log = imc.Log(LOGS / "dune-idle")
    export_mcap(LogSource(log, summarize(log)), tmp_path / "idle.mcap")
    return log, tmp_path / "idle.mcap"


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The bytes of a small MCAP file."""
    path = tmp_path_factory.mktemp("small") / "small.mcap"
    log = imc.Log(LOGS / "dune-mission-cut")
    export_mcap(LogSource(log, summarize(log)), path)
    return path.read_bytes()


def test_a_log_comes_back_byte_for_byte(idle, tmp_path):
    log, path = idle
    assert import_mcap(path, tmp_path) == []
    again = imc.Log(tmp_path)
    assert packets_of(again) == packets_of(log)
    assert (tmp_path / "IMC.xml.gz").exists()


def test_an_mcap_cut_short_gives_the_packets_before_the_cut(idle, tmp_path):
    log, path = idle
    data = path.read_bytes()
    for name, size in (("end", len(data) - 5000), ("begin", 30_000)):
        (tmp_path / f"{name}.mcap").write_bytes(data[:size])
    (tmp_path / "a").mkdir()
    assert any("end.mcap: its end is damaged" in text for text in import_mcap(tmp_path / "end.mcap", tmp_path / "a"))
    assert packets_of(imc.Log(tmp_path / "a")) == packets_of(log)
    with pytest.raises(BadMcapFile, match=r"begin\.mcap"):
        import_mcap(tmp_path / "begin.mcap", tmp_path)


def test_zeros_after_a_crash_are_not_read_as_records(idle, tmp_path):
    log, path = idle
    (tmp_path / "a.mcap").write_bytes(path.read_bytes()[:-5000] + bytes(100_000))
    wrong = import_mcap(tmp_path / "a.mcap", tmp_path)
    assert any("its end is damaged: no record begins with 0" in text for text in wrong)
    assert packets_of(imc.Log(tmp_path)) == packets_of(log)


def test_other_mcap_files_are_refused(tmp_path):
    buffer = io.BytesIO()
    writer = Writer(buffer)
    writer.start()
    channel = writer.register_channel("/imc/packet", "cdr", writer.register_schema("a/msg/B", "ros2msg", b"uint8 a"))
    writer.add_message(channel, 1, b"\0\1\0\0\1", 1)
    writer.finish()
    for name, data in (("other", buffer.getvalue()), ("garbage", b"\x89MCAP0\r\n" + bytes(100)), ("empty", b"")):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(BadMcapFile, match=name):
            import_mcap(tmp_path / name, tmp_path)
        (tmp_path / "Data.lsf.gz").unlink()


def test_damaged_chunks_are_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr("shoal.logs.export.message_batches.BATCH_BYTES", 100_000)
    monkeypatch.setattr("imc.lsf.scanner.PIECE", 100_000)
    log = imc.Log(LOGS / "dune-idle")
    export_mcap(LogSource(log, summarize(log)), tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as file:
        indexes = make_reader(file).get_summary().chunk_indexes
        places = [index.chunk_start_offset for index in indexes if len(index.message_index_offsets) == 1]
    assert len(places) == 3
    data = bytearray((tmp_path / "a.mcap").read_bytes())
    data[places[1] + 1000 : places[1] + 1010] = bytes(10)
    (tmp_path / "b.mcap").write_bytes(data)
    (wrong,) = import_mcap(tmp_path / "b.mcap", tmp_path)
    assert "b.mcap: a chunk is damaged" in wrong
    before, after = packets_of(log), packets_of(imc.Log(tmp_path))
    assert set(after) < set(before)
    assert after[0] == before[0]
    assert after[-1] == before[-1]
    assert len(before) > len(after) > len(before) / 2


def file_with(path, *records):
    """An MCAP file that ends after these records."""
    builder = RecordBuilder()
    Header("", "test").write(builder)
    Channel(id=1, topic=TOPIC, message_encoding="", metadata={}, schema_id=0).write(builder)
    for record in records:
        record.write(builder)
    path.write_bytes(b"\x89MCAP0\r\n" + builder.end())


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_that_unpacks_to_more_than_it_claims_costs_no_memory(tmp_path, compression):
    zeros = bytes(256 << 20)
    data = zstandard.compress(zeros) if compression == "zstd" else lz4.frame.compress(zeros)
    del zeros
    file_with(tmp_path / "bomb.mcap", Chunk(compression, data, 0, 0, 0, 1 << 20))
    tracemalloc.start()
    try:
        with pytest.raises(BadMcapFile, match="it has more than the 1048576 bytes that it claims"):
            import_mcap(tmp_path / "bomb.mcap", tmp_path)
        assert tracemalloc.get_traced_memory()[1] < 32 << 20
    finally:
        tracemalloc.stop()


def test_a_field_that_claims_gigabytes_is_damage(tmp_path):
    path = tmp_path / "long.mcap"
    file_with(path)
    name = (3 << 30).to_bytes(4, "little")
    path.write_bytes(path.read_bytes() + b"\x03" + (6).to_bytes(8, "little") + b"\x01\x00" + name)
    with pytest.raises(BadMcapFile, match="a field of 3221225472 bytes; the limit is 268435456"):
        import_mcap(path, tmp_path)


@settings(max_examples=60)
@given(data=st.data())
def test_no_damage_stops_an_import(tmp_path_factory, small, data):
    source = small
    begin = data.draw(st.integers(0, len(source)))
    end = data.draw(st.integers(begin, min(begin + 40, len(source))))
    folder = tmp_path_factory.mktemp("import")
    (folder / "a.mcap").write_bytes(source[:begin] + data.draw(st.binary(max_size=40)) + source[end:])
    with suppress(BadMcapFile):
        import_mcap(folder / "a.mcap", folder)
