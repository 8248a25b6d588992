"""Strict clients as users install them, MAVSDK and pymavlink, use shipped vehicles step by step."""

import contextlib
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from shoal.missions import prepare
from tests.outside import free_port
from tests.repeats import repeat

PATIENCE = 600.0  # s; of a program that hangs
CLOCK = 3.0  # times real time
DO_SET_MODE, ARM, TAKEOFF = 176, 400, 22
ACCEPTED, DENIED = 0, 2
COPTER_HOLD, COPTER_GUIDED, NO_MODE = 5, 4, 99


@contextlib.contextmanager
def afloat(profile, link, folder):
    """A shipped vehicle in its own thread, on a computer that may be busy."""
    overrides = [f"Transports.MAVLink:Links={link}"]
    overrides += [f"{section}:Enabled=Never" for section in ("Plan.Autostart", "Monitors.HostResources")]
    folders = {"log_root": folder / "log", "state_folder": folder / "db"}
    vehicle = prepare(profile, clock=f"{CLOCK:g}x", overrides=overrides, **folders).vehicle
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    try:
        yield vehicle
    finally:
        vehicle.kernel.post(vehicle.stop)
        thread.join(PATIENCE)
        vehicle.close()


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "kind"),
    [repeat(("lauv-noptilus-1", "submarine")), repeat(("otter", "boat")), ("hexa-00", "hexacopter")],
)
def test_mavsdk_takes_each_step(profile, kind, tmp_path):
    port = free_port()
    with afloat(profile, f"udpout:127.0.0.1:{port}:px4", tmp_path):
        command = [sys.executable, str(Path(__file__).with_name("mavsdk_steps_client.py")), str(port), kind]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.stdout, done.stderr
    seen = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))
    orders = {"arm": seen["arm"], "upload": "done", "start": "MISSION", "pause": "HOLD", "resume": "MISSION"}
    orders |= {"fence": True, "finished": True, "disarmed": "done"}
    assert {name: seen[name] for name in orders} == orders
    assert "Error" not in str(seen["arm"])
    assert abs(seen["attitude_quaternion"]["w"]) <= 1.0
    assert seen["imu"]["acceleration_frd"]["down_m_s2"] == pytest.approx(-9.8, abs=2.0)
    assert abs(seen["odometry"]["position_body"]["x_m"]) < 50.0
    assert abs(seen["odometry"]["q"]["w"]) <= 1.0
    if kind == "hexacopter":
        assert seen["takeoff"] == [8.0, pytest.approx(8.0, abs=2.0)]
        assert seen["scaled_pressure"]["absolute_pressure_hpa"] == pytest.approx(1003.0, abs=15.0)
    if kind == "submarine":
        assert "ACTION_UNSUPPORTED" in seen["photo"], "its camera reports places, and has no pictures"


class PymavlinkPeer:
    """A program that uses pymavlink, at the other end of a link."""

    def __init__(self, port):
        os.environ["MAVLINK20"] = "1"
        from pymavlink import mavutil

        self.link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=255, dialect="ardupilotmega")
        self.modes, self.position = [], None
        self._greeted = 0.0
        self.vehicle = self.wait("HEARTBEAT").get_srcSystem()

    def wait(self, name, where=lambda message: True, seconds=PATIENCE):
        """The next such message; None if there is none in time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if time.monotonic() - self._greeted > 0.5:
                self.link.mav.heartbeat_send(6, 8, 0, 0, 0)
                self._greeted = time.monotonic()
            message = self.link.recv_match(blocking=True, timeout=0.05)
            if message is None:
                continue
            kind = message.get_type()
            if kind == "HEARTBEAT" and message.get_srcComponent() == 1:
                self.modes.append(message.custom_mode)
            if kind == "GLOBAL_POSITION_INT":
                self.position = message
            if kind == name and where(message):
                return message
        return None

    def order(self, command, *params):
        self.link.mav.command_long_send(self.vehicle, 1, command, 0, *params, *[0] * (7 - len(params)))
        return self.wait("COMMAND_ACK", lambda message: message.command == command, 10.0).result

    def armed(self):
        """Arm as soon as the vehicle is ready."""
        end = time.monotonic() + PATIENCE
        while (result := self.order(ARM, 1)) != ACCEPTED and time.monotonic() < end:
            self.wait("HEARTBEAT")
        return result


@pytest.mark.heavy
def test_an_ardupilot_stays_in_the_mode_of_its_order_and_rejected_modes_change_nothing(tmp_path):
    port = free_port()
    with afloat("hexa-00", f"udpin:127.0.0.1:{port}:ardupilot", tmp_path):
        peer = PymavlinkPeer(port)
        peer.wait("GLOBAL_POSITION_INT")
        assert peer.order(DO_SET_MODE, 1, COPTER_HOLD) == ACCEPTED
        assert peer.armed() == ACCEPTED
        assert peer.order(TAKEOFF, 0, 0, 0, 0, 0, 0, 10.0) == ACCEPTED
        peer.wait("HEARTBEAT", lambda beat: beat.custom_mode == COPTER_GUIDED)
        peer.modes.clear()
        peer.wait("GLOBAL_POSITION_INT", lambda place: place.relative_alt > 9_000)
        results = []
        for _ in range(5):
            results.append(peer.order(DO_SET_MODE, 1, NO_MODE))
            peer.wait("HEARTBEAT", seconds=2.0)
            peer.wait("HEARTBEAT", seconds=2.0)
        assert set(results) == {DENIED}
        assert set(peer.modes) == {COPTER_GUIDED}, "it has arrived, and holds there in GUIDED"
        assert peer.order(DO_SET_MODE, 1, COPTER_HOLD) == ACCEPTED
        assert peer.wait("HEARTBEAT", lambda beat: beat.custom_mode == COPTER_HOLD, 10.0)
