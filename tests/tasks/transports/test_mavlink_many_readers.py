"""Stations that read files of a shipped vehicle over TCP, many at once or too slowly: what each gets."""

from collections import Counter

import pytest

from mavlink.vehicle.files.ftp_messages import LAYOUT, FtpOpcode
from mavlink.vehicle.session import FILE_PERIOD, PACKETS_AT_ONCE
from tests.tasks.transports.mavlink_tcp_lines import ConnectedVehicle

FTP = "FILE_TRANSFER_PROTOCOL"
ONE_READER = PACKETS_AT_ONCE / FILE_PERIOD  # packets per second


@pytest.fixture
def vehicle(tmp_path):
    made = ConnectedVehicle("lauv-noptilus-1", tmp_path)
    large = made.vehicle.log_folder / "large.bin"
    large.write_bytes(bytes(range(256)) * 1000)
    made.path = b"/logs/" + str(large.relative_to(made.vehicle.log_root / made.vehicle.name)).encode()
    yield made
    made.close()


def ask(line, number, opcode, data=b"", size=239):
    payload = LAYOUT.pack(number, 0, opcode, len(data) or size, 0, 0, 0) + data
    line.send(FTP, payload=payload)


def packets(messages):
    """Offset and data of each packet of a burst."""
    for message in messages:
        if message.name == FTP:
            payload = bytes(message.values["payload"])
            _, _, _, size, asked, _, offset = LAYOUT.unpack(payload[: LAYOUT.size])
            if asked == FtpOpcode.BURST:
                yield offset, payload[LAYOUT.size : LAYOUT.size + size]


def begin(vehicle, room=0):
    line = vehicle.connect(room)
    ask(line, 1, FtpOpcode.OPEN, vehicle.path)
    vehicle.vehicle.run(0.1)
    line.read()
    return line


@pytest.mark.heavy
@pytest.mark.computing
def test_many_readers_together_get_no_more_packets_than_one(vehicle):
    lines, received = [begin(vehicle) for _ in range(7)], Counter()
    for line in lines:
        ask(line, 2, FtpOpcode.BURST)
    for _ in range(100):
        vehicle.vehicle.run(0.01)
        for number, line in enumerate(lines):
            received[number] += sum(1 for _ in packets(line.read()))
    assert sum(received.values()) <= 1.1 * ONE_READER, received
    assert min(received.values()) >= 150, received


@pytest.mark.heavy
@pytest.mark.computing
def test_a_reader_that_stops_for_a_while_gets_all_packets_of_its_burst(vehicle):
    line = begin(vehicle, room=4096)
    ask(line, 2, FtpOpcode.BURST)
    vehicle.vehicle.run(20.0)
    whole = {}
    for _ in range(300):
        vehicle.vehicle.run(0.05)
        whole.update(packets(line.read()))
    assert sorted(whole) == list(range(0, 500 * 239, 239))
    data = b"".join(whole[offset] for offset in sorted(whole))
    assert data == (bytes(range(256)) * 1000)[: len(data)]
