"""Links of lines and floods: noise, frames that never end, who does not read, lost frames, rubbish."""

import contextlib
import os
import socket
import threading
import time

import pytest

from runtime import State
from runtime.kernel import ScaledClock, WallClock
from tests.outside import free_port
from tests.tasks.transports.mavlink_station import (
    FAST,
    HOST,
    SerialStation,
    Station,
    greet,
    mavlink,
    sail,
    told,
    until,
)


@pytest.fixture
def line(tmp_path):
    return tmp_path / "ttyTEST"


@pytest.mark.heavy
def test_a_serial_line_with_noise_and_a_frame_that_never_ends(line):
    async def script(control):
        station = SerialStation(control, line)
        task = mavlink(control)
        await station.expect("HEARTBEAT")
        await greet(station)
        station.transmit(os.urandom(2000).replace(b"\xfd", b"\0").replace(b"\xfe", b"\0"))
        station.order(519)
        assert (await station.expect("COMMAND_ACK"))["command"] == 519
        station.transmit(b"\xfd\xff\x00\x00")  # the beginning of 280 bytes
        began = control.now
        station.order(520)
        assert (await station.expect("COMMAND_ACK"))["command"] == 520
        assert control.now - began < 3.0 * FAST
        await until(control, lambda: "malformed" in task.entity.description)
        station.unplug()
        await until(control, lambda: task.entity.state is State.ERROR)
        assert f"serial://{line}: " in task.entity.description
        station.plug()
        await station.expect("HEARTBEAT")
        await greet(station)

    run = sail(script, f"serial://{line}?baud=57600", clock=ScaledClock(FAST))
    assert sum("unplugged" in text for text in run.log) == 1


@pytest.mark.heavy
def test_a_line_that_is_not_read_holds_up_nobody(line):
    async def script(control):
        station, other = SerialStation(control, line), Station(control, port)
        await station.expect("HEARTBEAT")
        await other.expect("HEARTBEAT")
        session = next(iter(mavlink(control).link_set.links[0].sessions.values()))
        for _ in range(1000):
            session.build_and_send("SYSTEM_TIME", control.now)
        await greet(other)
        await until(control, lambda: any(m.values["time_unix_usec"] >= control.now * 1e6 - 3e6 for m in beats(station)))
        assert station.damages == 0

    def beats(station):
        return [message for message in station.take() if message.name == "SYSTEM_TIME"]

    port = free_port()
    sail(script, f"serial://{line}", f"udpout://{HOST}:{port}", clock=ScaledClock(FAST))


def test_lost_frames_are_counted_for_each_sender():
    async def script(control):
        one, other = Station(control, system=255), Station(control, system=254)
        one.vehicle = other.vehicle = (HOST, port)
        for number in (250, 251, 254, 253, 255, 0, 0, 3):
            one.transmit(one.frame("HEARTBEAT", number, type=6))
        for number in (7, 8, 100, 101, 102):
            other.transmit(other.frame("HEARTBEAT", number, type=6))
        losses = f"udpin://{HOST}:{port}: lost 91 of 96 from 254/190, lost 3 of 10 from 255/190"
        await until(control, lambda: losses in mavlink(control).entity.description)
        for number in (50, 51, 52):  # begun anew
            other.transmit(other.frame("HEARTBEAT", number, type=6))
        await until(control, lambda: "lost 90 of 98 from 254/190" in mavlink(control).entity.description)

    port = free_port()
    sail(script, f"udpin://{HOST}:{port}")


@contextlib.contextmanager
def flooded(place, data, kind):
    """Send 1 MB/s from another thread; a connection that is ended is made again."""

    def send():
        sender, due = None, time.monotonic()
        while not done.wait(max(0.0, due - time.monotonic())):
            due += 0.01
            try:
                if sender is None:
                    sender = socket.socket(socket.AF_INET, kind)
                    sender.connect(place)
                for begin in range(0, 10_000, 1000):
                    sender.sendall(data[begin : begin + 1000])
            except OSError:
                sender = None

    done = threading.Event()
    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@pytest.mark.parametrize("scheme", ["udpin", "tcpin"])
@pytest.mark.parametrize("what", ["noise", "wrong sums", "wrong targets"])
def test_telemetry_and_answers_go_on_in_a_megabyte_of_rubbish_a_second(scheme, what):
    async def script(control):
        station = Station(control)
        station.vehicle = (HOST, good)
        station.order(511, 2, 20_000)
        await station.expect("SYSTEM_TIME")
        with flooded((HOST, bad), data, kind):
            for _ in range(25):
                await station.expect("SYSTEM_TIME")
            await greet(station)
        assert (
            mavlink(control).link_set.drop_counts["dropped"] > 100
            or mavlink(control).link_set.drop_counts["cut off"] > 2
        )

    kind = socket.SOCK_DGRAM if scheme == "udpin" else socket.SOCK_STREAM
    frame = Station(None).frame("COMMAND_LONG", target_system=99, command=400, param1=1)
    frames = {"noise": os.urandom(10_000), "wrong sums": frame[:-1] + bytes((frame[-1] ^ 1,)), "wrong targets": frame}
    data = (frames[what] * 1000)[:10_000]
    good, bad = free_port(), free_port()
    run = sail(script, f"udpin://{HOST}:{good}", f"{scheme}://{HOST}:{bad}", clock=WallClock())
    assert len(told(run)) <= 2, "named once each, however many connections are made"
