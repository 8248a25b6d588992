"""Signed links on sockets: pymavlink's own station with a key, strangers without one, and what a restart remembers."""

import contextlib
import errno
import hashlib
import os
import socket
import subprocess
import sys
import time

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as upstream

import imc
from mavlink import split
from runtime import State
from runtime.kernel import ScaledClock, WallClock
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle
from tasks.transports.mavlink import MAVLink
from tests.outside import NO_FILE, free_port
from tests.tasks.transports.mavlink_station import DIALECT, HOST, Station, mavlink, sail, told, until

WORDS = "sardines in oil"
KEY = hashlib.sha256(WORDS.encode()).digest()


@pytest.fixture
def key(tmp_path):
    path = tmp_path / "mavlink.key"
    path.write_text(WORDS + "\n")
    path.chmod(0o600)
    return path


@pytest.fixture
def station(monkeypatch):
    """Makes a station by mavutil, which signs with a key."""
    monkeypatch.setenv("MAVLINK20", "1")
    mavutil.set_dialect("ardupilotmega")
    made = []

    def make(place, key=KEY, **more):
        found = mavutil.mavlink_connection(place, source_system=255, source_component=190)
        found.setup_signing(key, **more)
        made.append(found)
        return found

    yield make
    for each in made:
        each.close()


async def answer(control, station, command=519, seconds=3.0):
    """The result of a command, None if there is no answer."""
    station.mav.command_long_send(26, 1, command, 0, 0, 0, 0, 0, 0, 0, 0)
    for _ in range(round(seconds / 0.02)):
        while message := station.recv_msg():
            if message.get_type() == "COMMAND_ACK":
                assert message.get_signed()
                return message.result
        await control.sleep(0.02)
    return None


def test_a_station_of_pymavlink_with_the_key_is_heard_and_hears(key, station):
    async def script(control):
        udp, tcp = station(f"udpout:{HOST}:{port}"), station(f"tcp:{HOST}:{other}")
        for each in (udp, tcp):
            assert await answer(control, each) == 0
            assert (each.mav.signing.badsig_count, each.mav.signing.reject_count) == (0, 0)
            assert each.mav.signing.goodsig_count > 0
        assert not +mavlink(control).link_set.drop_counts

    port, other = free_port(), free_port()
    run = sail(script, f"udpin://{HOST}:{port}?key={key}", f"tcpin://{HOST}:{other}?key={key}", clock=WallClock())
    assert told(run) == []
    assert not [text for text in (*run.log, *map(str, run.messages)) if WORDS in text or KEY.hex() in text]


@pytest.mark.heavy
def test_strangers_get_nothing_and_are_counted(key, station):
    async def script(control):
        plain, wrong = Station(control, system=254), station(f"udpout:{HOST}:{port}", bytes(32))
        plain.vehicle = (HOST, port)
        plain.order(400, 1)
        assert await answer(control, wrong, 400, seconds=0.3) is None
        assert await plain.quiet(0.3) == []
        task = mavlink(control)
        assert (task.link_set.drop_counts["unsigned"], task.link_set.drop_counts["forged"]) == (1, 1)
        assert not task.endpoint.model.armed
        assert task.endpoint.sessions == []
        good = station(f"udpout:{HOST}:{port}")
        assert await answer(control, good) == 0
        await until(control, lambda: "forged 1, unsigned 1" in task.entity.description)

    port = free_port()
    sail(script, f"udpin://{HOST}:{port}?key={key}", clock=WallClock())


def test_what_was_recorded_is_not_obeyed_again_on_another_link_either(key, station):
    async def script(control):
        good = station(f"udpout:{HOST}:{ports[0]}")
        recorded, write = [], good.write
        good.write = lambda data: (recorded.append(bytes(data)), write(data))
        assert await answer(control, good) == 0
        thief = Station(control)
        for thief.vehicle in ((HOST, port) for port in ports):
            thief.transmit(recorded[0])
        await until(control, lambda: mavlink(control).link_set.drop_counts["replayed"] == 2)
        assert len(mavlink(control).endpoint.sessions) == 1
        assert await answer(control, good) == 0

    ports = free_port(), free_port()
    sail(script, *(f"udpin://{HOST}:{port}?key={key}" for port in ports), clock=WallClock())


