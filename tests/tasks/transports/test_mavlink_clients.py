"""MAVSDK and MAVProxy as installed by users, with a vehicle in real time."""

import contextlib
import json
import math
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import imc
from runtime import Task, param, periodic
from runtime.kernel import WallClock
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle
from tasks.transports.mavlink import MAVLink
from tests.outside import free_port
from tests.tasks.transports.mavproxy import MAVProxy

PATIENCE = 30.0
STATE = imc.EstimatedState(
    lat=math.radians(41.1850),
    lon=math.radians(-8.7060),
    height=55.0,
    x=300.0,
    y=-400.0,
    z=12.25,
    depth=12.25,
    phi=0.1,
    theta=-0.2,
    psi=-1.0,
    p=0.01,
    q=0.02,
    r=-0.03,
    vx=1.0,
    vy=-2.0,
    vz=0.5,
    alt=8.0,
)
LAT, LON = 41.1877012, -8.7107677  # where STATE is, in degrees


class Surveyor(Task):
    """Publishes the position of the vehicle, and has parameters."""

    gain: float = param(0.5, "1", "Gain.", minimum=0, maximum=10)
    beams: int = param(3, "1", "Beams.")
    window: str = param("hann", "", "Window.", choices=("none", "hann", "hamming"))

    @periodic(10.0)
    def locate(self) -> None:
        self.publish(STATE)


@contextlib.contextmanager
def afloat(flavor, link="udpout://127.0.0.1:{port}?flavor={flavor}"):
    """A vehicle in its own thread, its task Surveyor, and the port of its link."""
    port = free_port()
    vehicle = Vehicle("lauv-noptilus-1", 0x1A, clock=WallClock(), profile=NoProfile())
    surveyor = vehicle.add(Surveyor, "Surveyor")
    vehicle.add(MAVLink, "Transports.MAVLink", links=[link.format(port=port, flavor=flavor)])
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    try:
        yield surveyor, port
    finally:
        vehicle.kernel.post(vehicle.stop)
        thread.join(PATIENCE)
        vehicle.close()


@pytest.mark.heavy
def test_mavsdk():
    with afloat("px4") as (surveyor, port):
        command = [sys.executable, str(Path(__file__).with_name("mavsdk_client.py")), str(port)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=2 * PATIENCE, check=False)
        assert done.returncode == 0, done.stderr
        seen = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))
        assert (surveyor.gain, surveyor.beams) == (2.25, -123456789)

    assert seen["position"] == {
        "latitude_deg": pytest.approx(LAT, abs=2e-7),
        "longitude_deg": pytest.approx(LON, abs=2e-7),
        "absolute_altitude_m": pytest.approx(-12.25, abs=1e-3),
        "relative_altitude_m": pytest.approx(-12.25, abs=1e-3),
    }
    euler = {name: value for name, value in seen["attitude_euler"].items() if name != "timestamp_us"}
    assert euler == {
        "roll_deg": pytest.approx(math.degrees(0.1), abs=1e-4),
        "pitch_deg": pytest.approx(math.degrees(-0.2), abs=1e-4),
        "yaw_deg": pytest.approx(math.degrees(-1.0), abs=1e-4),
    }
    assert list(seen["attitude_angular_velocity_body"].values()) == pytest.approx([0.01, 0.02, -0.03], abs=1e-6)
    assert list(seen["velocity_ned"].values()) == pytest.approx([1.0, -2.0, 0.5], abs=1e-2)
    assert seen["local"] == pytest.approx({"north_m": 300.0, "east_m": -400.0, "down_m": 12.25}, abs=1e-3)
    assert (seen["home"]["latitude_deg"], seen["home"]["longitude_deg"]) == pytest.approx((41.185, -8.706), abs=2e-7)
    assert seen["home"]["absolute_altitude_m"] == 0.0

    assert seen["parameters"].items() >= {"SURVEYOR_GAIN": 0.5, "SURVEYOR_BEAMS": 3, "SURVEYOR_WINDOW": 1}.items()
    assert (seen["before"], seen["after"]) == ([0.5, 3], [2.25, -123456789])
    assert ["VALUE_OUT_OF_RANGE" in seen["errors"][0], "DOES_NOT_EXIST" in seen["errors"][1]] == [True, True]
    assert (seen["armable"], seen["armed"], seen["mode"], seen["version"]) == (True, True, "HOLD", 1)
    assert "FAILED" in seen["refused"], "there is no plan engine"


@pytest.mark.heavy
def test_mavproxy(tmp_path):
    with afloat("ardupilot") as (surveyor, port):
        with MAVProxy(port, tmp_path) as console:
            count = int(console.expect(r"Received (\d+) parameters").group(1))
            console.expect(
                r"SURVEYOR_BEAMS +3(?:\.0)?\s+SURVEYOR_GAIN +0\.5\s+SURVEYOR_WINDOW +1(?:\.0)?", "param show SURVEYOR*"
            )
            console.expect(r"SURVEYOR_GAIN +2\.5", "param set SURVEYOR_GAIN 2.5\nparam show SURVEYOR_GAIN")
            position, attitude = console.status("GLOBAL_POSITION_INT"), console.status("ATTITUDE")
            console.expect(r"COMPONENT_ARM_DISARM: ACCEPTED\s+ARMED", "arm throttle")
            console.expect(r"Mode POSHOLD", "mode POSHOLD")
            console.expect(r"DO_SET_MODE: DENIED[\s\S]*Mode MISSION denied", "mode AUTO")
            console.expect(r"Requesting 0 waypoints", "wp list")
        assert surveyor.gain == 2.5

    assert count >= 8
    assert [position["lat"], position["lon"]] == pytest.approx([LAT * 1e7, LON * 1e7], abs=2)
    assert [position[name] for name in ("alt", "relative_alt", "vx", "vy", "vz", "hdg")] == [
        -12250,
        -12250,
        100,
        -200,
        50,
        round((360.0 - math.degrees(1.0)) * 100),
    ]
    expected = {"roll": 0.1, "pitch": -0.2, "yaw": -1.0, "rollspeed": 0.01, "pitchspeed": 0.02, "yawspeed": -0.03}
    assert {name: attitude[name] for name in expected} == pytest.approx(expected, abs=1e-6)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("link", "scheme"), [("tcpin://127.0.0.1:{port}", "tcp"), ("udpin://127.0.0.1:{port}?key={key}", "udpout")]
)
def test_mavproxy_by_tcp_and_signed(tmp_path, link, scheme):
    key = tmp_path / "mavlink.key"
    key.write_text("sardines\n")
    with (
        afloat("ardupilot", link.replace("{key}", str(key))) as (_, port),
        MAVProxy(port, tmp_path, scheme) as console,
    ):
        if "key" in link:
            time.sleep(1.0)
            assert "Detected vehicle" not in console.output
            console.expect(r"Setup signing key", "signing key sardines")
        console.expect(r"Detected vehicle 26:1")
        console.expect(r"COMPONENT_ARM_DISARM: ACCEPTED\s+ARMED", "arm throttle")
