"""Finding the logs of one run."""

import struct
from pathlib import Path

import pytest
from fastcrc.crc16 import arc

import imc
from runtime.logs import RUN_FILE, encode_log_run_position
from shoal.rerun.run_log_sequence import find_run_of_log

BEGIN, CUT = 1767225600.0, 1767225610.0
STOPPED = imc.encode(imc.LoggingControl(timestamp=CUT, src=26, op=imc.LoggingControl.Op.STOPPED))


def malformed(packet: bytes) -> bytes:
    """The packet with only one byte of payload, and the matching CRC."""
    short = packet[:4] + struct.pack("<H", 1) + packet[6:21]
    return short + struct.pack("<H", arc(short))


def put(folder: Path, number: int, *packets: bytes) -> Path:
    folder.mkdir(parents=True)
    (folder / RUN_FILE).write_bytes(encode_log_run_position("20260101/000000", number))
    (folder / "Data.lsf").write_bytes(b"".join(packets))
    return folder


@pytest.mark.parametrize(("last", "count"), [(STOPPED, 2), (malformed(STOPPED), 1)])
def test_a_run_goes_on_in_the_log_that_begins_where_one_ended_in_order(tmp_path: Path, last: bytes, count: int) -> None:
    day = tmp_path / "20260101"
    put(day / "000000", 1, imc.encode(imc.Heartbeat(timestamp=BEGIN, src=26)), last)
    second = put(day / "000010", 2, imc.encode(imc.Heartbeat(timestamp=CUT, src=26)))
    assert len(find_run_of_log(imc.Log(second)).logs) == count