def test_a_forged_time_locks_nobody_out(key, station):
    async def script(control):
        good = station(f"udpout:{HOST}:{port}")
        forger = station(f"udpout:{HOST}:{port}", bytes(32), initial_timestamp=(1 << 48) - 10, link_id=0)
        good.mav.signing.link_id = 0
        assert await answer(control, good) == 0
        assert await answer(control, forger, seconds=0.2) is None
        assert await answer(control, good) == 0
        assert mavlink(control).link_set.drop_counts["forged"] == 1

    port = free_port()
    sail(script, f"udpin://{HOST}:{port}?key={key}", clock=WallClock())


def test_unsigned_frames_where_the_profile_takes_them_but_no_forged_ones(key, station):
    async def script(control):
        plain, wrong = Station(control, system=254), station(f"udpout:{HOST}:{port}", bytes(32))
        plain.vehicle = (HOST, port)
        plain.order(519)
        assert (await plain.expect("COMMAND_ACK"))["result"] == 0
        assert await answer(control, wrong, seconds=0.3) is None

    port = free_port()
    run = sail(script, f"udpin://{HOST}:{port}?key={key}&unsigned=accept", clock=WallClock())
    assert told(run) == []


def test_a_link_without_a_key_takes_signed_frames_and_no_keys(station):
    async def script(control):
        signed = station(f"udpout:{HOST}:{port}")
        signed.mav.signing.allow_unsigned_callback = lambda mav, number: True
        signed.mav.setup_signing_send(26, 1, list(KEY), 1)
        texts = []
        while not texts:
            texts = [m.text for m in iter(signed.recv_msg, None) if m.get_type() == "STATUSTEXT"]
            await control.sleep(0.02)
        assert texts == ["No keys over the air: give the link a key file"]

    port = free_port()
    run = sail(script, f"udpin://{HOST}:{port}", clock=WallClock())
    assert told(run) == []


def times_of(receiver):
    """The times in the signatures of all that was received."""
    times = []
    while True:
        try:
            (message,), _ = split(receiver.recv(2048), DIALECT)
        except BlockingIOError:
            return times
        times.append(int.from_bytes(message.signature[1:7], "little"))


def sail_for(seconds, start, state_folder, link):
    """Run a vehicle whose computer has a clock that begins at `start`; returns its log book."""
    clock = ScaledClock(10.0, round(start * 1e9))
    vehicle = Vehicle("lauv-noptilus-1", 0x1A, clock=clock, profile=NoProfile(), state_folder=state_folder)
    log = []
    vehicle.observe(imc.LogBookEntry, lambda entry: log.append(entry.text))
    vehicle.add(MAVLink, "Transports.MAVLink", links=[link])
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    return log


@pytest.mark.heavy
def test_times_grow_over_restarts_of_a_computer_without_a_clock(key, tmp_path):
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind((HOST, 0))
    receiver.setblocking(False)
    times = []
    for start in (1_790_000_000.0, 0.0, 0.0):
        sail_for(3.0, start, tmp_path / "db", f"udpout://{HOST}:{receiver.getsockname()[1]}?key={key}")
        now = times_of(receiver)
        assert len(now) > 3
        times += now
    assert times == sorted(set(times))
    assert times[0] == pytest.approx((1_790_000_000.0 - 1420070400) * 1e5, abs=1e5)
    sail_for(3.0, 1_790_001_000.0, tmp_path / "db", f"udpout://{HOST}:{receiver.getsockname()[1]}?key={key}")
    assert times_of(receiver)[0] == pytest.approx((1_790_001_000.0 - 1420070400) * 1e5, abs=1e5), "its clock is right"


