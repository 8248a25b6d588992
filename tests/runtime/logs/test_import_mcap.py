"""MCAP files of ours made logs again, and files that are none."""

import io
from pathlib import Path

import pytest
from mcap.writer import Writer

import imc
from runtime.logs.mcap import export_mcap
from runtime.logs.mcap_import import BadFile, import_mcap
from runtime.logs.source import Source
from runtime.logs.summary import summarize

LOGS = Path(__file__).parents[2] / "data" / "logs"


def packets_of(log):
    return [packet for _, packet in log.packets()]


@pytest.fixture
def idle(tmp_path):
    """A log of DUNE and it as MCAP, in several chunks."""
    log = imc.Log(LOGS / "dune-idle")
    export_mcap(Source(log, summarize(log)), tmp_path / "idle.mcap")
    return log, tmp_path / "idle.mcap"


def test_a_log_comes_back_byte_for_byte(idle, tmp_path):
    log, path = idle
    assert import_mcap(path, tmp_path) == ""
    again = imc.Log(tmp_path)
    assert packets_of(again) == packets_of(log)
    assert (tmp_path / "IMC.xml.gz").exists()


def test_an_mcap_cut_short_gives_the_packets_before_the_cut(idle, tmp_path):
    log, path = idle
    data = path.read_bytes()
    for name, size in (("end", len(data) - 5000), ("begin", 30_000)):
        (tmp_path / f"{name}.mcap").write_bytes(data[:size])
    (tmp_path / "a").mkdir()
    assert "damaged" in import_mcap(tmp_path / "end.mcap", tmp_path / "a")
    assert packets_of(imc.Log(tmp_path / "a")) == packets_of(log)
    with pytest.raises(BadFile, match=r"begin\.mcap"):
        import_mcap(tmp_path / "begin.mcap", tmp_path)


def test_other_mcap_files_are_refused(tmp_path):
    buffer = io.BytesIO()
    writer = Writer(buffer)
    writer.start()
    channel = writer.register_channel("/imc/packet", "cdr", writer.register_schema("a/msg/B", "ros2msg", b"uint8 a"))
    writer.add_message(channel, 1, b"\0\1\0\0\1", 1)
    writer.finish()
    for name, data in (("other", buffer.getvalue()), ("garbage", b"\x89MCAP0\r\n" + bytes(100)), ("empty", b"")):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(BadFile, match=name):
            import_mcap(tmp_path / name, tmp_path)
        (tmp_path / "Data.lsf.gz").unlink()
