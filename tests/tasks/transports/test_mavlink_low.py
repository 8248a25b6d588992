"""Links for radios and satellites: what a shipped vehicle in its plan sends there."""

import socket
from collections import Counter

import pytest

from mavlink import encode, parse_link_url, split
from mavlink.vehicle.telemetry.streams import STREAMS
from shoal.missions import parse_plan
from tasks.transports.mavlink import MAVLink
from tasks.transports.mavlink_links.stream_links import StreamLink
from tests.tasks.transports.mavlink_station import DIALECT, HOST, Station
from tests.tasks.transports.test_mavlink_vehicles import PLANS, Commanded


@pytest.mark.heavy
def test_a_link_with_low_rates_takes_less_than_300_bytes_a_second(tmp_path):
    key = tmp_path / "key"
    key.write_bytes(bytes(range(200, 232)))
    station = Station(None)
    station.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    flown = Commanded("lauv-noptilus-1", tmp_path)
    vehicle, kernel = flown.vehicle, flown.vehicle.kernel
    sizes, names, whole = Counter(), Counter(), [0]

    def read():
        """Count what arrives in each second, and say that a station is there."""
        whole.append(0)
        while True:
            try:
                frame, station.vehicle = station.socket.recvfrom(2048)
            except BlockingIOError:
                break
            (message,), _ = split(frame, DIALECT)
            sizes[message.name] += len(frame)
            names[message.name] += 1
            whole[-1] += len(frame)
        kernel.after(1.0, read)

    def want():
        """What stations send when they connect."""
        session = flown.low.endpoint.sessions[0]
        for name, fields in (
            ("HEARTBEAT", {"type": 6}),
            ("REQUEST_DATA_STREAM", {"req_message_rate": 4, "start_stop": 1}),
            ("PARAM_REQUEST_LIST", {}),
        ):
            (message,), _ = split(station.frame(name, target_system=26, target_component=1, **fields), DIALECT)
            flown.low.receive(flown.low.link_set.links[0], next(iter(flown.low.link_set.links[0].sessions)), message)
        assert session.contact
        for number in range(100):
            words = f"the text with the number {number} of many in a few seconds"
            kernel.after(0.1 * number, lambda words=words: flown.low.endpoint.send_statustext(6, words, flown.low.now))

    links = [f"udpout://{HOST}:{station.port}?rates=low&key={key}"]
    flown.low = vehicle.add(MAVLink, "Transports.MAVLink/Low", links=links, vehicle_kind="submarine")
    vehicle.start()
    kernel.after(15.0, flown.begin, parse_plan(PLANS["lauv-noptilus-1"]))
    kernel.after(1.0, read)
    vehicle.run(25.0)
    assert flown.modes[-1] == "MISSION"
    whole.clear()
    sizes.clear()
    names.clear()
    vehicle.run(20.0)
    streamed = {name: count / 20.0 for name, count in names.items() if name != "STATUSTEXT"}
    assert streamed == {name: stream.low for name, stream in STREAMS.items() if stream.low}
    assert sum(whole) / 20.0 < 150
    want()
    whole.clear()
    vehicle.run(20.0)
    assert names["STATUSTEXT"] > 10
    assert names["PARAM_VALUE"] > 30
    assert sum(whole) / 20.0 < 300
    vehicle.close()


def test_parameters_leave_half_of_a_slow_line(tmp_path):
    flown = Commanded("lauv-noptilus-1", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(0.1)
    sent = []
    line = StreamLink(parse_link_url("serial:///dev/ttyUSB0?baud=57600"), 0, flown.link)
    session = flown.link.connect_peer(line, sent.append)
    now = began = flown.link.now
    definition = DIALECT.by_name["PARAM_REQUEST_LIST"]
    (message,), _ = split(encode(definition, definition.pack({"target_system": 26}), 0, 255, 190), DIALECT)
    flown.link.endpoint.dispatch(session, message, now)
    while now < began + 2.0:
        now = session.poll(now)
    listed = [len(frame) for frame in sent if int.from_bytes(frame[7:10], "little") == 22]
    assert 0.3 * 5760 <= sum(listed) / 2.0 <= 0.5 * 5760
    flown.vehicle.close()