@pytest.mark.heavy
def test_a_recorded_termination_is_not_obeyed_after_the_process_was_killed(key, tmp_path):
    """The shipped LAUV is killed after the order, and twice again: a run without a sender forgets nothing either."""
    port = free_port()
    link = f"Transports.MAVLink:Links=udpin://{HOST}:{port}?key={key}"
    command = [sys.executable, "-m", "shoal.cli", "run", "lauv-noptilus-1", "-p", "Simulation", "--log-dir", "log"]
    mav = upstream.MAVLink(None, srcSystem=255, srcComponent=190)
    mav.signing.secret_key, mav.signing.sign_outgoing = KEY, True
    mav.signing.timestamp = round((time.time() - 1420070400) * 1e5)
    order = bytes(mav.command_long_encode(26, 1, 185, 0, 1, 0, 0, 0, 0, 0, 0).pack(mav))

    def acknowledged(seconds, *frames):
        """Whether one of the frames was acknowledged, sent each second."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.settimeout(1.0)
            for _ in range(seconds):
                for frame in frames:
                    sender.sendto(frame, (HOST, port))
                with contextlib.suppress(TimeoutError):
                    while True:
                        messages, _ = split(sender.recv(2048), DIALECT)
                        if any(message.name == "COMMAND_ACK" for message in messages):
                            return True
        return False

    saved = []
    for life in range(3):
        with subprocess.Popen([*command, "--set", link], cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
            next(line for line in process.stdout if "executing maneuver" in line)
            assert acknowledged(30 if life == 0 else 4, order) is (life == 0)
            process.kill()
        saved += [int(path.read_text()) for path in tmp_path.rglob("MAVLink time")]
    assert len(set(saved)) == 1
    assert saved[0] > 0


@pytest.mark.parametrize("content", ["rubbish", "", None])
def test_a_time_that_cannot_be_read_is_named_at_the_start(key, tmp_path, content):
    path = tmp_path / "lauv-noptilus-1" / "MAVLink time"
    path.parent.mkdir()
    if content is None:
        path.mkdir()
        reason = os.strerror(errno.EISDIR)
    else:
        path.write_text(content)
        reason = "holds no time"
    log = sail_for(1.0, 1_790_000_000.0, tmp_path, f"udpout://{HOST}:{free_port()}?key={key}")
    remedy = "earlier frames could be repeated to this vehicle, unless its clock is right"
    assert f"the time of the last signature is unknown: {path}: {reason}: {remedy}" in log


@pytest.mark.heavy
def test_a_disk_that_takes_nothing_is_reported_once(key, tmp_path):
    (tmp_path / "db").write_text("no folder")
    log = sail_for(8.0, 1_790_000_000.0, tmp_path / "db", f"udpout://{HOST}:{free_port()}?key={key}")
    (line,) = [line for line in log if "signatures" in line]
    assert line.startswith("the time of signatures cannot be saved: ")


@pytest.mark.heavy
def test_a_key_that_cannot_be_used_keeps_the_link_closed_until_it_can(key):
    async def script(control):
        task = mavlink(control)
        reason = f"udpin://{HOST}:{port}: the key {key} cannot be used: "
        for words, prepare in (
            (NO_FILE, key.unlink),
            ("it is no file", key.mkdir),
            ("it holds neither 32 bytes", lambda: (key.rmdir(), key.write_bytes(b"\n"))),
        ):
            prepare()
            await until(control, lambda words=words: reason + words in task.entity.description)
            assert task.entity.state is State.ERROR
        key.write_bytes(KEY)
        key.chmod(0o644)
        await until(control, lambda: task.entity.state is State.NORMAL)

    port = free_port()
    key.unlink()
    key.write_text("")
    run = sail(script, f"udpin://{HOST}:{port}?key={key}", clock=ScaledClock(5.0))
    assert told(run)[-1] == f"other users of this computer can read the key: chmod 600 {key}"
    assert len(told(run)) == 5
