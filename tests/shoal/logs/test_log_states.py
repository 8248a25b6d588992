"""States of a log at any time: the last packet of each message and entity up to then."""

import random
from itertools import pairwise
from pathlib import Path

import pytest

import imc
from shoal.logs.log_states import LARGEST, LogStates
from tests.shoal.console.logs.logged_run import SECONDS, record_run

pytestmark = [pytest.mark.heavy, pytest.mark.computing]


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    _, dive = record_run(tmp_path_factory.mktemp("run"))
    return dive


@pytest.fixture(scope="module")
def states(log):
    found = LogStates(log)
    yield found
    found.close()


def key(packet: bytes) -> tuple[int, int, int]:
    head = imc.header(packet)
    return head.id, head.src, head.src_ent


def timed_packets(log: Path, start: float) -> list[tuple[float, bytes]]:
    """All packets in their order, at the latest time so far."""
    found, latest = [], 0.0
    for _, packet in imc.Log(log).packets():
        latest = max(latest, imc.header(packet).timestamp - start)
        found.append((latest, packet))
    return found


def test_a_state_has_the_last_packet_of_each_message_and_entity(log, states):
    packets = timed_packets(log, states.start)
    assert states.duration == pytest.approx(SECONDS - 5.05, abs=0.1)
    assert len(states._pieces) > 2, "several pieces, or the test compares nothing"
    for time in [0.0, states.duration, *(random.Random(1).uniform(0.0, states.duration) for _ in range(6))]:
        expected = {key(packet): packet for due, packet in packets if due <= time and len(packet) <= LARGEST}
        assert {key(packet): packet for packet in states.state_at(time)} == expected


def test_changes_on_the_way_lead_to_the_state_at_the_end(states):
    latest = {key(packet): packet for packet in states.state_at(3.0)}
    times = [3.0 + 0.2 * step for step in range(100)]
    for begin, end in pairwise(times):
        latest |= {key(packet): packet for packet in states.changes(begin, end)}
    assert latest == {key(packet): packet for packet in states.state_at(times[-1])}


def test_tracks_names_and_log_book_are_those_of_the_log(log, states):
    assert states.names.system_name(states.owner) == "lauv-noptilus-1"
    assert len(states.tracks[states.owner]) == pytest.approx(states.duration, abs=3.0)
    _, lat, lon, _ = states.tracks[states.owner][-1]
    assert (lat, lon) == pytest.approx((41.185, -8.706), abs=0.001)
    entries = [getattr(message, "text", "") for message in imc.Log(log).messages("LogBookEntry")]
    assert [entry.text for _, entry in states.entries] == entries != []


def test_a_truncated_log_is_read_up_to_its_end(log, tmp_path):
    (tmp_path / "cut").mkdir()
    for name in ("Data.lsf.gz", "IMC.xml.gz"):
        (tmp_path / "cut" / name).write_bytes((log / name).read_bytes())
    data = tmp_path / "cut" / "Data.lsf.gz"
    data.write_bytes(data.read_bytes()[: data.stat().st_size // 2])
    states = LogStates(tmp_path / "cut")
    assert 0.0 < states.duration < SECONDS - 10.0
    assert states.losses
    assert key(states.state_at(states.duration)[-1])[1] == states.owner
    states.close()


def test_a_file_without_messages_is_no_log(tmp_path):
    (tmp_path / "Data.lsf").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="there is no message in this log"):
        LogStates(tmp_path)
